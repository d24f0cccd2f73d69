"""The covariance in factors: what Joseph's form gives in exact numbers, and positive where rounding takes that from
it."""

from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest
from helpers_estimation import plain
from numpy.testing import assert_allclose, assert_array_equal

from crash_estimator.core.compiled import kalman
from crash_estimator.core.compiled.factors import product_of, widen
from crash_estimator.core.compiled.kalman import kalman_update
from crash_estimator.core.compiled.plan import MethodPlan
from crash_estimator.core.estimate import standard_deviations
from crash_estimator.core.estimators.kalman import Kalman
from crash_estimator.core.estimators.update import Theta
from crash_estimator.core.methods import make_estimator
from crash_estimator.core.regression import QUIETEST, Regression
from crash_estimator.endurance.methods import TEST, least_eigenvalue, structure, vibration

N, Q = 5, 3
NOISE = np.array([1.0, 1e-2, 4.0])
UNBOUNDED = np.full(N, np.inf)


def product(factors):
    covariance = np.empty_like(factors)
    product_of(factors, covariance)
    return covariance


def update(theta, factors, noise, psi, target, active):
    """By the compiled form, in place, without bounds."""
    bounds = -UNBOUNDED[: len(theta)], UNBOUNDED[: len(theta)]
    kalman_update(
        theta, factors, noise, psi, target, active, *bounds, False, np.zeros(len(theta)), np.zeros(psi.shape[::-1])
    )


def joseph(theta, covariance, noise, psi, target, active):
    """The update as it is written, in the numbers given, of all equations in turn.

    What is not active is held, and counts as unknown.
    """
    for row, y, r in zip(psi, target, noise):
        gain = active * (covariance @ row) / (r + row @ covariance @ row)
        lessen = np.eye(len(theta), dtype=int) - np.outer(gain, row)
        theta = theta + gain * (y - row @ theta)
        covariance = lessen @ covariance @ lessen.T + r * np.outer(gain, gain)
    return theta, covariance


@pytest.mark.parametrize("seed", range(5))
def test_steps_with_walks_and_held_parameters_are_those_of_josephs_form(seed):
    rng = np.random.default_rng(seed)
    std = np.array([1e3, 1.0, 0.0, 10.0, 1e-2])  # one is known
    theta, factors = rng.standard_normal(N), np.diag(std**2)
    expected, covariance = theta.copy(), factors.copy()
    for _ in range(30):
        psi, target = rng.standard_normal((Q, N)), rng.standard_normal(Q)
        active, walking = (rng.random(N) < 0.7).astype(float), int(rng.integers(N))
        widen(factors, 0.1, walking, np.empty(N))
        covariance[walking, walking] += 0.1
        update(theta, factors, NOISE, psi, target, active)
        expected, covariance = joseph(expected, covariance, NOISE, psi, target, active)
        scale = np.sqrt(np.maximum(np.diagonal(covariance), 1e-12))
        assert_allclose(theta / scale, expected / scale, atol=1e-9)
        assert_allclose(product(factors) / np.outer(scale, scale), covariance / np.outer(scale, scale), atol=1e-9)


def exactly(matrix):
    return np.vectorize(Fraction, otypes=[object])(matrix)


def test_what_noise_far_below_the_uncertainty_leaves_is_known_to_rounding():
    """Nineteen orders of magnitude between R2 and psi P psi': Joseph's form in doubles is wrong by per cents."""
    psi, noise, target = np.array([[5.0, 0.3], [4.0, 0.25]]), np.array([1e-14, 1e-14]), np.array([1.0, 0.8])
    theta, factors, active = np.zeros(2), np.diag([1e4, 1e2]), np.ones(2)
    _, exact = joseph(*(exactly(part) for part in (theta, factors, noise, psi, target)), active.astype(int))
    exact = exact.astype(float)
    update(theta, factors, noise, psi, target, active)
    assert_allclose(product(factors), exact, rtol=1e-12)

    nothing = np.zeros(2)
    settings = Theta(("k", "c"), nothing, np.array([1e2, 1e1]), -UNBOUNDED[:2], UNBOUNDED[:2], np.ones(2))
    method = Kalman(settings, constrained=False, noise_memory=0, offsets=False)
    regression = Regression(nothing, psi, target, np.ones(2, dtype=bool), nothing, noise, 1e-4)
    _, readable = method.update(method.init(2), regression)
    assert_allclose(readable.covariance, exact, rtol=1e-12)

    _, lost = joseph(nothing, np.diag([1e4, 1e2]), noise, psi, target, active)
    assert np.abs(lost / exact - 1.0).max() > 1e-2


