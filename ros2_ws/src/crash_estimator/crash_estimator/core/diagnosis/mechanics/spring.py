"""A link's spring and its contact along a motion (compiled): what of its force needs no effect's own code.

One pass over the instants in the place of some thirty over arrays, which every iteration of every fit would make.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from ... import compile_cache as _compile_cache  # noqa: F401  before any compiled function is defined

NO_CURVE = np.zeros(0), np.zeros(0), np.zeros(0, np.int64)
NARROWEST = 1e-9
"""m: of the ramp over which a contact opens and closes."""


class Law(NamedTuple):
    """What the spring's force hangs on, at one parameter vector."""

    gap: float  # m
    play: bool  # as large a gap to the other side, too
    unloads: bool  # on a line of its own
    slope: float  # N/m of that line
    knots: np.ndarray  # (n,) m; none: linear
    forces: np.ndarray  # (n,) N
    columns: np.ndarray  # (n,) parameters of the forces, -1: none
    stiffness: float  # N/m where it is linear
    one_way: bool  # it carries compression only


class Spring(NamedTuple):
    """Over g instants."""

    x: np.ndarray  # (g,) m, crush less the gap
    peak: np.ndarray  # (g,) m
    loading: np.ndarray  # (g,) bool, at a new peak
    on_line: np.ndarray  # (g,) bool, on the unloading line
    at: np.ndarray  # (g,) m, where on the curve the force is read
    static: np.ndarray  # (g,) N, 0 where it does not carry
    kx: np.ndarray  # (g,) N/m, by the crush
    kp: np.ndarray  # (g,) N/m, by the peak, also where it does not carry
    knot: np.ndarray  # (g, 2) parameters in use, -1: none
    weight: np.ndarray  # (g, 2), by those, also where it does not carry
    carries: np.ndarray  # (g,) 1 or 0
    gate: np.ndarray  # (g,) share of the time step in which it is in contact
    gate_slope: np.ndarray  # (g,) 1/m
    crushed: np.ndarray  # (g,) share of the time step in which there is crush, whether the spring is spent or not
    crushed_slope: np.ndarray  # (g,) 1/m


@njit(cache=True, error_model="numpy")
def spring(law, crush, rate, dt, more, more_slope):
    """The equations of `link_force` for crush (g,) m, rate (g,) m/s and the length of each step dt (g,) s.

    more, more_slope: (g,) N and N/m by which the curve is higher and steeper where it is read; or empty.
    """
    gap, play, unloads, slope, knots, forces, columns, stiffness, one_way = law
    g, last = len(crush), len(knots) - 2
    x, peak, at, static = np.empty(g), np.empty(g), np.empty(g), np.empty(g)
    kx, kp = np.empty(g), np.empty(g)
    loading, on_line = np.empty(g, np.bool_), np.empty(g, np.bool_)
    knot, weight = np.full((g, 2), -1), np.zeros((g, 2))
    carries, gate, gate_slope = np.ones(g), np.ones(g), np.zeros(g)
    crushed, crushed_slope = np.ones(g), np.zeros(g)
    highest, cell = 0.0, 0
    for t in range(g):
        x[t] = crush[t] - (min(max(crush[t], -gap), gap) if play else gap)
        highest = max(highest, x[t])
        peak[t] = highest
        loading[t] = x[t] >= highest
        on_line[t] = unloads and not loading[t]
        at[t] = highest if on_line[t] else x[t]
        if last >= 0:
            while cell < last and at[t] >= knots[cell + 1]:
                cell += 1
            while cell > 0 and at[t] < knots[cell]:
                cell -= 1
            width = knots[cell + 1] - knots[cell]
            right = (at[t] - knots[cell]) / width
            k = (forces[cell + 1] - forces[cell]) / width
            static[t] = forces[cell] + right * (forces[cell + 1] - forces[cell])
            knot[t, 0], knot[t, 1] = columns[cell], columns[cell + 1]
            weight[t, 0], weight[t, 1] = 1.0 - right, right
        else:
            k = stiffness
            static[t] = k * at[t]
        if len(more):
            static[t] += more[t]
            k += more_slope[t]
        kx[t], kp[t] = k, 0.0
        if on_line[t]:
            static[t] -= slope * (highest - x[t])
            kx[t], kp[t] = slope, k - slope
        if one_way:
            margin = x[t]
            spent = on_line[t] and static[t] <= 0.0
            if on_line[t]:
                margin = min(margin, static[t] / max(slope, 1.0))
            carries[t] = 1.0 if x[t] > 0.0 and not spent else 0.0
            width = max(abs(rate[t]) * dt[t], NARROWEST)
            gate[t], gate_slope[t] = _opened(margin, width)
            crushed[t], crushed_slope[t] = _opened(x[t], width)
        elif play:
            margin, width = abs(crush[t]) - gap, max(abs(rate[t]) * dt[t], NARROWEST)
            carries[t] = 1.0 if margin > 0.0 else 0.0
            gate[t], gate_slope[t] = _opened(margin, width)
            gate_slope[t] = np.sign(crush[t]) * gate_slope[t]
            crushed[t], crushed_slope[t] = gate[t], gate_slope[t]
        static[t] *= carries[t]
        kx[t] *= carries[t]
    if one_way and x[0] >= 0.0 and rate[0] > 0.0:
        gate[0] = crushed[0] = 1.0  # touching at time zero: it carries from then on
    return (
        x, peak, loading, on_line, at, static, kx, kp, knot, weight, carries, gate, gate_slope, crushed, crushed_slope,
    )  # fmt: skip


@njit(cache=True, error_model="numpy", inline="always")
def _opened(margin, width):
    """Share of the time step in which a contact is open by its margin, and its change with the crush, 1/m."""
    ramp = margin / width + 0.5
    return min(max(ramp, 0.0), 1.0), 1.0 / width if 0.0 < ramp < 1.0 else 0.0
