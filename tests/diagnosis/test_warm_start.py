"""A fit of the live ranking goes on from that of the update before."""

from types import SimpleNamespace

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from crash_estimator.core.diagnosis.observation.grid import DRIVEN_MODES
from crash_estimator.core.diagnosis.online import warm_start
from crash_estimator.core.diagnosis.parameterization.free_curve import Curve, value


def layout(knots: np.ndarray, high: float = np.inf) -> SimpleNamespace:
    """As `Layout`: a curve, two common parameters, the zeros of two channels and the modes of a driven body."""
    n = len(knots) - 1
    curve = Curve(knots, np.concatenate([[-1], np.arange(n)]), knots[-1], 1e4)
    size = n + 2 + 2 + DRIVEN_MODES + 1
    return SimpleNamespace(
        links=[SimpleNamespace(name="spring", curve=curve), SimpleNamespace(name="rope", curve=None)],
        knots=n, common=n + 2, offsets=(n + 2,), outputs=("one", "other"), modes=({1: range(n + 4, size)},), size=size,
        start=np.zeros(size), prior=SimpleNamespace(low=np.full(size, -np.inf), high=np.full(size, high)),
    )  # fmt: skip


def test_parameters_keep_their_meaning_where_the_crush_has_grown():
    before, now = layout(np.linspace(0.0, 0.2, 5)), layout(np.linspace(0.0, 0.3, 10))
    last = SimpleNamespace(layout=before, theta=1.0 + np.arange(before.size, dtype=float))
    theta = warm_start._parameters(last, now)
    assert_array_equal(theta[now.knots :], last.theta[before.knots :])
    crush = now.links[0].curve.knots
    assert_allclose(value(now.links[0].curve, theta, crush), value(before.links[0].curve, last.theta, crush))
    assert_array_equal(warm_start._parameters(last, before), last.theta)


def test_they_stay_within_their_limits():
    before, now = layout(np.linspace(0.0, 0.2, 5)), layout(np.linspace(0.0, 0.2, 5), high=3.0)
    last = SimpleNamespace(layout=before, theta=1.0 + np.arange(before.size, dtype=float))
    assert_array_equal(warm_start._parameters(last, now), np.minimum(last.theta, 3.0))
