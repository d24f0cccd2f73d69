"""What is said beside a verdict: what a damper would be beside a lag that is not told."""

from types import SimpleNamespace

import numpy as np
import pytest
from helpers_verdict import EVIDENCE, NOTHING_VARIES

from crash_estimator.core.diagnosis.parameterization.terms import Term
from crash_estimator.core.diagnosis.report import ranking
from crash_estimator.core.diagnosis.report.left import ChannelLeft, Left
from crash_estimator.core.diagnosis.report.ranking import ranking_of
from crash_estimator.core.diagnosis.report.remarks import remarks_on
from crash_estimator.core.diagnosis.report.tolerance import DEFAULT
from crash_estimator.core.diagnosis.report.verdict import verdict_on
from crash_estimator.core.diagnosis.selection.candidate_fits import CandidateFit
from crash_estimator.core.diagnosis.selection.thresholds import THRESHOLDS
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.effect import Addition

DAMPER, LAG = Addition(EFFECTS["viscous_damping"], "front"), Addition(EFFECTS["channel_delay"], "car_ax")
MORE = Addition(EFFECTS["cubic_stiffness"], "front")
NOTHING_LEFT = Left(1.0, 1.0, 0.0, 60, ())


def begun(second: Addition, gain: float):
    """A damper that was found, and the best candidate beside it, with which it would be 28.5 N s/m."""
    terms = {id(DAMPER): 0, id(second): 1}
    layout = SimpleNamespace(term=lambda one: Term(one, terms[id(one)], {}))
    fit = SimpleNamespace(layout=layout, theta=np.array([28.5, 4.2e-4]), covariance=np.diag([0.16, 1e-10]))
    final = SimpleNamespace(found=(DAMPER,), white=False)
    last = SimpleNamespace(before=final, best=CandidateFit(second, gain, fit))
    path = SimpleNamespace(steps=[SimpleNamespace(), last], final=final, added=(DAMPER,), records=())
    return SimpleNamespace(path=path, unused=(), taken=())


def test_what_a_damper_would_be_beside_a_lag_that_is_not_told_is_said():
    (said,) = remarks_on(begun(LAG, 50.0), True, NOTHING_LEFT)
    assert "channel_delay on car_ax of 0.00042 s" in said and "viscous_damping on front would be 28.5 +- 0.4" in said


@pytest.mark.parametrize(
    ("second", "gain", "missing"),
    [(LAG, 0.9 * THRESHOLDS.gain, True), (LAG, 50.0, False), (MORE, 50.0, True)],
    ids=["gains nothing", "nothing is told", "a law of its own"],
)
def test_nothing_is_said_of_what_is_no_small_error_beside_it(second, gain, missing):
    assert remarks_on(begun(second, gain), missing, NOTHING_LEFT) == []


def test_what_a_model_leaves_more_of_than_it_ever_shows_runs_away():
    astray = Left(
        1.0, 1.0, 0.0, 60, (ChannelLeft("car_x", "a", 2.0, "m", 1.3, 0.0), ChannelLeft("b", "a", 1.0, "N", 1.0, 0.1))
    )
    (said,) = remarks_on(begun(MORE, 50.0), True, astray)
    assert said.startswith("car_x runs away")


def test_a_ranking_has_no_effect_that_is_nothing_stated_as_one_over_it(monkeypatch):
    found = {"a": 2.0, "b": np.inf, "c": -1.0}
    monkeypatch.setattr(ranking, "_ranked", lambda one, *_: SimpleNamespace(coefficient=found[one.addition]))
    step = SimpleNamespace(candidates=[CandidateFit(name, 1.0, None) for name in found], before=None)
    assert [one.coefficient for one in ranking_of(step)] == [2.0, -1.0]


@pytest.mark.parametrize(("added", "word"), [(0, "unexplained"), (1, "effect_missing")])
def test_noise_is_not_all_that_is_left_where_a_body_runs_away(added, word):
    left = SimpleNamespace(of_peak=3.0, is_less_than_noise=True, astray=["axis_x"])
    evidence = EVIDENCE._replace(added=added, white=True, drift=NOTHING_VARIES, ranking=(), before=left, after=left)
    assert verdict_on(evidence, DEFAULT) == (word, False)
    inside = SimpleNamespace(of_peak=3.0, is_less_than_noise=True, astray=[])
    assert verdict_on(evidence._replace(before=inside, after=inside), DEFAULT).complete
