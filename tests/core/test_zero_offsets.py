"""The errors of the zero offsets, estimated with theta: batch least squares of both, and sigmas that hold for it."""

from dataclasses import replace

import numpy as np
import pytest
from helpers_estimation import oscillator, oscillator_recording
from numpy.testing import assert_allclose

from crash_estimator.core.fold import run
from crash_estimator.core.kinematics import RECORD
from crash_estimator.core.methods import make_estimator
from crash_estimator.core.structure import Coefficient
from crash_estimator.model_file import load_model
from crash_replay.synthetic.recordings import SCENARIOS

PRE, NOISE = 50, 2.0
STD = np.array([1.0e4, 300.0])


@pytest.mark.parametrize("compiled", [True, False])
def test_stiffness_damping_and_offset_are_those_of_batch_least_squares(compiled):
    """Crush and rate are measured, so that y = -(K X + C V) / M + b is linear in all three; b ~ N(0, known)."""
    recording = oscillator_recording(noise=NOISE, pre=PRE, n=300, seed=4)
    structure = oscillator(Coefficient(1.5e4, True, std=STD[0], drift=0.0), Coefficient(0.0, True, std=STD[1]))
    structure = replace(structure, bodies=(replace(structure.bodies[0], noise=NOISE), structure.bodies[1]))
    settings = {"noise_memory": 0, "compiled": compiled}
    estimator = make_estimator(structure, recording.test, "constrained_kalman", **settings)
    last = run(estimator, recording.samples())[-1]

    acceleration, crush, rate = recording.values.T
    before, after = recording.time_ns < 0, recording.time_ns > 0
    zero = acceleration[before].mean()
    running = np.cumsum(acceleration[before]) / np.arange(1, PRE + 1)
    variance = np.mean((acceleration[before] - running) ** 2) * (1.0 / PRE + recording.sample_period / RECORD)
    gradient = np.column_stack([-crush[after] / 10.0, -rate[after] / 10.0, np.ones(after.sum())])
    precision = gradient.T @ gradient / NOISE**2 + np.diag(1.0 / np.append(STD**2, variance))
    start = np.array([1.5e4, 0.0, 0.0])
    pull = gradient.T @ (acceleration[after] - zero - gradient @ start) / NOISE**2
    expected, covariance = start + np.linalg.solve(precision, pull), np.linalg.inv(precision)
    # the filter allows the zero more than its own error, for what the noise moves; here nothing is integrated
    by_zero = covariance[:, 2] / variance
    surplus = np.mean((acceleration[before] - running) ** 2) * recording.sample_period / RECORD
    covariance = covariance - surplus * np.outer(by_zero, by_zero)
    assert_allclose(last.parameters, expected[:2], rtol=1e-8, atol=1e-6)
    assert_allclose(last.covariance, covariance[:2, :2], rtol=1e-6, atol=1e-9)
    assert_allclose(last.predicted, gradient[-1] @ expected, rtol=1e-8)


def test_the_dummy_s_stiffnesses_lie_within_their_sigmas():
    """Crush integrated from wrong zeros: within 1.96 sigma for 90 % of the loaded time, estimated or only counted."""
    structure = load_model("side_dummy")
    inside = {offsets: [] for offsets in (True, False)}
    for seed in range(20, 26):
        recording, truth = SCENARIOS["side_dummy_unpadded"](seed)
        for offsets, shares in inside.items():
            estimator = make_estimator(structure, recording.test, "constrained_kalman", offsets=offsets)
            shares.append(share_inside(truth, estimator, recording, end=0.06))
    assert np.mean(inside[True]) > 0.9 and np.mean(inside[False]) > 0.9


def share_inside(truth, estimator, recording, end: float) -> float:
    """Of all times in contact, beyond 5 mm of crush and loading: the true secant stiffness within 1.96 sigma."""
    description, found = estimator.description, []
    for n, estimate in enumerate(run(estimator, recording.samples())):
        if not 0.01 < recording.time[n] <= end:
            continue
        for k, element in enumerate(description.elements):
            j = description.parameters.index(f"{element}.stiffness")
            if estimate.status[j] == 0 and abs(estimate.crush[k]) > 0.005:
                error = estimate.parameters[j] - truth.elements[element].secant[n]
                found.append(abs(error) < 1.96 * estimate.std[j])
    return float(np.mean(found))
