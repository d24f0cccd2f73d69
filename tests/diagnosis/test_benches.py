"""What else than a crash is put on a bench: a cart on a spring that is let go, a damper between a rod and a frame.

The cart is simulated here, in steps of 50 us; friction sticks (Karnopp). An encoder shows it at 200 Hz.
"""

from dataclasses import replace

import numpy as np
import pytest

from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.diagnosis.report import diagnosis
from crash_estimator.core.diagnosis.report.verdict import Verdict
from crash_estimator.core.effects.applied import applied
from crash_estimator.core.structure import Body, Coefficient, Element, Structure
from crash_estimator.diagnosis_tables import steps_table
from crash_replay.gravity import G
from crash_replay.recording import Channel, Recording, Test

MASS, STIFFNESS, DAMPING, LET_GO_AT = 0.6, 400.0, 0.6, 0.03


def swing(
    friction: float, damping: float = DAMPING, noise: float = 5e-6, rebound: float = 1.0, relaxing=(0.0, 1.0)
) -> Recording:
    """4 s, some 16 periods; rebound: times as much damping where the cart moves away from the wall; relaxing: stiffness
    of a spring behind a damper, and its time. The cart was held for long."""
    step, every = 5e-5, 100
    x, v, relaxed, shown = LET_GO_AT, 0.0, 0.0, []
    for k in range(int(4.0 / step)):
        if k % every == 0:
            shown.append(x)
        rest = -STIFFNESS * x - damping * (v if v > 0.0 else rebound * v) - relaxed
        sticks = abs(v) < 1e-4 and abs(rest) <= friction
        v = 0.0 if sticks else v + step * (rest - friction * np.sign(v or rest)) / MASS
        x += step * v
        relaxed += step * (relaxing[0] * v - relaxed / relaxing[1])
    measured = np.array(shown) + np.random.default_rng(3).normal(0.0, noise, len(shown))
    at = {"initial_displacement": {"cart": LET_GO_AT}, "initial_velocity": {"cart": 0.0}}
    test = Test("swing", (Channel("cart_x", "displacement", "cart", "x"),), **at)
    return Recording(test, np.arange(len(shown)) * 5_000_000, measured[:, None])


def test_a_damper_with_valves_is_told_where_the_model_has_one_without():
    """It takes that one's place: of an even damper and an uneven one together no recording tells either."""
    swung, model = swing(0.0, rebound=3.0), undamped("constant")
    even = replace(model.elements[0], damping=Coefficient(1.0, estimated=True, min=0.0, shape="constant"))
    model = replace(model, elements=(even,))
    found = diagnose(model, [swung])
    assert named(found) == {"viscous_damping": pytest.approx(DAMPING, rel=0.02)} and found.complete
    (step,) = found.steps
    assert (step.form, step.shape) == ("uneven", {"rebound": pytest.approx(3.0, rel=0.02)})
    assert step.std < 0.02 * step.coefficient
    assert {one.constant: one.value for one in found.constants}["damping"] == pytest.approx(0.0, abs=1e-3)
    mended = replace(model, effects=found.structure.effects)
    assert diagnose(mended, [swung]).verdict == "adequate"
    assert applied(mended, swung.test).elements[0].damping == Coefficient()


def test_a_body_that_was_held_for_long_is_let_go_of_with_what_relaxes_relaxed(monkeypatch):
    """And as only noise is left, no sign or unit is asked after."""
    monkeypatch.setattr(diagnosis, "wrong_description", lambda *_: pytest.fail("asked"))
    found = diagnose(undamped("constant"), [swing(0.0, damping=0.0, relaxing=(200.0, 0.03))])
    assert named(found) == {"maxwell_element": pytest.approx(200.0, rel=0.03)} and found.complete
    (step,) = found.steps
    assert step.shape == {"relaxation_time": pytest.approx(0.03, rel=0.03)}
    assert abs(step.shape["relaxation_time"] - 0.03) < 4.0 * step.shape_std["relaxation_time"] < 0.003
    assert f"relaxation_time 0.03 +- {step.shape_std['relaxation_time']:.2g}" in steps_table(found)