def test_nothing_is_learnt_where_there_is_neither_noise_nor_uncertainty():
    theta, factors = np.array([1.0, 2.0]), np.diag([0.0, 4.0])
    update(theta, factors, np.zeros(1), np.array([[1.0, 0.0]]), np.array([5.0]), np.ones(2))
    assert_array_equal(theta, [1.0, 2.0])
    assert_array_equal(factors, np.diag([0.0, 4.0]))


@pytest.mark.parametrize("missing", [[], [1]])
def test_what_is_left_of_the_residuals_is_the_noise_less_what_has_been_fitted_to_it(missing):
    """R2 - Psi P Psi', of equations that share their parameters; of one that was not measured their sum."""
    rng = np.random.default_rng(2)
    psi, target, factors, gain = rng.standard_normal((Q, N)), rng.standard_normal(Q), np.eye(N), np.empty((N, Q))
    target[missing] = np.nan
    kalman_update(np.zeros(N), factors, NOISE, psi, target, np.ones(N), -UNBOUNDED, UNBOUNDED, False, np.zeros(N), gain)
    fitted = np.diagonal(psi @ product(factors) @ psi.T)
    room = SimpleNamespace(gradient=psi, target=target, gain=gain, through=np.empty((Q, N)), spread=np.empty((Q, Q)))
    found = np.empty(Q)
    plain(kalman._left)(SimpleNamespace(factors=factors, noise=NOISE), room, found)
    assert_allclose(found**2, np.where(np.isnan(target), NOISE + fitted, NOISE - fitted), rtol=1e-9)


@pytest.mark.parametrize(("known", "least"), [(4.0, 4.0), (np.nan, QUIETEST**2)])
def test_noise_that_adapts_to_a_model_without_errors_stays_at_what_is_known_of_the_sensor(monkeypatch, known, least):
    monkeypatch.setattr(kalman, "pass_one", lambda *given: None)  # of which nothing is asked here
    noise, one, square = np.array([np.nan]), np.ones(1), np.ones((1, 1))
    errors = np.zeros((3, 1, 1))
    state = kalman.Filter(2.0 * one, square.copy(), noise, np.zeros((1, 1)), errors)
    room = SimpleNamespace(
        walk=np.zeros(1), learnt=np.array([known]), gradient=square, target=2.0 * one, active=one, by_errors=errors,
        errors=np.zeros((1, 7)), gain=square.copy(), through=square.copy(), unit=one.copy(), unfiltered=one.copy(),
        seen=one.copy(),
    )  # fmt: skip
    limits, method = kalman.Limits(-UNBOUNDED[:1], UNBOUNDED[:1], one), MethodPlan(True, False, noise_memory=1e-12)
    plain(kalman.let_walk)(limits, state, room)
    plain(kalman.update)(limits, method, state, room, np.zeros(1))
    plain(kalman.adapt)(method, state, 1e-3, room)
    assert_array_equal(noise, [least])


@pytest.mark.parametrize("method", ["kalman", "constrained_kalman"])
def test_thirty_thousand_samples_of_a_vibration_leave_it_positive(method):
    samples = list(vibration(30_000))
    estimator = make_estimator(structure(), TEST, method)
    times, values = np.array([s.time_ns for s in samples]), np.array([s.values for s in samples])
    _, rows = estimator.follow(estimator.init(), times, values)
    covariances = rows[:, estimator.columns["covariance"]].reshape(-1, 2, 2)[::100]
    assert_array_equal(covariances, covariances.transpose(0, 2, 1))
    assert min(map(least_eigenvalue, covariances)) > 0.0


def test_both_forms_agree_on_the_vibration():
    compiled, readable = (make_estimator(structure(), TEST, "kalman", compiled=c) for c in (True, False))
    states = compiled.init(), readable.init()
    for sample in vibration(1000):
        (first, a), (second, b) = compiled.step(states[0], sample), readable.step(states[1], sample)
        states = first, second
        assert_allclose(a.parameters, b.parameters, rtol=1e-8, atol=1e-6)
        assert_allclose(a.covariance, b.covariance, rtol=1e-6)


def test_a_variance_that_rounding_has_lost_states_no_sigma():
    assert_allclose(standard_deviations(np.diag([4.0, 0.0, -1e-18])), [2.0, 0.0, np.nan])
