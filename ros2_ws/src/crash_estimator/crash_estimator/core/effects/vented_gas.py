"""The overpressure of a gas that is pressed and leaves (compiled); the equations are those of `gas_cushion.py`."""

import numpy as np
from numba import njit

from .. import compile_cache as _compile_cache  # noqa: F401  before any compiled function is defined

KAPPA = 1.4
"""Ratio of the specific heats of air."""

LEAST = 0.02
"""Share of its length that a cushion keeps: no crush is to make its force infinite."""

SLIGHT = 1e-3
"""Overpressure from which on the flow goes with its root; below, as through any hole, with itself."""

SMALL, SMALL_CRUSH = 1e-6, 1e-7
"""Of y, and m: steps of the one-sided differences."""


@njit(cache=True)
def _room(crush, length):
    return max(1.0 - max(crush, 0.0) / length, LEAST)


@njit(cache=True)
def _advanced(y, before, now, step, length, leak):
    """y after a step from one crush to another, by the midpoint rule."""
    first, last = _room(before, length), _room(now, length)
    gas = first * (1.0 + y) ** (1.0 / KAPPA)
    half = max(gas - 0.5 * step * leak * y / np.sqrt(y + SLIGHT), 0.0)
    middle = max((half / (0.5 * (first + last))) ** KAPPA - 1.0, 0.0)
    gas = max(gas - step * leak * middle / np.sqrt(middle + SLIGHT), 0.0)
    return max((gas / last) ** KAPPA - 1.0, 0.0)


@njit(cache=True)
def trace(step, crush, start, length, leak):
    """y (g,), dy_t/dy_{t-1}, dy_t/dX_t and - dy_t/dX_{t-1}."""
    g = len(crush)
    y, by_y, by_crush, by_before = np.empty(g), np.ones(g), np.zeros(g), np.zeros(g)
    y[0] = start
    for t in range(1, g):
        h, last, now = step[t], crush[t - 1], crush[t]
        y[t] = _advanced(y[t - 1], last, now, h, length, leak)
        by_y[t] = (_advanced(y[t - 1] + SMALL, last, now, h, length, leak) - y[t]) / SMALL
        by_crush[t] = (_advanced(y[t - 1], last, now + SMALL_CRUSH, h, length, leak) - y[t]) / SMALL_CRUSH
        by_before[t] = -(_advanced(y[t - 1], last + SMALL_CRUSH, now, h, length, leak) - y[t]) / SMALL_CRUSH
    return y, by_y, by_crush, by_before
