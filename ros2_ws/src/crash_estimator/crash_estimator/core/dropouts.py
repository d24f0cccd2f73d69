"""Samples in which a channel is dead: one number that does not change, come to and left by a jump."""

import numpy as np

from .clipping import CHANCE, FEWEST, RUN, STEPS, chance_of_run, runs_of
from .differences import by_differences


def dropouts(values: np.ndarray) -> np.ndarray:
    """(n,) bool: which of values (n,), NaN where not valid, are of a run of one number that noise would not leave.

    What comes to rest, or is at rest, does so without a jump.
    """
    found = np.zeros(len(values), dtype=bool)
    valid = values[np.isfinite(values)]
    if len(valid) < FEWEST:
        return found
    noise, step = by_differences(valid), np.diff(np.unique(valid)).min(initial=np.inf)
    jump = STEPS * max(noise, step)
    for start, stop in runs_of(np.diff(values) == 0.0):  # of n + 1 samples n differences are 0
        ends = values[[start - 1, start, stop, stop + 1]] if 0 < start and stop + 1 < len(values) else np.zeros(4)
        sudden = min(abs(ends[1] - ends[0]), abs(ends[3] - ends[2])) > jump
        if sudden and stop - start >= RUN and chance_of_run(int(stop - start), len(values), noise / step) < CHANCE:
            found[start : stop + 1] = True
    return found
