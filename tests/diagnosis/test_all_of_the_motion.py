"""A motion that begins before the stated time zero, where as much is left from both on: its crush is measured."""

import re
from types import SimpleNamespace

import numpy as np
import pytest

from crash_estimator.core.diagnosis import THRESHOLDS, diagnose
from crash_estimator.core.diagnosis.parameterization.nuisances import FARTHEST
from crash_estimator.core.diagnosis.selection import onset_search
from crash_estimator.core.diagnosis.selection.onset_search import Begun
from crash_estimator.core.diagnosis.selection.time_zero import Shift
from crash_estimator.model_file import load_model
from crash_replay.recording import Channel, Recording, Test

MASS, STIFFNESS, DAMPING = 0.639, 15e3, 46.8
LATE = 4.8e-3
"""s."""


def impact(late: float) -> Recording:
    """An impactor's crush, its rate, and its body's deceleration, in which is a hum of 35 Hz, 1 % of the peak."""
    time = np.arange(-0.02, 0.06, 1e-4)
    moves, swing = np.maximum(time, 0.0), 2.0 * np.pi * 25.0
    fades = np.exp(-moves / 0.02)
    crush = 1.2e-3 * fades * np.sin(swing * moves)
    rate = 1.2e-3 * fades * (swing * np.cos(swing * moves) - np.sin(swing * moves) / 0.02) * (time >= 0.0)
    shown = -(STIFFNESS * crush + DAMPING * rate) / MASS + 0.3 * np.sin(2.0 * np.pi * 35.0 * moves)
    rng = np.random.default_rng(5)
    noisy = [one + rng.normal(0.0, noise, len(time)) for one, noise in ((shown, 0.05), (crush, 1e-7), (rate, 1e-4))]
    channels = (
        Channel("body_ax", "acceleration", "body", "x"), Channel("rel_displacement", "displacement"),
        Channel("rel_velocity", "velocity"),
    )  # fmt: skip
    return Recording(Test("impact", channels), np.rint((time - late) * 1e9).astype(np.int64), np.stack(noisy, axis=1))


def test_what_was_recorded_before_a_time_zero_that_is_late_is_compared_as_well():
    found = diagnose(load_model("impactor_spring"), [impact(LATE)])
    assert (found.verdict, found.steps[0].effect) == ("effect_missing", "viscous_damping"), found.text
    assert found.steps[0].coefficient == pytest.approx(DAMPING, rel=0.05)
    (ms,) = re.findall(
        r"begin (\S+) ms \(impact\) from the stated time zero, and are compared from there on", found.text
    )
    assert float(ms) == pytest.approx(-1e3 * LATE, abs=0.2), "two samples"
    assert "compared from there on" not in diagnose(load_model("impactor_spring"), [impact(0.0)]).text


@pytest.mark.parametrize(("noise", "far", "gain", "taken"), [
    (False, 1.1, 0.0, True),
    (True, 1.1, 0.0, False),  # nothing is left from the stated time zero on
    (False, 0.9, 0.0, False),  # it may be wrong
    (False, 1.1, -1.1, False),  # much more is left from there on
])  # fmt: skip
def test_an_onset_beyond_doubt_is_begun_from_unless_more_is_left_from_there(monkeypatch, noise, far, gain, taken):
    path = lambda noise: SimpleNamespace(noise=noise, final="final")  # noqa: E731
    shift = Shift(0, "impact", -far * FARTHEST * 1e-3, 0.0, 1e-4)
    monkeypatch.setattr(Shift, "impact", property(lambda self: (self.seconds, 1e-3)))
    monkeypatch.setattr(onset_search, "search_is_over", lambda: False)
    monkeypatch.setattr(onset_search, "TimeZero", lambda *given: SimpleNamespace(gain=lambda m: gain * THRESHOLDS.gain))
    found = {"stated": path(noise), "moved": path(False)}

    class Search(onset_search._Search):
        as_stated = "stated"

        def _selected(self, records):
            return found[records]

        def _observed(self, shifts=()):
            return "moved"

    begun = Search(None, (), {})._stated_or_early(None, (shift,))
    assert begun == (Begun(found["moved"], taken=(shift,)) if taken else Begun(found["stated"], None, (shift,)))
