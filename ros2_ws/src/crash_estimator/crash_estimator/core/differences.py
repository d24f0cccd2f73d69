"""White noise beside a slow motion, by differences that the motion does not reach."""

import numpy as np

DIFFERENCE = np.array([1.0, -4.0, 6.0, -4.0, 1.0]) / np.sqrt(70.0)
"""Fourth difference: blind to a cubic, unit gain for white noise."""

NORMAL_MEDIAN = 0.6745
"""Of the magnitude of a normal variable, in standard deviations."""


def by_differences(values: np.ndarray) -> float:
    """Standard deviation of white noise in values (n,), n >= 5, that else move slowly.

    The median: jumps of the force are rare, and must not count as noise.
    """
    return float(np.median(np.abs(np.convolve(values, DIFFERENCE, "valid")))) / NORMAL_MEDIAN
