"""What the report says of candidates and of measured forces."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from crash_estimator.core.diagnosis.report import ranking
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.effect import Addition


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
        term = SimpleNamespace(addition=addition, coefficient=0, shapes={key: k for k, key in enumerate(shapes, 1)})
        value, found, said = ranking.stated(term, SimpleNamespace(theta=theta, covariance=np.diag(std**2)))
        assert_allclose(value, effect.stated(theta[0], **shapes), err_msg=name)
        assert said == pytest.approx(shapes)
        turned = [effect.stated(t[0], **dict(zip(shapes, np.exp(t[1:])))) for t in theta + np.diag(1e-6 * std)]
        relative = np.sqrt(np.sum((np.array(turned) - value) ** 2)) / 1e-6 / abs(value)
        assert_allclose(found / abs(value), np.expm1(relative), rtol=1e-3, err_msg=name)
