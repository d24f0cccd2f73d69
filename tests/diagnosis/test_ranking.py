"""What the report says of candidates and of measured forces."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from crash_estimator.core.diagnosis.mechanics import link_force
from crash_estimator.core.diagnosis.parameterization import magnitudes
from crash_estimator.core.diagnosis.parameterization.terms import Term
from crash_estimator.core.diagnosis.report import over_forms, ranking
from crash_estimator.core.diagnosis.residuals import score_test
from crash_estimator.core.diagnosis.selection.candidate_fits import CandidateFit
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.effect import Addition, ElementMotion


@pytest.mark.parametrize(("period", "said"), [(1e-4, True), (0.5 / ranking.SLOWEST, True), (1e-2, False)])
@pytest.mark.parametrize(("measured", "enough"), [((0, 1), True), ((0,), False)])
def test_what_the_masses_explain_of_a_measured_force(monkeypatch, period, said, measured, enough):
    """Where the acceleration of every mass is measured, often enough for the filter that both are compared behind."""
    outputs = [SimpleNamespace(fixed=True, body=2, channel="barrier_fx")]
    outputs += [SimpleNamespace(fixed=False, body=k, channel=f"{k}_ax") for k in measured]
    bodies = [SimpleNamespace(free=True), SimpleNamespace(free=True), SimpleNamespace(free=False)]
    layout = SimpleNamespace(outputs=outputs, structure=SimpleNamespace(bodies=bodies))
    problem = SimpleNamespace(records=[SimpleNamespace(period=period)], experiments=[None])
    before, after = (SimpleNamespace(layout=layout, problem=problem, theta=share) for share in (0.25, 0.75))
    monkeypatch.setattr(ranking, "_balance", lambda experiment, share, row: share)
    found = ranking._force_explained(before, after)
    assert found == ({"barrier_fx": {"before": 0.25, "after": 0.75}} if said and enough else {})


def test_a_coefficient_that_is_stated_otherwise_than_it_is_fitted_keeps_its_share_of_error():
    """Of every effect that is restated: c = f(p, shapes), to first order of error sum (df/dp_i)^2 var_i."""
    restated = {name: effect for name, effect in EFFECTS.items() if effect.restated}
    assert restated
    for name, effect in restated.items():
        shapes = {key: shape.starts[0] for key, shape in effect.shapes.items()}
        theta = np.array([0.05, *np.log(list(shapes.values()))])
        std = 0.01 * np.arange(1, len(theta) + 1)
        addition = Addition(effect, "spring", dict(shapes))
        term = Term(addition, 0, {key: k for k, key in enumerate(shapes, 1)})
        value, found, said = ranking.stated(term, SimpleNamespace(theta=theta, covariance=np.diag(std**2)))
        assert_allclose(value, effect.stated(theta[0], **shapes), err_msg=name)
        assert said == pytest.approx(shapes)
        turned = [effect.stated(t[0], **dict(zip(shapes, np.exp(t[1:])))) for t in theta + np.diag(1e-6 * std)]
        relative = np.sqrt(np.sum((np.array(turned) - value) ** 2)) / 1e-6 / abs(value)
        assert_allclose(found / abs(value), np.expm1(relative), rtol=1e-3, err_msg=name)


def test_a_sigma_is_that_over_the_forms_that_are_as_likely(monkeypatch):
    """Two forms alike, 100 +- 3 and 130 +- 4: about the first, s^2 = (9 + 16 + 30^2) / 2. One that is 5 nats behind
    hardly counts, of one that has diverged nothing is known, and a law without a memory has its own sigma."""

    def fitted(c, std, evidence):
        return SimpleNamespace(
            theta=np.array([0.0, c, 0.1]), covariance=np.diag([1.0, std**2, 0.04]), evidence=evidence
        )

    addition = SimpleNamespace(effect=SimpleNamespace(remembers=True))
    term, first = Term(addition, 1, {"leak": 2}), fitted(100.0, 3.0, -500.0)
    others = [fitted(130.0, 4.0, -500.0), fitted(np.nan, np.nan, -np.inf)]
    monkeypatch.setattr(over_forms, "_in_other_forms", lambda *_: others)
    assert_allclose(over_forms.std_over_forms(term, first), [np.sqrt(925.0 / 2.0), 0.2])
    others[0] = fitted(130.0, 4.0, -505.0)
    share = np.exp(-5.0) / (1.0 + np.exp(-5.0))
    assert_allclose(over_forms.std_over_forms(term, first)[0], np.sqrt(9.0 + share * (916.0 - 9.0)))
    addition.effect.remembers = False
    assert_allclose(over_forms.std_over_forms(term, first), [3.0, 0.2])


@pytest.mark.parametrize("tension", [True, False])
def test_a_contact_that_is_apart_neither_is_crushed_nor_moves(monkeypatch, tension):
    """What an effect's order of magnitude is taken from is the motion of an element while it may carry."""
    crush, rate = np.array([0.1, 0.0, -0.2]), np.array([1.0, 2.0, 3.0])
    motion = ElementMotion(np.zeros(3), crush, rate, np.full(3, 0.1), np.zeros(3))
    monkeypatch.setattr(magnitudes, "element_motion", lambda *given: motion)
    structure = SimpleNamespace(elements=[SimpleNamespace(tension=tension)])
    found = magnitudes.Magnitudes.motion(SimpleNamespace(structure=structure, records=[0], measured=[0]), 0, 0)
    assert_array_equal(found.crush, crush if tension else [0.1, 0.0, 0.0])
    assert_array_equal(found.rate, rate if tension else [1.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("squares", "named"),
    [
        ((40.0, 1.0, 1.0, 2.0), "the mass of car"),
        ((1.0, 40.0, 1.0, 2.0), "a force on car"),
        ((1.0, 1.0, 40.0, 2.0), "the stiffness of front"),
        ((1.0, 1.0, 2.0, 40.0), "the gain of car_ax"),
        ((40.0, 39.9, 1.0, 2.0), "the mass of car or a force on car"),  # which of them, nobody can tell
    ],
)
def test_what_varies_with_time_is_named_with_what_cannot_be_told_from_it(monkeypatch, squares, named):
    links, outputs = [SimpleNamespace(name="front")], [SimpleNamespace(channel="car_ax")]
    layout = SimpleNamespace(kind=[score_test.FREE], bodies=["car"], links=links, outputs=outputs)
    modes, statistics = score_test.MODES, iter(squares)
    normal = SimpleNamespace(cost=1040.0, samples=1000)
    monkeypatch.setattr(score_test, "_normal_equations", lambda *given: normal)
    monkeypatch.setattr(score_test, "_marginal", lambda *given: (np.zeros(4 * modes), np.eye(4 * modes)))
    monkeypatch.setattr(score_test, "_statistic", lambda *given: (next(statistics), 4))
    found = score_test.drift_of(SimpleNamespace(layout=layout))
    assert found.what == named and not found.constant
    assert found.share == pytest.approx((max(squares) - 4) / 40.0)


@pytest.mark.parametrize("name", [name for name, effect in EFFECTS.items() if effect.scales_static])
def test_the_derivatives_of_a_factor_on_a_spring_are_those_of_its_law(name):
    """Of finite differences of another size: the fit's steps hang on them, its answers do not."""
    effect = EFFECTS[name]
    shapes = {key: shape.starts[0] for key, shape in effect.shapes.items()}
    addition = Addition(effect, "spring", dict(shapes))
    term = Term(addition, 0, {key: k for k, key in enumerate(shapes, 1)})
    theta, rate = np.array([0.1, *np.log(list(shapes.values()))]), np.array([-3.0, -0.5, 0.7, 4.0])
    none = np.zeros(len(rate))
    value, slope, by_shape = link_force._factor(term, theta, ElementMotion(none, none, rate, none, none))
    assert_allclose(value, effect.factor(rate, **shapes))
    wide = 1e-3
    expected = (effect.factor(rate + wide, **shapes) - effect.factor(rate - wide, **shapes)) / (2.0 * wide)
    assert_allclose(slope, expected, rtol=1e-3, atol=1e-6 * np.abs(expected).max())
    for k, key in enumerate(shapes):
        turned = [effect.factor(rate, **shapes | {key: shapes[key] * np.exp(s * wide)}) for s in (1.0, -1.0)]
        expected = (turned[0] - turned[1]) / (2.0 * wide)
        assert_allclose(by_shape[k], expected, rtol=1e-3, atol=1e-6 * np.abs(expected).max())


@pytest.mark.parametrize("no_noise", [False, True])
@pytest.mark.parametrize("place", ["spring", "mount"])
@pytest.mark.parametrize(
    ("one", "other", "rivals", "rivals_in_more"),
    [
        (100.0, 91.0, True, True), (100.0, 89.0, False, False), (4000.0, 3985.0, True, True),
        (4000.0, 3975.0, False, True), (4000.0, 3825.0, False, True), (4000.0, 3775.0, False, False),
    ],
)  # fmt: skip
def test_two_laws_are_not_told_apart_within_ten_nats_or_half_a_percent_of_what_both_explain(
    one, other, rivals, rivals_in_more, place, no_noise
):
    """A hysteresis was told as an unloading line, 12 nats of 29547 ahead. Of one element within a twentieth, where more
    than noise is left."""
    effect = SimpleNamespace(log_prior_odds_against=lambda structure, c: 0.0, acts_on="element")
    layout = SimpleNamespace(structure=None, term=lambda addition: SimpleNamespace(coefficient=0))
    fit = SimpleNamespace(layout=layout, theta=[1.0])
    candidates = [
        CandidateFit(SimpleNamespace(effect=effect, target=target), gain, fit)
        for gain, target in ((one, "spring"), (other, place))
    ]
    expected = rivals_in_more if no_noise and place == "spring" else rivals
    assert ranking._confounded(*candidates, no_noise) == expected
