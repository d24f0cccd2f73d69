"""The spectrum of a sensor's noise: its colour and its filter are found from 30 ms of rest."""

import numpy as np
import pytest
from scipy.signal import butter, filtfilt, lfilter

from crash_estimator.core.noise_spectrum import CORNER, TOLD, NoiseSpectrum, colour_of, noise_spectrum, seen_early

PERIOD, REST, TIMES = 1e-4, 300, 60


def behind_a_pole(corner):
    """White noise behind one pole, with the same standard deviation: ten times as strong at low frequencies."""
    pole = np.exp(-2.0 * np.pi * corner * PERIOD)
    return lambda white: lfilter([np.sqrt(1.0 - pole**2)], [1.0, -pole], white)


def filtered(cfc):
    """SAE J211-1, appendix C."""
    b, a = butter(2, CORNER * cfc, fs=1.0 / PERIOD)
    return lambda white: filtfilt(b, a, white)


def spectra(colour):
    rng = np.random.default_rng(8)
    return [noise_spectrum(colour(rng.standard_normal(3 * REST))[REST : 2 * REST], PERIOD) for _ in range(TIMES)]


def test_white_noise_is_white_with_its_standard_deviation():
    found = spectra(lambda white: white)
    assert sum(one.white for one in found) >= TIMES - 2
    assert np.median([one.std for one in found]) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("corner", (300.0, 800.0))
def test_the_strength_of_coloured_noise_is_that_at_low_frequencies(corner):
    pole = np.exp(-2.0 * np.pi * corner * PERIOD)
    found = spectra(behind_a_pole(corner))
    assert sum(one.white for one in found) <= 2, "30 ms can tell too little of what is slow"
    found = [one for one in found if not one.white]
    logarithm = np.log([one.std for one in found])
    assert np.median(logarithm) == pytest.approx(0.5 * np.log((1.0 + pole) / (1.0 - pole)), abs=0.1)
    told = np.median([one.samples for one in found])
    assert np.std(logarithm) == pytest.approx(1.0 / np.sqrt(2.0 * told), rel=0.35), "as well as it says it is known"
    assert np.median([one.of_one_sample for one in found]) == pytest.approx(1.0, abs=0.1)
    high = np.array([2000.0])
    expected = (1.0 - pole) ** 2 / np.abs(1.0 - pole * np.exp(-2j * np.pi * PERIOD * high)) ** 2
    assert np.median([one.density(high) for one in found]) == pytest.approx(expected[0], rel=0.3)


def test_means_of_white_noise_are_white():
    white = NoiseSpectrum(1.0, REST, period=PERIOD)
    np.testing.assert_allclose(white.density(np.linspace(0.0, 1250.0, 7), means_over=4), 1.0)


@pytest.mark.parametrize("cfc", (180, 600))
def test_the_filter_class_is_found_and_the_noise_before_it(cfc):
    found = spectra(filtered(cfc))
    assert sum(one.corner == CORNER * cfc for one in found) > 0.9 * TIMES
    assert np.median([one.std for one in found]) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("cfc", (60, 180))
@pytest.mark.parametrize("loud", (300.0, 3000.0))
def test_a_loud_jump_stands_out_of_the_noise_as_early_as_said(cfc, loud):
    """Not by a time constant of the filter less, and never earlier."""
    n, corner = 4000, CORNER * cfc
    shown = filtered(cfc)(np.repeat([0.0, loud], n))
    early = (n - np.flatnonzero(np.abs(shown) > 1.0)[0]) * PERIOD
    told = seen_early(corner, loud)
    assert early - PERIOD < told < early + 1.0 / (np.sqrt(2.0) * np.pi * corner)
    assert told > seen_early(corner) == pytest.approx(1.0 / corner)


def test_what_the_filter_took_in_its_band_is_given_back():
    time = np.arange(4000) * PERIOD
    slow = np.exp(-(((time - 0.2) / 0.004) ** 2))  # to 100 Hz, about
    b, a = butter(2, CORNER * 180, fs=1.0 / PERIOD)
    seen = filtfilt(b, a, slow)
    found = next(one for one in spectra(filtered(180)) if one.corner == CORNER * 180)
    assert np.abs(found.unfiltered(seen) - slow).max() < 0.2 * np.abs(seen - slow).max()


def test_a_body_that_sways_before_the_impact_says_nothing_of_the_noise():
    rng = np.random.default_rng(3)
    swaying = rng.standard_normal(REST) + 3.0 * np.sin(2.0 * np.pi * 10.0 * PERIOD * np.arange(REST))
    assert noise_spectrum(swaying, PERIOD).white


def test_slow_noise_that_one_rest_cannot_tell_is_told_by_several_of_any_strength():
    """Behind a pole at 170 Hz, as the noise of an AR(1) of 0.9 at 10 kHz is."""
    pole, rng = np.exp(-2.0 * np.pi * 170.0 * PERIOD), np.random.default_rng(4)
    alone, together = [], []
    for _ in range(TIMES):
        rests = [behind_a_pole(170.0)(size * rng.standard_normal(3 * REST))[REST : 2 * REST] for size in (1, 2, 5, 1)]
        alone.append(noise_spectrum(rests[1], PERIOD))
        together.append(noise_spectrum(rests[1], PERIOD, [colour_of(rests, PERIOD)]))
    assert sum(one.white for one in alone) > 0.5 * TIMES and not any(one.white for one in together)
    slow = np.array([0.0])
    zero = [one.std * float(np.sqrt(one.density(slow)[0])) for one in together]
    logarithm = np.log(zero)
    assert np.median(logarithm) == pytest.approx(np.log(2.0) + 0.5 * np.log((1.0 + pole) / (1.0 - pole)), abs=0.15)
    told = np.median([one.samples for one in together])
    assert np.std(logarithm) == pytest.approx(1.0 / np.sqrt(2.0 * told), rel=0.35), "as well as it says it is known"


def test_a_sensor_of_another_colour_keeps_its_own():
    rng = np.random.default_rng(5)
    coloured = [behind_a_pole(300.0)(rng.standard_normal(3 * REST))[REST : 2 * REST] for _ in range(5)]
    white = rng.standard_normal(REST)
    alike = [colour_of([*coloured, white], PERIOD)]
    assert noise_spectrum(white, PERIOD, alike).white
    assert noise_spectrum(white, PERIOD, alike) == noise_spectrum(white, PERIOD)
    assert not noise_spectrum(coloured[0], PERIOD, [colour_of(coloured, PERIOD)]).white


def test_several_sensors_on_bodies_that_sway_say_no_more_than_one():
    """A quarter of a period each: all together know the colour well, and none has seen the sway go up and down."""
    rng, time = np.random.default_rng(0), PERIOD * np.arange(250)
    phases = rng.uniform(0.0, 2.0 * np.pi, 8)
    rests = [rng.standard_normal(len(time)) + 3.0 * np.sin(2.0 * np.pi * 10.0 * time + phase) for phase in phases]
    found, alike = colour_of(rests, PERIOD), [colour_of(rests, PERIOD)]
    assert len(found.coefficients) and found.known(len(time), found.samples) > TOLD
    assert all(noise_spectrum(rest, PERIOD, alike).white for rest in rests)


def test_sensors_without_noise_have_no_colour():
    assert noise_spectrum(np.full(REST, 3.0), PERIOD, [colour_of([np.full(REST, 3.0)] * 2, PERIOD)]) == NoiseSpectrum(
        0.0, REST, period=PERIOD
    )
