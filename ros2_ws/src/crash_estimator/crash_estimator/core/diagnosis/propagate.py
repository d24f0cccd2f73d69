"""Sensitivities of a free-run simulation, by one pass along a trajectory (compiled).

A small change of the parameters moves the bodies by xi, which obeys the linear equations

    M_k xi''_k = sum over links of -+ (kx xi_X + kv xi_V + kp xi_peak + dF/dtheta) + external,

along the trajectory about which the forces were linearised. Every column of the result is one parameter; column
0 is driven by the defect, the amount by which the trajectory itself misses the equations of motion, so that a
trajectory that is not a simulation yet (the measured motion, to begin with) is corrected to first order.
Time steps follow `kinematics`: the acceleration is a straight line within a step (Newmark, beta 1/6, gamma 1/2).

Loops go through whole arrays by index: slices, and NamedTuples handed on, would cost more than the arithmetic.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from .. import compile_cache as _compile_cache  # noqa: F401  before any compiled function is defined


class Linear(NamedTuple):
    """The linearised equations on g instants, for b bodies, l links, and columns before those of the curve knots."""

    dt: np.ndarray  # (g,) s to the instant from the one before; 0 at the first
    ends: np.ndarray  # (l, 2) bodies that the link's force acts on
    crush_ends: np.ndarray  # (l, 2) bodies whose distance is its crush; -1: measured, it does not move
    inverse_mass: np.ndarray  # (b,) 1/kg of a free body, 1 of a fixed one whose force is measured (its row), else 0
    kind: np.ndarray  # (b,) FREE, DRIVEN or FIXED
    kx: np.ndarray  # (g, l) dF/dX
    kv: np.ndarray  # (g, l) dF/dV
    kp: np.ndarray  # (g, l) dF/dX_peak; 0 while the crush is at its peak
    loading: np.ndarray  # (g, l) the crush is at a peak that is felt later
    knot: np.ndarray  # (g, l, 2) numbers of the two curve knots in use; -1: none
    weight: np.ndarray  # (g, l, 2) dF/d(force at that knot)
    pull: float  # 1/s, observer that pulls the free bodies towards the measured motion: -pull^2 xi - 2 pull xi'
    others: int  # columns before those of the knots
    column: np.ndarray  # (m,) of them, in which something acts ...
    body: np.ndarray  # (m,) ... on this body:
    acts: np.ndarray  # (m, g) an external acceleration (free, driven) or force (fixed)


class Sampling(NamedTuple):
    """How body rows become outputs: q outputs, averaged over bins of samples."""

    body: np.ndarray  # (q,)
    gain: np.ndarray  # (q,)
    lag: np.ndarray  # (q,) whole steps of the grid
    fraction: np.ndarray  # (q,) and the rest of a step
    bin: np.ndarray  # (g,) bin of the sample at this instant; -1: no sample here
    weight: np.ndarray  # (g, q) 0 where a sample is not valid, else 1 / (sigma sqrt(samples in the bin))


FREE, DRIVEN, FIXED = 0, 1, 2


@njit(cache=True, fastmath=True, error_model="numpy")
def propagate(system, knots, sampling, out, trace):
    """Fill out (bins, q, columns), and trace (g, b) with the acceleration of column 0 (empty: not wanted)."""
    steps, ends, crush_ends, inverse_mass, kind, kx, kv, kp, loading, knot, weight = system[:11]
    pull, others, column, body, acts = system[11:]
    b, links, columns = len(kind), len(ends), others + knots
    x, v, a = np.zeros((b, columns)), np.zeros((b, columns)), np.zeros((b, columns))
    peak, force = np.zeros((links, columns)), np.zeros(columns)
    row = np.zeros((b, columns))
    number = np.full(b, -1)
    free, measured = 0, False
    for k in range(b):
        if kind[k] == FREE:
            number[k] = free
            free += 1
        measured |= kind[k] == FIXED and inverse_mass[k] > 0.0
    matrix, inverse = np.zeros((free, free)), np.zeros((free, free))
    first, second = 2.0 * pull, pull**2
    for t in range(len(steps)):
        dt = steps[t]
        half, sixth = dt / 2.0, dt * dt / 6.0
        for k in range(b):
            for j in range(columns):
                row[k, j] = 0.0
        for i in range(len(acts)):
            row[body[i], column[i]] += acts[i, t]
        for k in range(b):
            if kind[k] == DRIVEN:  # no force moves it, and so no knot
                for j in range(others):
                    x[k, j] += dt * v[k, j] + sixth * (2.0 * a[k, j] + row[k, j])
                    v[k, j] += half * (a[k, j] + row[k, j])
                    a[k, j] = row[k, j]
            if kind[k] == FREE:
                for j in range(columns):
                    x[k, j] += dt * v[k, j] + 2.0 * sixth * a[k, j]
                    v[k, j] += half * a[k, j]
                    row[k, j] -= second * x[k, j] + first * v[k, j]
        _push(FREE, t, others, ends, crush_ends, inverse_mass, kind, kx, kv, kp, knot, weight, x, v, peak, force, row)
        _implicit(t, half, sixth, pull, ends, crush_ends, inverse_mass, kx, kv, number, matrix, inverse)
        for k in range(b):
            if kind[k] == FREE:
                for j in range(columns):
                    a[k, j] = 0.0
                for m in range(b):
                    if kind[m] == FREE and inverse[number[k], number[m]] != 0.0:
                        scale = inverse[number[k], number[m]]
                        for j in range(columns):
                            a[k, j] += scale * row[m, j]
        for k in range(b):
            if kind[k] == FREE:
                for j in range(columns):
                    x[k, j] += sixth * a[k, j]
                    v[k, j] += half * a[k, j]
                    row[k, j] = a[k, j] + second * x[k, j] + first * v[k, j]  # the forces' share, without the observer
        for link in range(links):
            near, far = crush_ends[link, 0], crush_ends[link, 1]
            if loading[t, link] and near >= 0:
                for j in range(columns):
                    peak[link, j] = x[near, j] - x[far, j]
        if measured:
            _push(
                FIXED, t, others, ends, crush_ends, inverse_mass, kind, kx, kv, kp, knot, weight, x, v, peak, force, row
            )  # fmt: skip
        _sample(sampling, t, row, out)
        if len(trace):
            for k in range(b):
                trace[t, k] = a[k, 0]


@njit(cache=True, fastmath=True, error_model="numpy")
def _push(onto, t, others, ends, crush_ends, inverse_mass, kind, kxs, kvs, kps, knot, weight, x, v, peak, force, row):
    """Add what the links' forces change by to the rows of the bodies of one kind."""
    columns = len(force)
    for link in range(len(ends)):
        one, other = ends[link, 0], ends[link, 1]
        if kind[one] != onto and kind[other] != onto:
            continue
        kx, kv, kp = kxs[t, link], kvs[t, link], kps[t, link]
        near, far = crush_ends[link, 0], crush_ends[link, 1]
        low, high = knot[t, link, 0], knot[t, link, 1]
        if near >= 0 and (kx != 0.0 or kv != 0.0 or kp != 0.0):
            for j in range(columns):
                force[j] = kx * (x[near, j] - x[far, j]) + kv * (v[near, j] - v[far, j]) + kp * peak[link, j]
        elif low >= 0 or high >= 0:
            for j in range(columns):
                force[j] = 0.0
        else:
            continue
        if low >= 0:
            force[others + low] += weight[t, link, 0]
        if high >= 0:
            force[others + high] += weight[t, link, 1]
        if kind[one] == onto:
            for j in range(columns):
                row[one, j] -= inverse_mass[one] * force[j]
        if kind[other] == onto:
            for j in range(columns):
                row[other, j] += inverse_mass[other] * force[j]


