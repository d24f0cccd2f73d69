"""The overpressure of a gas that is pressed and leaves (compiled); the equations are those of `gas_cushion.py`."""

import numpy as np
from numba import njit

from .. import compile_cache as _compile_cache  # noqa: F401  before any compiled function is defined

LEAST = 0.02
"""Share of its length that a cushion keeps: no crush is to make its force infinite."""

SLIGHT = 1e-5
"""Overpressure from which on the flow goes with its root; below, as through any hole, with itself. With 1e-3 the
coefficients of five looked-at cushions in quiet sensors were 3 to 12 sigmas too small, with this 3 at most."""

MOST_PARTS = 50
"""Of a step: as many as the fastest flow asks for, 300 1/s in steps of 0.25 ms."""


@njit(cache=True)
def _room(crush, length):
    """Share of its length that a crush leaves of the cushion, and its derivative by the crush."""
    left = 1.0 - max(crush, 0.0) / length
    return (left, -1.0 / length if crush > 0.0 else 0.0) if left > LEAST else (LEAST, 0.0)


@njit(cache=True)
def _flow(y, leak):
    """What leaves, in 1/s, and its derivative by y."""
    root = np.sqrt(y + SLIGHT)
    return leak * y / root, leak * (0.5 * y + SLIGHT) / root**3


@njit(cache=True)
def _pressed(gas, room, exponent):
    """The overpressure y of gas in a room, and its derivative by gas / room."""
    dense = max(gas, 0.0) / room
    y = dense**exponent - 1.0
    return (y, exponent * (y + 1.0) / dense) if y > 0.0 else (0.0, 0.0)


@njit(cache=True)
def _in_one(y, before, now, step, length, leak, exponent):
    """y after a short step from one crush to another (midpoint rule), and its derivatives by y, `now` and `before`."""
    (first, by_before), (last, by_now) = _room(before, length), _room(now, length)
    dense = (1.0 + y) ** (1.0 / exponent)
    gas, gas_by_y = first * dense, first * dense / (exponent * (1.0 + y))
    flow, flow_by_y = _flow(y, leak)
    half, half_by_y = gas - 0.5 * step * flow, gas_by_y - 0.5 * step * flow_by_y
    between = 0.5 * (first + last)
    middle, steep = _pressed(half, between, exponent)
    flow, slope = _flow(middle, leak)
    slope *= step * steep / between  # of what leaves, by the gas half-way
    narrower = 0.5 * slope * half / between
    gas, gas_by_y = gas - step * flow, gas_by_y - slope * half_by_y
    y, steep = _pressed(gas, last, exponent)
    steep /= last
    by_first, by_last = steep * (dense - slope * dense + narrower), steep * (narrower - gas / last)
    return y, steep * gas_by_y, by_last * by_now, by_first * by_before


@njit(cache=True)
def _advanced(y, before, now, step, length, leak, exponent):
    """The same of any step, in parts, in none of which what is slightly pressed would lose more than it has."""
    most = step * leak * exponent / _room(max(before, now), length)[0] * _flow(y, 1.0)[1]
    parts = 1 if y <= 0.0 and now <= before else min(1 + int(most), MOST_PARTS)
    by_y, by_now, by_before = 1.0, 0.0, 0.0
    for k in range(parts):
        first, last = k / parts, (k + 1) / parts
        ends = before + first * (now - before), before + last * (now - before)
        y, kept, by_last, by_first = _in_one(y, ends[0], ends[1], step / parts, length, leak, exponent)
        by_now = kept * by_now + by_first * first + by_last * last
        by_before = kept * by_before + by_first * (1.0 - first) + by_last * (1.0 - last)
        by_y *= kept
    return y, by_y, by_now, by_before


@njit(cache=True)
def trace(step, crush, start, length, leak, exponent):
    """y (g,), dy_t/dy_{t-1}, dy_t/dX_t and - dy_t/dX_{t-1}."""
    g = len(crush)
    y, by_y, by_crush, by_before = np.empty(g), np.ones(g), np.zeros(g), np.zeros(g)
    y[0] = start
    for t in range(1, g):
        if step[t] <= 0.0:  # as it was held before
            y[t] = y[t - 1]
            continue
        between = crush[t - 1], crush[t]
        y[t], by_y[t], by_crush[t], before = _advanced(y[t - 1], *between, step[t], length, leak, exponent)
        by_before[t] = -before
    return y, by_y, by_crush, by_before
