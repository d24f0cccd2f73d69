"""What is stated of the lag, and of what an update leaves: coverage, and what must not change with either."""

from dataclasses import replace
from math import erf, sqrt

import numpy as np
import pytest
from helpers_estimation import oscillator, oscillator_recording
from numpy.testing import assert_allclose, assert_array_equal
from test_gauss_newton import coloured

from crash_estimator.benchmarks.coverage import model_for, recorded, rows, simulated
from crash_estimator.core.estimators.update import residual_variance
from crash_estimator.core.fold import run
from crash_estimator.core.methods import make_estimator
from crash_estimator.core.regressor_errors import late
from crash_estimator.core.structure import Coefficient

METHODS = ["rls", "mrls", "kalman", "constrained_kalman", "gauss_newton", "afmm"]


def below(x):
    return 0.5 * (1.0 + erf(x / sqrt(2.0)))


@pytest.mark.parametrize("behind", [0.0, 0.1, 0.3, 0.5, 1.0, 3.0, -20.0])
def test_as_many_lie_within_the_stated_sigma_as_it_says_however_late_the_method_is(behind):
    """Of an error N(d, 1): 95 %, and 94 % where d is a third of a sigma, at the bend between the two limits."""
    reach = 1.96 * np.sqrt(late(np.array([behind]), np.eye(1))[0, 0])
    assert 0.939 < below(reach - behind) - below(-reach - behind) < 0.951


def test_what_is_stated_stays_a_covariance_and_is_the_filter_s_where_both_agree():
    half = np.random.default_rng(0).standard_normal((3, 3))
    covariance = half @ half.T
    assert_allclose(late(np.zeros(3), covariance), covariance, rtol=1e-12)
    stated = late(np.array([5.0, 0.1, -7.0]), covariance)
    assert np.linalg.eigvalsh(stated - covariance).min() > -1e-9  # rounding of values near 10
    assert stated[0, 2] < covariance[0, 2]  # one is too high where the other is too low


def followed(method, drift, compiled=True):
    structure = model_for("frontal_engine_cab", True)
    elements = tuple(
        replace(e, stiffness=replace(e.stiffness, drift=drift)) if e.stiffness.estimated else e
        for e in structure.elements
    )
    truth = simulated("frontal_engine_cab", True, False)
    recording = recorded(truth, 1.0, 5)
    last = 60 if method in ("gauss_newton", "afmm") else 400  # ms: a sample of those takes a millisecond
    kept = recording.time_ns < last * 1_000_000
    recording = replace(recording, time_ns=recording.time_ns[kept], values=recording.values[kept])
    return run(make_estimator(replace(structure, elements=elements), recording.test, method), recording.samples())


@pytest.mark.parametrize("method", ["rls", "mrls", "gauss_newton", "afmm"])
def test_the_lag_is_in_the_sigma_alone(method):
    """These take theta as constant: what the model says of its walk changes neither theta nor a force."""
    walking, still = followed(method, 0.5), followed(method, 0.0)
    for field in ("parameters", "force", "innovation", "innovation_covariance", "residual_std"):
        assert_array_equal([getattr(e, field) for e in walking], [getattr(e, field) for e in still])
    assert any((a.std > 2.0 * b.std).any() for a, b in zip(walking, still))


@pytest.mark.parametrize("method", ["rls", "mrls"])
def test_the_truth_lies_inside_where_a_stiffness_changes_by_a_factor_of_four(method):
    """60 instants for each of two stiffnesses, five of a seed: by chance no less than 85 %. It was 55 to 75 %."""
    for row in rows(range(12), True, [method], ["frontal_engine_cab"]):
        assert row.inside > 0.85, row


def test_what_the_gain_of_a_kalman_filter_leaves_and_what_no_update_leaves():
    rng = np.random.default_rng(2)
    half, psi, r = rng.standard_normal((3, 3)), rng.standard_normal((2, 3)), np.array([0.5, 2.0])
    before = half @ half.T
    s = psi @ before @ psi.T + np.diag(r)
    gain = before @ psi.T @ np.linalg.inv(s)
    after = before - gain @ psi @ before
    left = residual_variance(r, psi, after, gain)
    assert_allclose(left, np.diagonal(np.diag(r) @ np.linalg.inv(s) @ np.diag(r)), rtol=1e-10)
    assert_allclose(residual_variance(r, psi, before, 0.0 * gain), np.diagonal(s), rtol=1e-12)


@pytest.mark.parametrize("method", ["rls", "mrls", "kalman", "constrained_kalman", "gauss_newton"])
def test_residuals_are_as_large_as_is_stated(method):
    """Noise of 5, known; from the first samples on, which the update follows nearly. 24 tests of 40 residuals, those of
    a test independent: the mean square of 960 is 1 +- 0.05, and 0.2 is four times that."""
    noise, seeds = 5.0, 24
    structure = oscillator(Coefficient(1.0e4, True, std=1.0e5, drift=0.0), Coefficient(0.0, True, std=1.0e3))
    structure = replace(structure, bodies=(replace(structure.bodies[0], noise=noise), structure.bodies[1]))
    exact, squares = oscillator_recording(n=42, pre=0), []
    orders = {"p": 0, "q": 0} if method == "gauss_newton" else {}
    for seed in range(seeds):
        recording = coloured(exact, [], [], sd=noise, seed=seed)
        estimates = run(make_estimator(structure, recording.test, method, **orders), recording.samples())[2:]
        squares += [float(e.residual[0] / e.residual_std[0]) ** 2 for e in estimates]
    assert abs(np.mean(squares) - 1.0) < 0.2


@pytest.mark.parametrize("method", METHODS)
def test_a_residual_s_sigma_is_never_nothing(method):
    """Before contact and where a stiffness is held it is the innovation's; NaN before any noise is known."""
    estimates = followed(method, 0.5)
    for e in estimates:
        unknown = np.isnan(e.residual_std)
        assert (e.residual_std[~unknown] > 0.0).all()
        assert_array_equal(unknown, np.diagonal(e.innovation_covariance) == 0.0)
        if e.time_ns < 0:
            known = np.sqrt(np.diagonal(e.innovation_covariance))
            assert_array_equal(e.residual_std[~unknown], known[~unknown])
    assert np.isnan(estimates[0].residual_std).all() and not np.isnan(estimates[-1].residual_std).any()
