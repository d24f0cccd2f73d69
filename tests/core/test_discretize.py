"""Direct and indirect conversion between continuous and discrete models (3.5.2), and a noise model as a vibration."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import expm

from crash_estimator.core.discretize import exponential, modes, to_continuous, to_discrete
from crash_estimator.core.estimators.noise_model import NoiseModel
from crash_estimator.core.structure import ModelError

AC = np.array([[0.0, 1.0], [-600.0, -1.0]])  # figure 4.2: K/M = 600, C/M = 1
BC = np.array([[0.0], [1.0]])


@pytest.mark.parametrize("scale", [1e-6, 0.3, 20.0])
def test_the_exponential_is_that_of_another_implementation(scale):
    matrix = scale * np.random.default_rng(1).standard_normal((4, 4))
    assert_allclose(exponential(matrix), expm(matrix), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("direct", [False, True])
@pytest.mark.parametrize("step", [1e-4, 1e-3, 1e-2])
def test_there_and_back_is_where_it_began(step, direct):
    ac, bc = to_continuous(*to_discrete(AC, BC, step, direct), step, direct)
    assert_allclose(ac, AC, rtol=1e-7, atol=1e-6)
    assert_allclose(bc, BC, rtol=1e-7, atol=1e-7)


def test_the_indirect_form_is_exact_and_the_direct_one_of_second_order():
    """Against the closed solution of the free vibration over one step."""
    errors = []
    for step in (1e-3, 2e-3):
        w = np.sqrt(600.0 - 0.25)
        e, c, s = np.exp(-0.5 * step), np.cos(w * step), np.sin(w * step)
        exact = e * np.array([[c + 0.5 / w * s, s / w], [-600.0 / w * s, c - 0.5 / w * s]])
        assert_allclose(to_discrete(AC, BC, step)[0], exact, rtol=1e-12, atol=1e-12)
        errors.append(np.abs(to_discrete(AC, BC, step, direct=True)[0] - exact).max())
    assert 7.0 < errors[1] / errors[0] < 9.0  # an error of step^3 in one step


def test_the_car_on_its_spring_is_found_from_samples():
    """K/M and C/M read off the discrete model of a sampled free vibration."""
    ad, bd = to_discrete(AC, BC, 1e-3)
    ac, _ = to_continuous(ad, bd, 1e-3)
    assert_allclose(-ac[1], [600.0, 1.0], rtol=1e-7)


def test_a_discrete_model_without_a_continuous_one_is_refused():
    with pytest.raises(ModelError, match="an eigenvalue is zero or negative"):
        to_continuous(np.diag([0.5, -0.5]), np.ones((2, 1)), 1e-3)
    with pytest.raises(ModelError, match="eigenvalues coincide"):
        to_continuous(np.array([[0.9, 1.0], [0.0, 0.9]]), np.ones((2, 1)), 1e-3)


def test_a_noise_model_is_a_vibration():
    """1 kHz with 20 % of critical damping, sampled at 10 kHz, and an error that decays with 2 ms."""
    s = 2.0 * np.pi * 1000.0 * (-0.2 + 1j * np.sqrt(1.0 - 0.04))
    roots = np.exp(1e-4 * np.array([s, np.conj(s), -500.0]))
    model = NoiseModel(np.real(np.poly(roots))[1:], np.zeros(0), np.zeros((3, 3)), 1.0)
    slow, ringing = modes(model, 1e-4)
    assert_allclose(ringing[:2], [1000.0, 0.2], rtol=1e-6)
    assert_allclose(slow, [0.0, 1.0, 0.002], rtol=1e-6)
    assert modes(NoiseModel(np.zeros(0), np.zeros(0), np.zeros((0, 0)), 1.0), 1e-4) == []
