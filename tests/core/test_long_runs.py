"""Many steps leave the covariance symmetric and positive, with and without process noise, and whatever the noise is."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from crash_estimator.core.compiled.factors import product_of, widen
from crash_estimator.core.compiled.kalman import kalman_update
from crash_estimator.core.estimators.kalman import Kalman
from crash_estimator.core.estimators.update import Theta
from crash_estimator.core.regression import Regression

SCALE = np.array([1.0e6, 1.0e3, 1.0e5])  # stiffness, damping, stiffness: eleven orders of magnitude in variance


def gradients(n=1000):
    """Crush and rate of n samples of a vibration over masses of 10 and 1000 kg: nearly collinear at times."""
    t = np.linspace(0.0, 7.0, n)
    x, v, y = 0.3 * np.sin(t), 10.0 * np.cos(t), 0.3 * np.sin(t + 0.01)
    return np.stack([np.stack([-x, -v, 0.0 * t], 1) / 10.0, np.stack([x, v, -y], 1) / 1000.0], axis=1)


def covariance_of(factors):
    covariance = np.empty_like(factors)
    product_of(factors, covariance)
    return covariance


def check(covariance):
    assert_array_equal(covariance, covariance.T)
    scaled = covariance / np.outer(SCALE, SCALE)
    assert np.isfinite(scaled).all()
    assert np.linalg.eigvalsh(scaled).min() >= -1e-18 * np.trace(scaled)


@pytest.mark.parametrize(("drift", "steps"), [(0.0, 1_000_000), (1e-6, 200_000)])
def test_a_million_compiled_steps(drift, steps):
    psi, noise, target = gradients(), np.array([1.0, 1e-4]), np.array([3.0, np.nan])
    theta, factors = SCALE.copy(), np.diag(SCALE**2)
    active, clamped, bound, unit, gain = np.ones(3), np.zeros(3), np.full(3, np.inf), np.empty(3), np.empty((3, 2))
    for k in range(steps):
        for j in range(3 if drift else 0):
            widen(factors, (drift * SCALE[j]) ** 2, j, unit)
        target[1] = np.nan if k % 7 else 0.01  # now and then a dropout
        kalman_update(theta, factors, noise, psi[k % len(psi)], target, active, -bound, bound, False, clamped, gain)
        if k % 100_000 == 0:
            check(covariance_of(factors))
    check(covariance_of(factors))
    assert np.isfinite(theta).all()


def test_ten_thousand_readable_steps():
    """The numpy form; slower, so fewer."""
    nothing, unbounded = np.zeros(3), np.full(3, np.inf)
    settings = Theta(("k", "c", "l"), SCALE, SCALE, -unbounded, unbounded, SCALE)
    method, psi = Kalman(settings, noise_memory=0, offsets=False), gradients()
    state = method.init(2)
    for k in range(10_000):
        target, noise = np.array([3.0, np.nan if k % 7 else 0.01]), np.array([1.0, 1e-4])
        active = np.ones(3, dtype=bool)
        regression = Regression(np.zeros(2), psi[k % len(psi)], target, active, nothing, noise, 1e-4)
        state, update = method.update(state, regression)
        if k % 1000 == 0:
            check(update.covariance)
    check(update.covariance)