@njit(cache=True, error_model="numpy")
def _implicit(t, half, sixth, pull, ends, crush_ends, inverse_mass, kx, kv, number, matrix, inverse):
    """Inverse of I - dt^2/6 A_x - dt/2 A_v: what the end of a step feeds back into its own acceleration."""
    n = len(matrix)
    for i in range(n):
        for j in range(n):
            matrix[i, j] = 0.0
            inverse[i, j] = 0.0
        matrix[i, i] = 1.0 + sixth * pull**2 + half * 2.0 * pull
        inverse[i, i] = 1.0
    for link in range(len(ends)):
        near, far = crush_ends[link, 0], crush_ends[link, 1]
        if near < 0:
            continue
        stiffness = sixth * kx[t, link] + half * kv[t, link]
        for side in range(2):
            k = ends[link, side]
            if number[k] < 0:
                continue
            share = stiffness * inverse_mass[k] * (-1.0 if side == 0 else 1.0)
            if number[near] >= 0:
                matrix[number[k], number[near]] -= share
            if number[far] >= 0:
                matrix[number[k], number[far]] += share
    for i in range(n):  # the matrix is close to I: no pivoting needed
        pivot = 1.0 / matrix[i, i]
        for j in range(n):
            matrix[i, j] *= pivot
            inverse[i, j] *= pivot
        for m in range(n):
            if m != i and matrix[m, i] != 0.0:
                factor = matrix[m, i]
                for j in range(n):
                    matrix[m, j] -= factor * matrix[i, j]
                    inverse[m, j] -= factor * inverse[i, j]


@njit(cache=True, fastmath=True, error_model="numpy")
def _sample(sampling, t, row, out):
    """Add this instant's rows to the bins of the samples that see it, each output with its own lag."""
    body, gain, lag, fraction, bins, weight = sampling
    for q in range(len(body)):
        for part in range(2):
            share = fraction[q] if part else 1.0 - fraction[q]
            at = t + lag[q] + part
            if share == 0.0 or at >= len(bins) or bins[at] < 0:
                continue
            if t == 0 and part == 0 and fraction[q] > 0.0:
                continue  # that sample still shows an instant before the impact
            scale = share * gain[q] * weight[at, q]
            to, of = bins[at], body[q]
            for j in range(row.shape[1]):
                out[to, q, j] += scale * row[of, j]
