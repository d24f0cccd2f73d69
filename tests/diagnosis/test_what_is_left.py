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


def predicting(acceleration, until, pushed_by=None):
    """A model of one body of 4 kg, sampled at 10 kHz."""
    body = SimpleNamespace(mass=4.0, applied="push" if pushed_by is not None else None)
    record = SimpleNamespace(
        period=PERIOD,
        time=np.array([0.0, until]),
        at=np.arange(len(acceleration)),
        signals={"push": SimpleNamespace(on_grid=pushed_by)},
    )
    layout = SimpleNamespace(
        structure=SimpleNamespace(bodies=(body,)),
        bodies=(body,),
        outputs=(SimpleNamespace(body=0, quantity="acceleration"),),
        weighed={},
        terms=(),
    )
    residuals = SimpleNamespace(predicted=(acceleration[:, None],))
    return SimpleNamespace(records=[record], residuals=residuals, fit=SimpleNamespace(layout=layout, theta=np.zeros(0)))


def waves(slow, fast, share_of_fast, duration=0.4):
    """Of a mean square of a half, at two frequencies in Hz."""
    time = PERIOD * np.arange(round(duration / PERIOD))
    parts = ((slow, 1.0 - share_of_fast), (fast, share_of_fast))
    return sum(np.sqrt(share) * np.sin(2.0 * np.pi * frequency * time) for frequency, share in parts)


@pytest.mark.parametrize(("above", "cfc"), [(0.037, 60), (0.07, 180)])
def test_the_band_holds_all_but_a_twentieth_of_the_power_that_a_model_predicts(above, cfc):
    """An impactor that swings at 50 Hz has 2.3 to 3.7 % of its power above CFC 60; its case rings there."""
    assert band_of(predicting(waves(20.0, 250.0, above), until=0.4)) == cfc


@pytest.mark.parametrize(("frequency", "cfc", "band"), [(1.0, 2, "3.3 Hz"), (4.0, 6, "10 Hz"), (12.0, 20, "33 Hz")])
def test_what_is_longer_than_a_crash_has_bands_of_its_own_below_those_of_crashes(frequency, cfc, band):
    slow = waves(frequency, 200.0, 0.02, duration=4.0)
    assert band_of(predicting(slow, until=4.0)) == cfc
    assert band_of(predicting(slow, until=1.0)) == 60
    assert Left(1.0, 0.0, 0.0, cfc, ()).band == band


def test_the_band_is_of_what_the_model_gives_not_of_a_force_that_was_measured():
    """Pulses of a motor are as fast as they are, whatever holds the axis back."""
    held_back, pulses = waves(1.0, 20.0, 0.0, duration=4.0), 4.0 * waves(1.0, 50.0, 1.0, duration=4.0)
    assert band_of(predicting(held_back + pulses / 4.0, until=4.0)) == 60
    assert band_of(predicting(held_back + pulses / 4.0, until=4.0, pushed_by=pulses)) == 2
    assert band_of(predicting(pulses / 4.0, until=4.0, pushed_by=pulses)) == 60, "its elements give nothing yet"


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
