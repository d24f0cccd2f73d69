"""A first effect that only counts beside a second one: most of what it leaves alone is the other's."""

from types import SimpleNamespace

import numpy as np
import pytest
from helpers_made_up_steps import model, step

from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.diagnosis.selection import selection_step
from crash_estimator.model_file import load_model
from crash_replay.recording import Channel, Recording, Test

MASS, STIFFNESS, LIMIT, LAG = 0.639, 15e3, 20.0, 2e-4
"""kg, N/m, N and s: of an impactor whose spring pushes no harder than a limit, and whose sensor is late."""


def impact() -> Recording:
    """An impactor's crush, its rate, and its body's deceleration, in which a case rings with 270 Hz."""
    step, fine = 1e-4, 1e-6
    every = np.arange(-0.02, 0.06, fine)
    moves = np.maximum(every, 0.0)
    crush = 2e-3 * np.exp(-moves / 0.03) * np.sin(2.0 * np.pi * 50.0 * moves)
    rings = 0.3 * np.exp(-moves / 0.05) * np.sin(2.0 * np.pi * 270.0 * moves)
    late = np.roll(np.clip(STIFFNESS * crush, -LIMIT, LIMIT), round(LAG / fine))
    rng = np.random.default_rng(5)
    shown = [
        (one + rng.normal(0.0, noise, len(one)))[:: round(step / fine)]
        for one, noise in ((rings - late / MASS, 0.03), (crush, 1e-7), (np.gradient(crush, fine), 1e-4))
    ]
    channels = (
        Channel("body_ax", "acceleration", "body", "x"), Channel("rel_displacement", "displacement"),
        Channel("rel_velocity", "velocity"),
    )  # fmt: skip
    time = every[:: round(step / fine)]
    return Recording(Test("impact", channels), np.rint(time * 1e9).astype(np.int64), np.stack(shown, axis=1))


def test_a_force_limiter_is_named_beside_a_sensor_that_is_late():
    """The lag leaves a quarter of the misfit, in the very band of the limiter: in noise as large as that nothing of the
    five whole swings counted, and the test was `unexplained`."""
    found = diagnose(load_model("impactor_spring"), [impact()])
    assert [one.effect for one in found.steps] == ["yielding", "channel_delay"] and found.verdict == "effect_missing"
    limiter, lag = found.steps
    assert STIFFNESS * limiter.shape["yield_crush"] == pytest.approx(LIMIT, rel=0.05)
    assert lag.coefficient == pytest.approx(LAG, rel=0.05)
    assert found.left.rms < 0.15 * found.left_before.rms


def asked_for(monkeypatch, explains, quieter, gain):
    """A step of which nothing counts alone, weighed beside a second one; -> what is told of it, and what was fitted."""
    fitted = []
    recorded, done = step(model(500.0)), step(model(500.0), 3.0)
    made_up = {
        "band_of_steps": lambda path: 60,
        "as_fitted": lambda before, best: model(100.0, 1),
        "share_explained": lambda before, larger, band: explains,
        "in_recorded_noise": lambda m, e, larger: fitted.append("second") or "second",
        "_noise_left_by": lambda second, records: quieter,
        "_quietness": lambda records: records or 0.0,
        "_in_larger_noise": lambda m, e, recorded, noise, found: fitted.append("again") or step(model(500.0), gain),
        "evenly_fitted": lambda before, band: "sized",
        "analyse": lambda fitted: model(100.0),
    }
    for name, instead in made_up.items():
        monkeypatch.setattr(selection_step, name, instead)
    found = selection_step.weighed_beside_a_second(None, {}, recorded, done)
    return found is not done, fitted


@pytest.mark.parametrize(("explains", "quieter", "gain", "told", "fitted"), [
    (0.6, 2.0, 30.0, True, ["second", "again"]),
    (0.4, 2.0, 30.0, False, []),  # of which little is explained
    (0.6, 0.01, 30.0, False, ["second"]),  # two leave as much as one
    (0.6, 2.0, 3.0, False, ["second", "again"]),  # nor does anything count then
])  # fmt: skip
def test_when_a_step_is_weighed_beside_a_second_one(monkeypatch, explains, quieter, gain, told, fitted):
    assert asked_for(monkeypatch, explains, quieter, gain) == (told, fitted)


@pytest.mark.parametrize("done", [
    step(model(500.0), 30.0),  # something counts
    step(model(1.0), 3.0),  # only noise is left
])  # fmt: skip
def test_a_step_of_which_something_counts_or_noise_is_left_stays(monkeypatch, done):
    monkeypatch.setattr(selection_step, "in_recorded_noise", lambda *given: pytest.fail("it was asked for a second"))
    monkeypatch.setattr(selection_step, "analyse", lambda fitted: SimpleNamespace(white=False))
    assert selection_step.weighed_beside_a_second(None, {}, step(model(500.0)), done) is done
