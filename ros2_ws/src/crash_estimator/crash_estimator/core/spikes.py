"""Samples that a sensor or its cable has made up: one or two that stand far out of what is around them."""

import numpy as np

WIDEST = 2
"""Samples of a spike."""
SHORTEST = 2.5e-4
"""s: what lasts as long may be the truth; a filter of CFC 1000, as recorders have, passes nothing shorter."""
FARTHER = 10.0
"""Times as far out as everything else that is: of 539 looked-at channels, most of them simulated, what is farthest
out is so by 3.4 times at most, two spikes that were put into them by 32 and 38."""
MOST = 10
"""Spikes of a channel that are looked for; one that has more is no sensor's that has been looked at."""


def spikes(values: np.ndarray, period: float) -> np.ndarray:
    """(n,) bool: which of values (n,), NaN where not valid, are of a spike; period: s between samples."""
    valid = np.flatnonzero(np.isfinite(values))
    found = np.zeros(len(values), dtype=bool)
    around = 2 * WIDEST + 1
    if WIDEST * period > SHORTEST or len(valid) < around * MOST:
        return found
    from scipy.ndimage import median_filter  # late: it takes long to import

    off = np.abs(values[valid] - median_filter(values[valid], around, mode="nearest"))
    farthest, rest = np.empty(MOST), off.copy()
    for place in range(MOST):
        k = int(np.argmax(rest))
        farthest[place] = rest[k]
        rest[max(k - around, 0) : k + around + 1] = 0.0
    apart = np.flatnonzero(farthest[:-1] > FARTHER * farthest[1:])
    if len(apart) and (next_one := farthest[apart[-1] + 1]) > 0.0:
        found[valid] = off > FARTHER * next_one
    return found
