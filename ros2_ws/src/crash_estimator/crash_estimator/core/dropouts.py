"""Samples in which a channel is dead: one number that does not change, come to by a jump, and left by one or never."""

import numpy as np

from .clipping import CHANCE, FEWEST, RUN, STEPS, chance_of_run, runs_of
from .differences import by_differences


def dropouts(values: np.ndarray) -> np.ndarray:
    """(n,) bool: which of values (n,), NaN where not valid, are of a run of one number that noise would not leave.

    What comes to rest, or is at rest, does so without a jump: of one that is never left, more than what is usual just
    before it.
    """
    found = np.zeros(len(values), dtype=bool)
    for start, stop in runs_of(np.diff(values) == 0.0):  # of n + 1 samples n differences are 0
        if start == 0 or stop - start < RUN:
            continue
        last = stop + 1 == len(values)
        noise, step = _noise_and_step(values[:start] if last else values)
        usual = np.abs(np.diff(values[max(start - RUN, 0) : start])).max(initial=0.0) if last else 0.0
        jumps = np.abs([values[start] - values[start - 1], np.inf if last else values[stop + 1] - values[stop]])
        sudden = jumps.min() > STEPS * max(noise, step, usual)
        if sudden and chance_of_run(int(stop - start), len(values), noise / step) < CHANCE:
            found[start : stop + 1] = True
    return found


def _noise_and_step(values: np.ndarray) -> tuple[float, float]:
    """Standard deviation of the noise, and the least difference of two numbers; inf where too few are valid."""
    valid = values[np.isfinite(values)]
    if len(valid) < FEWEST:
        return np.inf, np.inf
    return by_differences(valid), float(np.diff(np.unique(valid)).min(initial=np.inf))
