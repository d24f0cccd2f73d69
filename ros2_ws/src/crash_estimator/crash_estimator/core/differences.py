"""White noise beside a slow motion, by differences that the motion does not reach, and that of a recorder's steps."""

import numpy as np

DIFFERENCE = np.array([1.0, -4.0, 6.0, -4.0, 1.0]) / np.sqrt(70.0)
"""Fourth difference: blind to a cubic, unit gain for white noise."""

NORMAL_MEDIAN = 0.6745
"""Of the magnitude of a normal variable, in standard deviations."""

SMALLEST = 1e-6
"""Share of the largest value that noise is taken to be at least: a simulation without any is divided by it too."""


def by_differences(values: np.ndarray) -> float:
    """Standard deviation of white noise in values (n,), n >= 5, that else move slowly.

    The median: jumps of the force are rare, and must not count as noise.
    """
    return float(np.median(np.abs(np.convolve(values, DIFFERENCE, "valid")))) / NORMAL_MEDIAN


def by_rounding(values: np.ndarray) -> float:
    """Standard deviation of the error of values (n,) that are rounded to steps q, q / sqrt(12) (Bennett 1948).

    q is their least difference: small where nothing is rounded; what is below SMALLEST of the largest value is none."""
    apart = np.diff(np.sort(values))
    steps = apart[apart > SMALLEST * np.abs(values).max(initial=0.0)]
    return float(steps.min(initial=np.inf)) / np.sqrt(12.0) if len(steps) else 0.0