def undamped(shape: str) -> Structure:
    spring = Coefficient(300.0, estimated=True, min=0.0, shape=shape)
    bodies = Body("cart", mass=MASS, displacement="cart_x"), Body("wall", fixed=True)
    return Structure("cart", bodies, (Element("spring", ("cart", "wall"), spring, Coefficient(0.0)),))


def named(found) -> dict[str, float]:
    assert found.verdict == "effect_missing", found.text
    return {step.effect: step.coefficient for step in found.steps}


@pytest.mark.parametrize("shape", ["constant", "curve"])
def test_friction_that_rises_with_the_rate_to_its_largest_is_a_damper(shape):
    """Both are missing. Dry friction that came to its force near the largest rate would follow both, as one."""
    found = diagnose(undamped(shape), [swing(friction=0.08)])
    effects = named(found)
    assert effects.pop("viscous_damping") == pytest.approx(DAMPING, rel=0.1)
    (dry,) = effects.items()
    assert dry[0] in ("coulomb_friction", "hysteresis") and dry[1] == pytest.approx(0.08, rel=0.25)
    told = [(one["element"], one["constant"], one["value"]) for one in found.as_json()["constants"]]
    assert told == ([("spring", "stiffness", pytest.approx(STIFFNESS, rel=0.01))] if shape == "constant" else [])


def test_what_is_not_believed_of_two_effects_is_asked_of_the_first_alone(monkeypatch):
    """What was added after it is no reason to doubt it."""
    words = {0: "unexplained", 1: "effect_missing", 2: "unexplained"}
    monkeypatch.setattr(diagnosis, "verdict_on", lambda evidence, tolerance: Verdict(words[evidence.added], False))
    found = diagnose(undamped("constant"), [swing(friction=0.08)])
    assert (found.verdict, len(found.steps), len(found.models)) == ("effect_missing", 1, 2)


def test_a_free_curve_that_lacks_the_damping_of_a_long_swing_does_not_run_away():
    """An elastic spring leaves as much as a swing in the opposite phase, at most: twice what was measured."""
    recording = swing(friction=0.0)
    found = diagnose(undamped("curve"), [recording])
    assert named(found)["viscous_damping"] == pytest.approx(DAMPING, rel=0.05)
    largest = STIFFNESS / MASS * LET_GO_AT / G
    assert found.residual_rms.before / G < 2.0 * largest and found.left_before.rms / G < 2.0 * largest
    assert np.isfinite([one.evidence for one in found.ranking]).all()


def test_a_damper_of_which_no_body_moves_freely_is_found():
    """A rod that is driven, a force that is measured on the frame: k X + c V."""
    time, damping = np.arange(0.0, 2.0, 1e-3), 800.0
    pulse = 2.0 * np.pi * 3.0
    x, v, a = (0.02 * pulse**n * np.sin(pulse * time + n * np.pi / 2.0) for n in range(3))
    rng = np.random.default_rng(8)
    force = 2e4 * x + damping * v + rng.normal(0.0, 2.0, len(time))
    channels = Channel("rod_ax", "acceleration", "rod", "x"), Channel("frame_fx", "force", "frame", "x")
    test = Test("bench", channels, initial_velocity={"rod": float(v[0])}, initial_displacement={"rod": 0.0})
    shown = np.column_stack([a + rng.normal(0.0, 0.01, len(time)), force])
    bodies = Body("rod", acceleration=("rod_ax",), driven=True), Body("frame", fixed=True, force="frame_fx")
    spring = Coefficient(1e4, estimated=True, shape="constant")
    strut = Element("strut", ("rod", "frame"), spring, Coefficient(0.0))
    found = diagnose(Structure("bench", bodies, (strut,)), [Recording(test, np.arange(len(time)) * 1_000_000, shown)])
    assert named(found)["viscous_damping"] == pytest.approx(damping, rel=0.02)
