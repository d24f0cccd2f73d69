"""Accelerations that are derived from a displacement follow it, and no more of its noise than they must."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from crash_estimator.core.derived_motion import ORDER, WINDOWS, smoothed

DT = 1e-4


@pytest.mark.parametrize("frequency", [5.0, 20.0, 60.0])
def test_the_derivatives_of_a_noisy_wave(frequency):
    """Within four times what noise of a window that just follows it lets through, in the middle of the record."""
    omega, time = 2.0 * np.pi * frequency, DT * np.arange(3000)
    clean, noise = 0.1 * np.sin(omega * time), 1e-6
    found = smoothed(clean + np.random.default_rng(2).normal(0.0, noise, len(time)), DT)
    middle = slice(200, -200)
    for values, exact in ((found.value, clean), (found.second, -(omega**2) * clean)):
        error = np.std((values - exact)[middle]) / np.std(exact)
        assert error < 0.05
    narrow = np.diff(clean + np.random.default_rng(2).normal(0.0, noise, len(time)), 2) / DT**2
    assert np.std((found.second + omega**2 * clean)[middle]) < 0.02 * np.std(narrow + omega**2 * clean[1:-1])


def test_a_step_is_followed_by_the_shortest_window_that_leaves_anything():
    """A wider one would cut what moves: of a kink every few samples next to nothing is taken away."""
    rng = np.random.default_rng(3)
    values = np.repeat(rng.normal(size=400), 5) + rng.normal(0.0, 1e-3, 2000)
    assert_allclose(smoothed(values, DT).value, values, atol=1e-12)


def test_a_polynomial_is_followed_exactly_and_noise_is_smoothed_by_the_widest():
    time = np.linspace(-1.0, 1.0, 1000)
    dt = time[1] - time[0]
    exact = np.polynomial.Polynomial(np.arange(1.0, ORDER + 2.0))
    found = smoothed(exact(time), dt)
    assert_allclose(found.second, exact.deriv(2)(time), rtol=1e-6, atol=1e-6)
    noise = np.random.default_rng(4).normal(size=4000)
    assert np.std(smoothed(noise, dt).value) < 2.0 * np.sqrt(ORDER / WINDOWS[-1])


def test_of_too_few_samples_nothing_is_derived():
    found = smoothed(np.arange(WINDOWS[0] - 1.0), DT)
    assert np.isnan(found.first).all() and np.isnan(found.second).all() and not np.isnan(found.value).any()


def test_an_encoder_of_few_steps_is_smoothed_as_its_rounding_asks():
    """Of what stands still most of the time the median of differences is none."""
    time = np.arange(0.0, 20.0, 4e-3)
    clean = 0.05 * np.tanh(5.0 * np.sin(2.0 * np.pi * 0.1 * time))
    found = smoothed(np.round(clean / 5e-5) * 5e-5, 4e-3)
    exact = smoothed(clean, 4e-3)
    assert np.std(found.second - exact.second) < 0.1 * np.std(exact.second)
