"""Sigmas that hold: the true constant parameters lie within 1.96 sigma in 92 to 98 % of noisy repetitions."""

from dataclasses import replace

import numpy as np
import pytest
from helpers_estimation import oscillator, oscillator_recording
from test_gauss_newton import coloured

from crash_estimator.core.fold import run
from crash_estimator.core.methods import make_estimator
from crash_estimator.core.structure import Coefficient
from crash_replay.recording import Recording

TRUE = np.array([2.0e4, 50.0])
NOISE = 5.0
LATE = (200, 300, 399)
"""Samples looked at: 20, 30 and 40 ms; with the memories of 5 ms their errors have little in common."""
SOONER = (120, 170, 219)
"""Of the methods that are not compiled, whose every sample takes a millisecond."""

CASES = {  # method, its settings, repetitions, colour of the noise (d, a)
    "rls": ("rls", {}, 200, None),
    "rls that forgets nothing": ("rls", {"forgetting": 1.0}, 400, None),
    "mrls": ("mrls", {}, 200, None),
    "mrls of table 5.2": ("mrls", {"memory": 0.01, "error_limit": 1.0, "step_limit": 0.5}, 300, None),
    "mrls that goes back at one sigma": ("mrls", {"error_limit": 1.0}, 300, None),
    "kalman": ("kalman", {}, 400, None),
    "constrained_kalman": ("constrained_kalman", {}, 400, None),
    "gauss_newton": ("gauss_newton", {"p": 1, "q": 1, "forgetting": 1.0, "noise_memory": 1e3}, 60, ([-0.6], [0.3])),
    "gauss_newton that forgets": ("gauss_newton", {"p": 1, "q": 1, "memory": 0.03}, 60, ([-0.6], [0.3])),
    "afmm": ("afmm", {}, 60, None),
}


@pytest.mark.parametrize("case", CASES)
def test_the_truth_lies_within_the_stated_sigmas(case):
    method, settings, repetitions, colour = CASES[case]
    inside = np.abs(standardised_errors(method, settings, repetitions, colour)) < 1.96
    # stiffness and damping, and the errors at different times, go together: count the repetitions, not the draws
    wobble = 2.0 * inside.mean(axis=(1, 2)).std() / np.sqrt(repetitions)
    print(f"{case}: {inside.mean():.1%} +- {wobble:.1%} of {inside.size} within 1.96 sigma")
    assert 0.92 - wobble <= inside.mean() <= 0.98 + wobble


def standardised_errors(method, settings, repetitions, colour):
    """(repetitions, times, parameters) errors over their stated sigmas; the noise's variance is known."""
    structure = oscillator(Coefficient(1.0e4, True, std=1.0e5, drift=0.0), Coefficient(0.0, True, std=1.0e3))
    structure = replace(structure, bodies=(replace(structure.bodies[0], noise=NOISE), structure.bodies[1]))
    late = SOONER if method in ("gauss_newton", "afmm") else LATE
    exact, errors = oscillator_recording(n=late[-1] + 1, pre=0), []
    for seed in range(repetitions):
        recording = coloured(exact, *(colour or ([], [])), sd=NOISE, seed=seed)
        estimator = make_estimator(structure, recording.test, method, **settings)
        value, std = followed(estimator, recording, late)
        errors.append((value - TRUE) / std)
    return np.array(errors)


def followed(estimator, recording: Recording, late: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Parameters and their sigmas at the samples looked at."""
    if hasattr(estimator, "follow"):
        _, rows = estimator.follow(estimator.init(), recording.time_ns, recording.values)
        return tuple(rows[list(late), estimator.columns[field]] for field in ("parameters", "std"))
    estimates = run(estimator, recording.samples())
    return np.array([estimates[k].parameters for k in late]), np.array([estimates[k].std for k in late])
