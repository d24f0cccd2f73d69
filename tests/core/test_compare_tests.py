"""One test at two sampling rates, two tests by their noise models, and what a curve's difference is."""

import numpy as np
import pytest
from helpers_estimation import oscillator_recording
from numpy.testing import assert_allclose

from crash_estimator.core.characteristic import Characteristic
from crash_estimator.core.compare_tests import coarser, compare_noise_models, compare_tests, curve_difference, spectrum
from crash_estimator.core.estimators.noise_model import NoiseModel
from crash_estimator.core.structure import ModelError
from crash_replay.recording import RecordingError


def model(d=(-1.2, 0.6), a=(), variance=4.0, std=0.02):
    return NoiseModel(np.array(d), np.array(a), std**2 * np.eye(len(d) + len(a)), variance)


def test_coarser_keeps_the_momentum_and_the_impact():
    recording = oscillator_recording(n=1005, pre=100)  # whole milliseconds, 0.5 ms around each
    coarse = coarser(recording, 1e-3)
    assert_allclose(np.diff(coarse.time_ns), 1_000_000)
    assert 0 in coarse.time_ns
    impulse = recording.values[:, 0].sum() * 1e-4
    assert_allclose(coarse.values[:, 0].sum() * 1e-3, impulse, rtol=0.01)
    with pytest.raises(RecordingError, match="a coarser period must be longer"):
        coarser(recording, 5e-5)


def test_the_spectrum_holds_the_variance():
    """White noise of variance 4: flat, and 4 over the whole band; AR(1): var / (1 - d^2)."""
    frequency = np.linspace(0.0, 5000.0, 20001)
    white = spectrum(model(d=()), frequency, 1e-4)
    assert_allclose(white, 4.0 / 5000.0)
    red = spectrum(model(d=(-0.8,)), frequency, 1e-4)
    assert_allclose(np.trapezoid(red, frequency), 4.0 / (1.0 - 0.64), rtol=1e-3)


def test_alike_models_do_not_differ_and_others_do():
    same = compare_noise_models(model(), model(d=(-1.21, 0.61)), 1e-4)
    assert same.confidence == 0.0 and same.degrees == 2 and same.spectral_distance < 0.5
    other = compare_noise_models(model(), model(d=(-0.9, 0.6)), 1e-4)
    assert other.differs(0.99) and other.confidence == 0.99
    assert 500.0 < other.loudest[0] < 1200.0 and other.loudest[1] < -3.0  # it does not ring at 1.1 kHz any more
    louder = compare_tests([model()], [model(variance=8.0)], 1e-4)[0]
    assert_allclose(louder.spectral_distance, 10.0 * np.log10(2.0), rtol=1e-6)
    with pytest.raises(ModelError, match="at the same orders"):
        compare_noise_models(model(), model(d=(-0.8,)), 1e-4)


def test_the_difference_of_two_curves():
    crush = np.linspace(0.0, 0.5, 11)
    one = Characteristic("e", crush, 1e5 * crush, None, 0.0, True)
    other = Characteristic("e", crush, 1e5 * crush + 5e3 * (crush > 0.0), None, 0.0, True)
    assert curve_difference(one, one) == 0.0
    assert_allclose(curve_difference(one, other), 5e3 / 5.5e4, rtol=0.05)
