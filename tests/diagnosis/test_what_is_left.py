"""What of the residuals is counted, in which band, and beside what."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from crash_estimator.core.diagnosis.observation.whitening import weights
from crash_estimator.core.diagnosis.report.left import Left, vibration_of
from crash_estimator.core.diagnosis.report.time_zero_step import time_zero_step
from crash_estimator.core.diagnosis.residuals.in_band import _kept, band_of
from crash_estimator.core.noise_spectrum import NoiseSpectrum
from crash_replay.conditioning import cfc_filter

PERIOD, N = 1e-4, 1000


def left(rms, noise):
    return Left(rms, noise, 0.0, 60, ())


def test_what_is_explained_is_a_share_of_what_was_above_the_noise():
    before = left(5.0, 3.0)  # a mean square of 16 above the noise
    assert left(np.sqrt(25.0 - 4.0), 3.0).share_explained(before) == pytest.approx(0.25)
    assert left(3.0, 3.0).share_explained(before) == pytest.approx(1.0)
    assert left(6.0, 3.0).share_explained(before) == 0.0
    assert left(1.0, 3.0).share_explained(left(2.0, 3.0)) == 0.0


def test_what_passes_a_filter_is_the_share_of_the_power_of_the_output_that_loses_most():
    time = PERIOD * np.arange(N)
    slow, fast = np.sin(2.0 * np.pi * 10.0 * time), 0.5 * np.sin(2.0 * np.pi * 2000.0 * time)
    both = np.column_stack([slow, slow + fast])
    expected = [(cfc_filter(column, PERIOD, 60) ** 2).sum() / (column**2).sum() for column in both.T]
    assert expected[1] < 0.85 < expected[0]
    assert _kept(both, PERIOD, 60) == pytest.approx(expected[1])
    assert _kept(1e3 * both, PERIOD, 60) == pytest.approx(expected[1])


@pytest.mark.parametrize(("above", "cfc"), [(0.037, 60), (0.07, 180)])
def test_the_band_holds_all_but_a_twentieth_of_the_power_that_a_model_predicts(above, cfc):
    """An impactor that swings at 50 Hz has 2.3 to 3.7 % of its power above CFC 60; its case rings there."""
    time = np.arange(4000) * 1e-4
    swing = np.sqrt(1.0 - above) * np.sin(2.0 * np.pi * 20.0 * time) + np.sqrt(above) * np.sin(
        2.0 * np.pi * 250.0 * time
    )
    residuals = SimpleNamespace(predicted=[swing[:, None]])
    assert band_of([SimpleNamespace(period=1e-4)], residuals) == cfc


def test_the_vibration_is_what_lies_above_the_band_that_was_compared():
    time = PERIOD * (np.arange(N) + 0.5)
    slow, fast = 7.0 * np.cos(2.0 * np.pi * 40.0 * time), 3.0 * np.cos(2.0 * np.pi * 900.0 * time)
    record = SimpleNamespace(period=PERIOD, below=400.0)
    output = SimpleNamespace(fixed=False, to_acceleration=1.0, body=0)
    model = SimpleNamespace(
        records=[record],
        residuals=SimpleNamespace(residual=[(slow + fast)[:, None]]),
        fit=SimpleNamespace(layout=SimpleNamespace(outputs=[output])),
    )
    assert vibration_of(model) == pytest.approx(3.0 / np.sqrt(2.0), rel=1e-6)


def test_a_coefficient_s_frequency_is_that_of_the_means_it_is_of():
    """Of means over four samples, 0.4 ms each: below 400 Hz lie 32 of 100 coefficients, 12.5 Hz apart."""
    white = NoiseSpectrum(1.0, 300.0, period=PERIOD)
    found = weights([white], 400.0, 100, PERIOD, means_over=4)
    assert_allclose(found[:, 0], np.where(np.arange(100) * 12.5 < 400.0, 1.0, 0.0), atol=1e-12)
    assert weights([white], np.inf, 100, PERIOD) is None


def test_a_channel_behind_a_filter_is_compared_where_the_filter_passes():
    of_filter = NoiseSpectrum(1.0, 300.0, corner=400.0, period=PERIOD)
    found = weights([of_filter], np.inf, N, PERIOD)[:, 0]
    assert_allclose(found > 0.0, np.arange(N) * 5.0 < of_filter.passed)


def test_a_wrong_time_zero_explains_what_the_moved_model_no_longer_leaves(monkeypatch):
    shift = SimpleNamespace(test="one", seconds=3e-3, std=1e-4)
    of = lambda rms: SimpleNamespace(residuals=SimpleNamespace(rms=rms), fit=SimpleNamespace(layout=None), records=())  # noqa: E731
    monkeypatch.setattr("crash_estimator.core.diagnosis.report.time_zero_step.noise_floor", lambda *given: 1.0)
    zero = SimpleNamespace(shifts=(shift,), as_stated=of(10.0), gain=lambda moved: 50.0)
    assert time_zero_step(zero, of(6.0), (9.0, 5.0)).explained == pytest.approx(0.64)
    assert time_zero_step(zero, of(12.0), (9.0, 5.0)).explained == 0.0
