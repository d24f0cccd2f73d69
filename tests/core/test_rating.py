"""The ISO/TS 18571 rating against a public implementation, and where its parts must be exact."""

import resource

import numpy as np
import pytest
from numpy.testing import assert_allclose

from crash_estimator.core.rating import rate


def signals(n, lag, gain, hum):
    t = np.arange(n) * 1e-4
    reference = -300.0 * np.sin(np.pi * np.clip(1.3 * t / t[-1], 0.0, 1.0)) + 20.0 * np.sin(1131.0 * t)
    return reference, gain * np.roll(reference, lag) + hum * np.sin(2500.0 * t + 1.0)


GOLDEN = {  # corridor, phase, magnitude, slope, overall: from the package objective-rating-metrics 1.3
    (300, 28, 1.1, 3.0): (
        0.467487628548785,
        0.5333333333333333,
        0.9483793487707437,
        0.9149022163356485,
        0.6663180311074591,
    ),
    (700, -3, 0.8, 10.0): (
        0.7755630097787801,
        0.9785714285714285,
        0.8986439251446284,
        0.5832115643900162,
        0.8023105875327268,
    ),
    (1001, 0, 1.0, 15.0): (1.0, 1.0, 0.9612991182470141, 0.3480477262323539, 0.8618693688958737),
    (1200, -300, 1.3, 0.0): (0.16987588495136477, 0.0, 0.7091659955115961, 0.6268310453862227, 0.3351497621601097),
    (400, 5, 2.2, 40.0): (0.28979226216061443, 0.9375, 0.0, 0.0, 0.3034169048642458),
}


@pytest.mark.parametrize("case", GOLDEN)
def test_ratings_are_those_of_another_implementation(case):
    assert_allclose(rate(*signals(*case))[:5], GOLDEN[case], rtol=1e-9)


def test_a_signal_rates_itself_as_excellent():
    reference, _ = signals(400, 0, 1.0, 0.0)
    rating = rate(reference, reference)
    assert_allclose(rating[:5], 1.0)
    assert rating.shift == 0 and rating.grade == "excellent"


def test_a_comparison_whose_squares_are_beyond_all_numbers_is_rated():
    """As of a simulation that runs away: the way back through the warped pairs would else leave them."""
    reference, _ = signals(400, 0, 1.0, 0.0)
    rating = rate(reference, 1e200 * np.exp(np.linspace(-9.0, 0.0, 400)))
    assert (rating.corridor < 0.5, rating.magnitude, rating.slope, rating.grade) == (True, 0.0, 0.0, "poor")


def test_a_common_unit_is_no_matter():
    reference, comparison = signals(700, -3, 0.8, 10.0)
    assert_allclose(rate(1e160 * reference, 1e160 * comparison)[:5], rate(reference, comparison)[:5], rtol=1e-9)


@pytest.mark.parametrize("late", [-20, 7])
def test_a_shift_costs_phase_in_proportion(late):
    """A lone pulse, so that nothing is lost at the ends."""
    t = np.arange(500)
    pulse = np.exp(-(((t - 250) / 30.0) ** 2))
    rating = rate(pulse, np.roll(pulse, late))
    assert rating.shift == late
    assert_allclose(rating.phase, 1.0 - abs(late) / 100.0)
    assert_allclose([rating.magnitude, rating.slope], 1.0, atol=1e-6)


def test_what_cannot_be_rated_is_refused():
    with pytest.raises(ValueError, match="same length"):
        rate(np.arange(20.0), np.arange(21.0))
    with pytest.raises(ValueError, match="at least 10 samples"):
        rate(np.arange(5.0), np.arange(5.0))
    with pytest.raises(ValueError, match="without gaps"):
        rate(np.arange(20.0), np.full(20, np.nan))
    with pytest.raises(ValueError, match="reference that changes"):
        rate(np.ones(20), np.arange(20.0))


def test_two_seconds_at_10_khz_need_no_gigabytes():
    """A byte for each pair of samples within the band of a tenth: 80 MB; 8 bytes for every pair would be 3.2 GB."""
    time = np.linspace(0.0, 2.0, 20_001)
    pulse = np.sin(np.pi * time) * np.exp(-time)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert rate(pulse, 1.01 * pulse).overall > 0.97
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 500_000  # kB
