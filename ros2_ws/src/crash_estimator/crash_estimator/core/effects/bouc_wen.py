"""The memory of a Bouc-Wen spring along a way (compiled); the equations are those of `hysteresis.py`."""

import numpy as np
from numba import njit

from .. import compile_cache as _compile_cache  # noqa: F401  before any compiled function is defined

LONGEST = 0.1
"""Of the yield crush, in one step of the midpoint rule: its error is then below 1e-3 of c."""

FAR = 25.0
"""Yield crushes, of one step: after so many it has yielded whatever it was, to e^-25."""

SMALL = 1e-6
"""Of z, and of the yield crush: step of the one-sided differences."""


@njit(cache=True)
def _advanced(z, turns, exponent, back):
    """z after a crush of `turns` yield crushes; NaN where a motion without bounds has none."""
    if not abs(turns) < FAR:
        return np.sign(turns)
    steps = int(np.ceil(abs(turns) / LONGEST))
    for _ in range(steps):
        h = turns / steps
        middle = z + 0.5 * h * _slope(z, h, exponent, back)
        z += h * _slope(middle, h, exponent, back)
    return min(max(z, -1.0), 1.0)


@njit(cache=True)
def _slope(z, h, exponent, back):
    return 1.0 - abs(z) ** exponent if z * h > 0.0 else 1.0 + back * abs(z) ** exponent


@njit(cache=True)
def trace(crush, start, yield_crush, exponent, back):
    g = len(crush)
    z, by_z, by_crush = np.empty(g), np.ones(g), np.zeros(g)
    z[0] = start
    for t in range(1, g):
        turns = (crush[t] - crush[t - 1]) / yield_crush
        way = 1.0 if turns >= 0.0 else -1.0
        z[t] = _advanced(z[t - 1], turns, exponent, back)
        by_z[t] = (_advanced(z[t - 1] + SMALL, turns, exponent, back) - z[t]) / SMALL
        by_crush[t] = (_advanced(z[t - 1], turns + way * SMALL, exponent, back) - z[t]) / (way * SMALL * yield_crush)
    return z, by_z, by_crush
