"""The memory of a Bouc-Wen spring along a way (compiled); the equations are those of `hysteresis.py`."""

import numpy as np
from numba import njit

from .. import compile_cache as _compile_cache  # noqa: F401  before any compiled function is defined

LONGEST = 0.1
"""Of the yield crush, in one step of the midpoint rule: its error is then below 1e-3 of c."""

FAR = 25.0
"""Yield crushes, of one step: after so many it has yielded whatever it was, to e^-25."""


@njit(cache=True)
def _advanced(z, turns, exponent, back):
    """z after a crush of `turns` yield crushes, and its derivatives by the z before and by the turns.

    NaN where a motion without bounds has none.
    """
    if not abs(turns) < FAR:
        return np.sign(turns), 0.0, 0.0
    steps = int(np.ceil(abs(turns) / LONGEST))
    if steps == 0:
        return z, 1.0, _slope(z, 1.0, exponent, back)[0]
    h = turns / steps
    by_z, by_h = 1.0, 0.0
    for _ in range(steps):
        first, first_by_z = _slope(z, h, exponent, back)
        second, second_by_z = _slope(z + 0.5 * h * first, h, exponent, back)
        grown = 1.0 + h * second_by_z * (1.0 + 0.5 * h * first_by_z)
        z += h * second
        by_z, by_h = grown * by_z, grown * by_h + second + 0.5 * h * second_by_z * first
    if abs(z) > 1.0:
        return np.sign(z), 0.0, 0.0
    return z, by_z, by_h / steps


@njit(cache=True)
def _slope(z, h, exponent, back):
    """dz per yield crush, and its derivative by z."""
    power = abs(z) ** exponent
    of_way = -1.0 if z * h > 0.0 else back
    return 1.0 + of_way * power, of_way * exponent * power / z if z != 0.0 else 0.0


@njit(cache=True)
def trace(crush, start, yield_crush, exponent, back):
    g = len(crush)
    z, by_z, by_crush = np.empty(g), np.ones(g), np.zeros(g)
    z[0] = start
    for t in range(1, g):
        turns = (crush[t] - crush[t - 1]) / yield_crush
        z[t], by_z[t], by_turns = _advanced(z[t - 1], turns, exponent, back)
        by_crush[t] = by_turns / yield_crush
    return z, by_z, by_crush
