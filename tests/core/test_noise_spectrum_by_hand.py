"""What a noise's spectrum is found by, where it is known in closed form."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.signal import lfilter

from crash_estimator.core.noise_spectrum import _burg, _worth


def test_burg_s_recursion_finds_the_coefficients_of_autoregressive_noise():
    a = np.array([-0.9, 0.5, -0.3])
    values = lfilter([1.0], [1.0, *a], 2.0 * np.random.default_rng(0).standard_normal(20_000))
    variances, filters = _burg(values, 5)
    assert_allclose(filters[3], a, atol=0.02)
    assert variances[3] == pytest.approx(4.0, rel=0.03)
    assert variances[5] == pytest.approx(variances[3], rel=1e-3), "more of them explain no more"


def test_burg_s_recursion_reverses_with_its_record():
    """It looks at both directions alike."""
    values = lfilter([1.0], [1.0, -0.8, 0.3], np.random.default_rng(1).standard_normal(500))
    for one, other in zip(_burg(values, 4)[1], _burg(values[::-1], 4)[1], strict=True):
        assert_allclose(one, other, atol=1e-10)


@pytest.mark.parametrize("pole", [0.0, 0.5, 0.9, -0.5])
def test_the_slow_power_of_noise_behind_a_pole_is_known_from_fewer_samples(pole):
    """var ln S(0) = 2 / n (1 + 2 (1 + r) / (1 - r)) of n samples behind a pole r."""
    n = 1000
    values = np.full(n, 1.0 / np.sqrt(1.0 - pole**2))  # of this variance, driven by noise of variance one
    expected = n / (1.0 + 2.0 * (1.0 + pole) / (1.0 - pole))
    assert _worth(np.array([-pole]), 1.0, n, values) == pytest.approx(expected)
