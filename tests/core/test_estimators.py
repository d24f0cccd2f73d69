"""Identities, conformance and recovery of the estimation methods."""

import numpy as np
import pytest
from helpers_estimation import oscillator, oscillator_recording
from numpy.testing import assert_allclose, assert_array_equal

from crash_estimator.core.estimate import ParameterStatus
from crash_estimator.core.fold import run
from crash_estimator.core.methods import METHODS, make_estimator
from crash_estimator.core.structure import Coefficient, ModelError

BOTH = dict(stiffness=Coefficient(1.0e4, True, std=1.0e4), damping=Coefficient(0.0, True, std=100.0))
NOISE = 5.0  # m/s^2
EXACT = {  # the methods, with the settings in which nothing delays their convergence
    "rls": {},
    "mrls": {"cr": 1.0, "step_limit": np.inf},
    "kalman": {"noise_memory": 0},
    "constrained_kalman": {"noise_memory": 0},
    "gauss_newton": {},
    "afmm": {"noise_memory": 0, "interval": 0},
}


def estimates_of(method, recording, structure=None, **settings):
    structure = structure or oscillator(**BOTH)
    return run(make_estimator(structure, recording.test, method, **settings), recording.samples())


def batch(recording, weights, upto):
    """Regularised weighted least squares of the oscillator in one piece, from its own formula."""
    after = (recording.time_ns > 0) & (np.arange(len(recording)) <= upto)
    offset = recording.values[recording.time_ns < 0, 0].mean()
    y = (recording.values[:, 0] - offset)[after]
    psi = -recording.values[after][:, 1:] / 10.0
    prior = np.diag([1.0e4**-2, 100.0**-2])
    information = prior + (psi.T * weights[after]) @ psi
    theta = np.linalg.solve(information, prior @ [1.0e4, 0.0] + psi.T @ (weights[after] * y))
    return theta, np.linalg.inv(information)


def zero_error(recording, psi, gain):
    """What a zero wrong by its own standard deviation, alike at all samples, has done to theta, squared."""
    before = recording.values[recording.time_ns < 0, 0]
    moved = gain @ psi
    return np.outer(moved, moved) * _learnt_noise(before) / len(before)


def test_kalman_without_process_noise_is_regularised_least_squares_at_every_sample():
    recording = oscillator_recording(noise=NOISE)
    structure = oscillator(
        stiffness=Coefficient(1.0e4, True, std=1.0e4, drift=0.0), damping=Coefficient(0.0, True, std=100.0)
    )
    estimates = estimates_of("constrained_kalman", recording, structure, noise_memory=0, offsets=False)
    before = recording.values[recording.time_ns < 0, 0]
    for k in (60, 100, 200, len(recording) - 1):
        # the noise that the filter has learnt before the impact, from the first innovation's variance
        variance = estimates[51].innovation_covariance[0, 0] - _prior_spread(recording, 51)
        theta, covariance = batch(recording, np.full(len(recording), 1.0 / variance), k)
        after = (recording.time_ns > 0) & (np.arange(len(recording)) <= k)
        psi = -recording.values[after, 1:].sum(axis=0) / 10.0
        covariance = covariance + zero_error(recording, psi / variance, covariance)
        assert_allclose(estimates[k].parameters, theta, rtol=1e-7)
        assert_allclose(estimates[k].covariance, covariance, rtol=1e-6, atol=1e-9 * covariance.max())
    assert_allclose(variance, before.var(), rtol=0.2)


def _prior_spread(recording, k):
    psi = -recording.values[k, 1:] / 10.0
    return psi @ np.diag([1.0e4**2, 100.0**2]) @ psi


