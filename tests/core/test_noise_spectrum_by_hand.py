"""What a noise's spectrum is found by, where it is known in closed form."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.signal import lfilter

from crash_estimator.core.noise_spectrum import Colour, _burg, _spread


def test_burg_s_recursion_finds_the_coefficients_of_autoregressive_noise():
    a = np.array([-0.9, 0.5, -0.3])
    values = lfilter([1.0], [1.0, *a], 2.0 * np.random.default_rng(0).standard_normal(20_000))
    variances, filters = _burg([values], 5)
    assert_allclose(filters[3], a, atol=0.02)
    assert variances[3] == pytest.approx(4.0, rel=0.03)
    assert variances[5] == pytest.approx(variances[3], rel=1e-3), "more of them explain no more"


def test_burg_s_recursion_reverses_with_its_record():
    """It looks at both directions alike."""
    values = lfilter([1.0], [1.0, -0.8, 0.3], np.random.default_rng(1).standard_normal(500))
    for one, other in zip(_burg([values], 4)[1], _burg([values[::-1]], 4)[1], strict=True):
        assert_allclose(one, other, atol=1e-10)


@pytest.mark.parametrize("pole", [0.0, 0.5, 0.9, -0.5])
def test_the_slow_power_of_noise_behind_a_pole_is_known_from_fewer_samples(pole):
    """var ln S(0) = 2 / n (1 + 2 (1 + r) / (1 - r)) of n samples behind a pole r."""
    n = 1000
    values = np.full(n, 1.0 / np.sqrt(1.0 - pole**2))  # of this variance, driven by noise of variance one
    expected = n / (1.0 + 2.0 * (1.0 + pole) / (1.0 - pole))
    a = np.array([-pole])
    assert Colour(a, n, _spread(a, 1.0, [values])).known(n, n) == pytest.approx(expected)


def test_rests_that_are_cut_into_pieces_have_the_colour_of_the_whole():
    """But for the pairs across the cuts."""
    values = lfilter([1.0], [1.0, -0.8, 0.3], np.random.default_rng(2).standard_normal(4000))
    whole, pieces = _burg([values], 2)[1][2], _burg(np.split(values, 4), 2)[1][2]
    assert_allclose(pieces, whole, atol=5e-3)


def test_what_a_colour_leaves_is_what_drove_the_noise():
    a = np.array([-0.9, 0.5])
    driving = np.random.default_rng(3).standard_normal(2000)
    values = lfilter([1.0], [1.0, *a], driving)
    colour = Colour(a, 2000, 0.0)
    forward = np.mean(driving[2:] ** 2)
    backward = np.mean(np.convolve(values[::-1], [1.0, *a])[2:2000] ** 2)
    assert colour.left(values) == pytest.approx(0.5 * (forward + backward))
    assert Colour(np.zeros(0), 1, 0.0).left(values) == pytest.approx(np.mean(values**2))
