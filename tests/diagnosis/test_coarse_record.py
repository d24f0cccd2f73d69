"""A record in means over short bins: what it compares, and what their noise is."""

import numpy as np
import pytest
import yaml
from helpers_diagnosis import hidden_case, so_far
from helpers_estimation import oscillator, oscillator_recording
from numpy.testing import assert_allclose
from scipy.signal import lfilter
from test_filtered_time_zero import MODEL, crash

from crash_estimator.core.diagnosis.observation.bin_means import MOST_STEPS, in_bins
from crash_estimator.core.diagnosis.observation.grid import bins_of
from crash_estimator.core.diagnosis.observation.record import observe
from crash_estimator.core.diagnosis.online.online_diagnosis import OnlineDiagnosis
from crash_estimator.core.diagnosis.residuals.residuals import _white as white_residual
from crash_estimator.core.noise_spectrum import NoiseSpectrum
from crash_estimator.model_file import ModelFile
from crash_replay.recording import Recording


def test_a_coarse_record_keeps_the_means_and_the_noise_of_a_mean():
    _, model, recording = hidden_case("side", "", 8120)
    record = observe(model, recording)
    coarse = in_bins(record)
    count = len(coarse.at)
    per_bin = round(record.noise[0] ** 2 / coarse.noise[0] ** 2)
    # a whole number of samples in a bin
    assert per_bin > 1 and len(record.at) / (per_bin + 0.5) <= MOST_STEPS
    used = record.measured[-count * per_bin :]
    assert_allclose(coarse.measured, used.reshape(count, per_bin, -1).mean(axis=1))
    assert_allclose(coarse.time[coarse.at][-1], record.time[record.at][-per_bin:].mean())


def test_a_coarse_record_compares_what_the_record_itself_compares():
    """A filter's first samples after the impact show what was before it as well, and those of a dead time nothing."""
    record = observe(oscillator(), oscillator_recording(n=401))
    mixed, dead = 102, slice(200, 210)
    valid, measured = record.valid.copy(), record.measured.copy()
    valid[record.at[:mixed]] = valid[record.at[dead]] = 0.0
    measured[:mixed], measured[dead] = 1e6, np.nan
    coarse = in_bins(record._replace(valid=valid, measured=measured))
    per_bin = round(record.noise[0] ** 2 / coarse.noise[0] ** 2)
    beside = np.where(valid[record.at] > 0.0, measured, np.nan)[-len(coarse.at) * per_bin :].reshape(-1, per_bin)
    share = np.isfinite(beside).mean(axis=1)
    assert {0.0, 1.0} < set(share), "one bin is compared in part"
    assert_allclose(coarse.valid[coarse.at, 0] ** 2, share)
    assert_allclose(coarse.measured[share > 0.0, 0], np.nanmean(beside[share > 0.0], axis=1))


def test_coloured_noise_is_white_to_the_fit_and_to_the_tests_of_what_it_leaves():
    """Noise behind a pole, which its means over five samples still show: by far the most below 500 Hz."""
    record = observe(oscillator(), oscillator_recording(n=801))
    pole, samples = 0.9, len(record.at)
    spectrum = NoiseSpectrum(1.0, 1e3, record.period, (-pole,))
    coarse = in_bins(record._replace(spectra=(spectrum,), noise=np.ones(1)))
    strength = np.sqrt(spectrum.density(np.zeros(1))[0]) * (1.0 - pole)
    squares = []
    for seed in range(20):
        white = np.random.default_rng(seed).standard_normal(samples + 200)
        noise = lfilter([strength], [1.0, -pole], white)[-samples:, None]
        means = in_bins(record._replace(measured=noise, spectra=(spectrum,))).measured
        z = np.nan_to_num(means) / coarse.noise
        squares.append((coarse.whitened(z) ** 2).mean())
        assert_allclose(white_residual(coarse, z), coarse.whitened(z))
    assert abs(np.mean(squares) - 1.0) < 0.05


def test_while_a_filter_shows_what_was_before_the_impact_nothing_is_said():
    """CFC 60, for 8 ms: there is nothing to compare yet."""
    model, recording = ModelFile.model_validate(yaml.safe_load(MODEL)).structure(), crash(7.0, 0.0, 60)
    diagnosis = OnlineDiagnosis(model, recording.test, budget=np.inf)
    assert diagnosis.update(diagnosis.init(), so_far(recording, 0.0075))[1] is None
    assert diagnosis.update(diagnosis.init(), so_far(recording, 0.0125))[1].verdict == "adequate"


def test_bins_are_as_long_as_a_record_asks_for_up_to_its_very_last_sample():
    """40 ms at 10 kHz, the last sample 120 ms after those: 1 ms each, not the half that they would be without it."""
    whole = oscillator_recording(n=401)
    time_ns = whole.time_ns.copy()
    time_ns[-1] += 120_000_000
    record = observe(oscillator(), Recording(whole.test, time_ns, whole.values))
    assert round(record.noise[0] ** 2 / in_bins(record).noise[0] ** 2) == 10


@pytest.mark.parametrize(("transformed", "bins"), [(True, 432), (False, 433)])
def test_of_coloured_noise_there_are_as_many_bins_as_are_soon_transformed(transformed, bins):
    """433 is prime: a cosine transform of so many takes five times as long. What is in no bin is not compared."""
    time = np.arange(4 * 433) * 1e-4
    bin_, valid, found = bins_of(time, np.arange(len(time)), np.ones((len(time), 2)), transformed=transformed)
    assert found == bins and bin_.max() == bins - 1
    assert_allclose(np.flatnonzero(valid[:, 0]), np.arange(1, 4 * bins))


def test_a_short_record_keeps_all_its_bins():
    time = np.arange(4 * 13) * 1e-4
    assert bins_of(time, np.arange(len(time)), np.ones((len(time), 1)), transformed=True)[2] == 13