def test_rls_with_forgetting_one_is_weighted_least_squares_at_every_sample():
    recording = oscillator_recording(noise=NOISE)
    structure = oscillator(
        stiffness=Coefficient(1.0e4, True, std=1.0e4, drift=0.0), damping=Coefficient(0.0, True, std=100.0)
    )
    estimates = estimates_of("rls", recording, structure, forgetting=1.0)
    # Ljung's weights 1 / Lambda_t, recomputed from the published innovations: gamma = 1/2, 1/3, ...
    before = recording.values[recording.time_ns < 0, 0]
    weights, gamma, error_covariance = np.zeros(len(recording)), 1.0, None
    # and the noise's variance from the residuals, never below that before
    variances, variance = np.zeros(len(recording)), None
    for k in np.flatnonzero(recording.time_ns > 0):
        gamma = 1.0 / (1.0 / gamma + 1.0)
        if error_covariance is None:
            floor = error_covariance = variance = _learnt_noise(before)
        error_covariance += gamma * (estimates[k].innovation[0] ** 2 - error_covariance)
        weights[k] = 1.0 / (error_covariance + 0.1 * floor)
        variances[k] = variance
        product = estimates[k].innovation[0] * estimates[k].residual[0]
        variance = max(variance + (product - variance) * 0.1 / (0.1 + 4.0 * 5.0), floor)
    for k in (60, 100, 200, len(recording) - 1):
        theta, inverse = batch(recording, weights, k)
        assert_allclose(estimates[k].parameters, theta, rtol=1e-6)
        psi = -recording.values[: k + 1, 1:] / 10.0
        noise = (psi.T * (weights**2 * variances)[: k + 1]) @ psi  # the covariance of S theta, and so S^-1 (...) S^-1
        covariance = inverse @ (np.diag([1.0e4**-2, 100.0**-2]) + noise) @ inverse
        covariance = covariance + zero_error(recording, weights[: k + 1] @ psi, inverse)
        assert_allclose(estimates[k].covariance, covariance, rtol=1e-6, atol=1e-9 * covariance.max())


def _learnt_noise(before):
    running_mean = np.cumsum(before) / np.arange(1, len(before) + 1)
    return np.mean((before - running_mean) ** 2)


def test_mrls_that_never_rewinds_is_rls():
    recording = oscillator_recording(noise=NOISE)
    plain = estimates_of("rls", recording)
    modified = estimates_of("mrls", recording, error_limit=1e9)
    assert_array_equal([e.parameters for e in plain], [e.parameters for e in modified])
    assert not [event for e in modified for event in e.events if event.kind == "rewound"]


@pytest.mark.parametrize("method", EXACT)
def test_bounds_that_never_bind_change_nothing(method):
    recording = oscillator_recording(noise=NOISE)
    bounded = oscillator(stiffness=Coefficient(1.0e4, True, std=1.0e4, min=-1e12, max=1e12), damping=BOTH["damping"])
    assert_array_equal(
        [e.parameters for e in estimates_of(method, recording)],
        [e.parameters for e in estimates_of(method, recording, bounded)],
    )


# the other methods know no bounds, or explain by noise
@pytest.mark.parametrize("method", ["rls", "mrls", "constrained_kalman"])
def test_a_negative_stiffness_is_clamped_to_zero_and_the_rest_estimated_again(method):
    recording = oscillator_recording(stiffness=2.0e4, damping=300.0, noise=NOISE)
    flipped = type(recording)(recording.test, recording.time_ns, recording.values * [1.0, -1.0, 1.0])
    structure = oscillator(stiffness=Coefficient(1.0e3, True, std=1.0e4, min=0.0, drift=0.0), damping=BOTH["damping"])
    estimates = estimates_of(method, flipped, structure)
    values = np.array([e.parameters for e in estimates])
    status = np.array([e.status for e in estimates])
    assert values[:, 0].min() == 0.0
    clamped = status[-200:, 0] == ParameterStatus.CLAMPED
    assert clamped.mean() > 0.5 and (values[-200:, 0][clamped] == 0.0).all()
    assert (status[-200:, 1] == ParameterStatus.ESTIMATED).all()
    assert (np.diff(values[-200:, 1][clamped]) != 0.0).mean() > 0.9
    assert any(event.kind == "clamped" for e in estimates for event in e.events)


