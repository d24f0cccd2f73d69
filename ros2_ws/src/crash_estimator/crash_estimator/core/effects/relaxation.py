"""The way of what follows a crush and relaxes (compiled); the equations are those of `maxwell_element.py`."""

import numpy as np
from numba import njit

from .. import compile_cache as _compile_cache  # noqa: F401  before any compiled function is defined


@njit(cache=True)
def trace(crush, start, kept, by_crush):
    """z (g,) with z_t = kept_t z_{t-1} + by_crush_t (X_t - X_{t-1}), from `start` on."""
    z = np.empty(len(crush))
    z[0] = start
    for t in range(1, len(crush)):
        z[t] = kept[t] * z[t - 1] + by_crush[t] * (crush[t] - crush[t - 1])
    return z
