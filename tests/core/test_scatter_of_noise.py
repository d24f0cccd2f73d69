"""The noise of a sensor is told apart from what it measures, at whatever rate, at rest or not."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from crash_estimator.core.sensor_noise import SMALLEST, sensor_noise


def crash(rate: float, noise: float, before: float = 0.0, seconds: float = 0.4) -> tuple[np.ndarray, np.ndarray]:
    """A half sine of 80 ms and 300 m/s^2 and what a sensor shows of it; before: s of rest."""
    time = np.arange(-round(before * rate), round(seconds * rate)) / rate
    pulse = np.where((time > 0.0) & (time < 0.08), -300.0 * np.sin(np.pi * time / 0.08), 0.0)
    white = np.random.default_rng(7).normal(0.0, noise, len(time))
    return pulse + white, np.rint(time * 1e9).astype(np.int64)


@pytest.mark.parametrize("rate", [1e3, 2e3, 3.6e3, 4e3, 4.4e3, 1e4, 2e4])
def test_without_a_rest_the_highest_frequencies_tell(rate):
    """Within four standard errors of the few samples that the estimate is worth, and the pulse's own part."""
    noise = sensor_noise(*crash(rate, 2.0), rests=False)
    assert_allclose(noise.std, 2.0, rtol=4.0 / np.sqrt(2.0 * noise.samples))


@pytest.mark.parametrize("before", [0.05, 0.2])
def test_rest_and_crash_that_agree_are_pooled(before):
    alone = sensor_noise(*crash(1e4, 2.0), rests=False)
    both = sensor_noise(*crash(1e4, 2.0, before), rests=True)
    assert both.samples > max(alone.samples, before * 1e4)
    assert_allclose(both.std, 2.0, rtol=4.0 / np.sqrt(2.0 * both.samples))


def test_a_simulation_without_noise_has_next_to_none():
    values, time_ns = crash(1e4, 0.0)
    nothing = np.zeros_like(values)
    assert sensor_noise(nothing, time_ns, rests=False).std > 0.0
    assert sensor_noise(nothing + 5.0, time_ns, rests=False).std == pytest.approx(5.0 * SMALLEST)
    assert sensor_noise(values, time_ns, rests=False).std < 1e-3 * np.abs(values).max()


def test_a_structure_that_rings_is_noisier_than_its_sensor_at_rest():
    values, time_ns = crash(1e4, 1.0, before=0.05)
    values = np.where(time_ns >= 0, 3.0 * values, values)
    assert sensor_noise(values, time_ns, rests=True).std > 2.0