@pytest.mark.parametrize("method", EXACT)
def test_recovery_is_exact_without_noise(method):
    """Two samples determine two parameters; rewinds, clipping, drift and a noise that adapts only delay it."""
    recording = oscillator_recording(noise=0.0)
    structure = oscillator(Coefficient(1.0e4, True, std=1.0e4, drift=0.0), BOTH["damping"])
    last = estimates_of(method, recording, structure, **EXACT[method])[-1]
    assert_allclose(last.parameters, [2.0e4, 50.0], rtol=1e-6)


@pytest.mark.parametrize("method", EXACT)
class TestConformance:
    def test_inputs_stay_runs_repeat_and_a_kept_state_goes_on_as_if_never_left(self, method):
        recording = oscillator_recording(noise=NOISE)
        copy = recording.values.copy()
        estimator = make_estimator(oscillator(**BOTH), recording.test, method)
        samples = list(recording.samples())
        whole = run(estimator, samples)
        state = estimator.init()
        for sample in samples[:200]:
            state, _ = estimator.step(state, sample)
        kept = state
        for sample in samples[200:300]:
            state, _ = estimator.step(state, sample)
        assert_array_equal(recording.values, copy)
        state = kept
        for sample, expected in zip(samples[200:], whole[200:]):
            state, estimate = estimator.step(state, sample)
            assert_array_equal(estimate.parameters, expected.parameters)
            assert_array_equal(estimate.covariance, expected.covariance)

    def test_covariance_stays_symmetric_and_positive(self, method):
        recording = oscillator_recording(noise=NOISE, n=1000)
        for estimate in estimates_of(method, recording)[::50]:
            assert_array_equal(estimate.covariance, estimate.covariance.T)
            scaled = estimate.covariance / np.outer([1.0e4, 100.0], [1.0e4, 100.0])
            assert np.linalg.eigvalsh(scaled).min() > -1e-12

    def test_a_dropout_is_said_and_leaves_the_parameters_alone(self, method):
        recording = oscillator_recording(noise=NOISE)
        values = recording.values.copy()
        values[200:220, 0] = np.nan
        broken = type(recording)(recording.test, recording.time_ns, values)
        estimates = estimates_of(method, broken)
        assert all(np.isfinite(e.parameters).all() and np.isfinite(e.covariance).all() for e in estimates)
        assert_array_equal(estimates[219].parameters, estimates[199].parameters)
        dropouts = [(e.number, event.target) for e in estimates for event in e.events if event.kind == "dropout"]
        assert dropouts == [(200, "block")]
        assert np.isnan(estimates[210].residual).all()

    def test_before_contact_nothing_changes(self, method):
        recording = oscillator_recording(noise=NOISE)
        apart = recording.values.copy()
        apart[:, 1:] = [-0.01, 0.0]
        separated = type(recording)(recording.test, recording.time_ns, apart)
        last = estimates_of(method, separated, oscillator(**BOTH, tension=False))[-1]
        assert_array_equal(last.parameters, [1.0e4, 0.0])
        assert_allclose(last.std, [1.0e4, 100.0])
        assert set(last.status.tolist()) == {ParameterStatus.APART}


def test_every_method_is_tested_here_or_in_a_file_of_its_own():
    # a bank of gauss_newton, in test_gauss_newton.py, and masses in place of stiffness, in test_effective_mass.py
    assert set(METHODS) - set(EXACT) == {"gauss_newton_orders", "effective_mass"}


def test_unknown_methods_and_settings_name_the_nearest():
    test = oscillator_recording().test
    with pytest.raises(ModelError, match="did you mean 'mrls'"):
        make_estimator(oscillator(), test, "mrsl")
    with pytest.raises(ModelError, match="did you mean 'forgetting'"):
        make_estimator(oscillator(), test, "rls", forgeting=0.9)
