"""Sensitivities of a free-run simulation, by one pass along a trajectory (compiled).

A small change of the parameters moves the bodies by xi, which obeys the linear equations

    M_k xi''_k = sum over links of -+ (kx xi_X + kv xi_V + kp xi_peak + sum of dF/dz xi_z + dF/dtheta) + external,

along the trajectory about which the forces were linearised. Each column is one parameter; column 0 is driven by the
defect, by which the trajectory itself misses the equations of motion: one that is no simulation yet (the measured
motion, to begin with) is corrected to first order. Time steps follow `kinematics`: the acceleration is a straight line
within a step (Newmark, beta 1/6, gamma 1/2). Loops go through whole arrays by index, and what is called in every step
is put in its place (inline): slices, and NamedTuples handed on, would cost more than the arithmetic.
"""

import numpy as np
from numba import njit

from ... import compile_cache as _compile_cache  # noqa: F401  before any compiled function is defined
from ..parameterization.layout import DRIVEN, FIXED, FREE

WIDTH = 16
"""Columns that a compiled loop takes at a time."""


@njit(cache=True)
def _whole(columns):
    """So many columns that no loop over them ends in single steps."""
    return (columns + WIDTH - 1) // WIDTH * WIDTH


@njit(cache=True, fastmath=True, error_model="numpy")
def propagate(system, sampling, out):
    """Fill out (bins, q, columns); system: a `linear_system.Linear`, sampling: its `Sampling`."""
    (
        steps, ends, crush_ends, inverse_mass, kind, kx, kv, kp, loading, knot, weight,
        changed, start, observer, others, column, body, acts, remembers, kept, by_crush, by_before, recalled, touched,
    ) = system  # fmt: skip
    b, links, columns = len(kind), len(ends), _whole(others + touched[-1])
    x, v, a = np.zeros((b, columns)), np.zeros((b, columns)), np.zeros((b, columns))
    peak, row = np.zeros((links, columns)), np.zeros((b, columns))
    memory = np.zeros((len(remembers), columns))
    measured = False
    for k in range(b):
        measured |= kind[k] == FIXED and inverse_mass[k] > 0.0
    v[:, :others], x[:, :others] = start[0], start[1]
    matrix, inverse = np.zeros((b, b)), np.zeros((b, b))
    first, second = 2.0 * observer, observer**2
    for t in range(len(steps)):
        dt = steps[t]
        half, sixth = dt / 2.0, dt * dt / 6.0
        active = _whole(others + touched[t])
        for m in range(len(remembers)):  # before the bodies move: what is kept, less the crush that it starts from
            near, far = crush_ends[remembers[m], 0], crush_ends[remembers[m], 1]
            for j in range(active):
                memory[m, j] *= kept[m, t]
            if near >= 0:
                for j in range(active):
                    memory[m, j] -= by_before[m, t] * (x[near, j] - x[far, j])
        for k in range(b):
            for j in range(active):
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
                for j in range(active):
                    x[k, j] += dt * v[k, j] + 2.0 * sixth * a[k, j]
                    v[k, j] += half * a[k, j]
                if observer > 0.0:
                    for j in range(active):
                        row[k, j] -= second * x[k, j] + first * v[k, j]
        _push(FREE, t, others, active, ends, crush_ends, inverse_mass, kind, kx, kv, kp, knot, weight, x, v, peak, row)
        _recall(FREE, t, active, ends, inverse_mass, kind, remembers, recalled, memory, row)
        if changed[t]:
            _implicit(t, half, sixth, observer, ends, crush_ends, inverse_mass, kind, kx, kv, matrix, inverse)
        for k in range(b):
            if kind[k] == FREE:
                own = inverse[k, k]
                for j in range(active):
                    a[k, j] = own * row[k, j]
                for m in range(b):
                    if m != k and inverse[k, m] != 0.0:
                        scale = inverse[k, m]
                        for j in range(active):
                            a[k, j] += scale * row[m, j]
        for k in range(b):
            if kind[k] == FREE:
                for j in range(active):
                    x[k, j] += sixth * a[k, j]
                    v[k, j] += half * a[k, j]
                    row[k, j] = a[k, j]
                if observer > 0.0:  # the forces' share, without the observer
                    for j in range(active):
                        row[k, j] += second * x[k, j] + first * v[k, j]
        for link in range(links):
            near, far = crush_ends[link, 0], crush_ends[link, 1]
            if loading[link, t] and near >= 0:
                for j in range(active):
                    peak[link, j] = x[near, j] - x[far, j]
        if measured:
            _push(
                FIXED, t, others, active, ends, crush_ends, inverse_mass, kind, kx, kv, kp, knot, weight,
                x, v, peak, row,
            )  # fmt: skip
            _recall(FIXED, t, active, ends, inverse_mass, kind, remembers, recalled, memory, row)
        for m in range(len(remembers)):
            near, far = crush_ends[remembers[m], 0], crush_ends[remembers[m], 1]
            if near >= 0:
                for j in range(active):
                    memory[m, j] += by_crush[m, t] * (x[near, j] - x[far, j])
        _sample(sampling, t, active, row, v, x, out)


@njit(cache=True, fastmath=True, error_model="numpy", inline="always")
def _push(onto, t, others, active, ends, crush_ends, inverse_mass, kind, kxs, kvs, kps, knot, weight, x, v, peak, row):
    """Add what the links' forces change by to the rows of the bodies of one kind."""
    for link in range(len(ends)):
        kx, kv, kp = kxs[link, t], kvs[link, t], kps[link, t]
        near, far = crush_ends[link, 0], crush_ends[link, 1]
        for side in range(2):
            k = ends[link, side]
            if kind[k] != onto:
                continue
            share = inverse_mass[k] if side else -inverse_mass[k]
            by_x, by_v, by_peak = share * kx, share * kv, share * kp
            if near >= 0:
                if by_x != 0.0:
                    for j in range(active):
                        row[k, j] += by_x * (x[near, j] - x[far, j])
                if by_v != 0.0:
                    for j in range(active):
                        row[k, j] += by_v * (v[near, j] - v[far, j])
                if by_peak != 0.0:
                    for j in range(active):
                        row[k, j] += by_peak * peak[link, j]
            for end in range(2):
                if knot[link, t, end] >= 0:
                    row[k, others + knot[link, t, end]] += share * weight[link, t, end]


@njit(cache=True, fastmath=True, error_model="numpy", inline="always")
def _recall(onto, t, active, ends, inverse_mass, kind, remembers, recalled, memory, row):
    """Add what the remembered part of the links' forces changes by, but for this step's own crush, which is in kx."""
    for m in range(len(remembers)):
        for side in range(2):
            k = ends[remembers[m], side]
            if kind[k] == onto:
                scale = recalled[m, t] * (inverse_mass[k] if side else -inverse_mass[k])
                for j in range(active):
                    row[k, j] += scale * memory[m, j]


@njit(cache=True, error_model="numpy")
def respond(system, change):
    """What propagate's columns add up to, each times its change (columns,), as the bodies' accelerations (g, b).

    One column needs no loops over columns, and so a fourth of the time.
    """
    (
        steps, ends, crush_ends, inverse_mass, kind, kx, kv, kp, loading, knot, weight,
        changed, start, observer, others, column, body, acts, remembers, kept, by_crush, by_before, recalled, _,
    ) = system  # fmt: skip
    b, links = len(kind), len(ends)
    x, v, a, row, peak = np.zeros(b), np.zeros(b), np.zeros(b), np.zeros(b), np.zeros(links)
    memory = np.zeros(len(remembers))
    for k in range(b):
        v[k], x[k] = (start[0, k] * change[:others]).sum(), (start[1, k] * change[:others]).sum()
    matrix, inverse = np.zeros((b, b)), np.zeros((b, b))
    first, second = 2.0 * observer, observer**2
    rows, found = np.zeros((len(steps), b)), np.zeros((len(steps), b))
    for i in range(len(acts)):
        share = change[column[i]]
        if share != 0.0:
            for t in range(len(steps)):
                rows[t, body[i]] += share * acts[i, t]
    for t in range(len(steps)):
        dt = steps[t]
        half, sixth = dt / 2.0, dt * dt / 6.0
        for m in range(len(remembers)):
            near, far = crush_ends[remembers[m], 0], crush_ends[remembers[m], 1]
            memory[m] = kept[m, t] * memory[m] - (by_before[m, t] * (x[near] - x[far]) if near >= 0 else 0.0)
        for k in range(b):
            row[k] = rows[t, k]
            if kind[k] == DRIVEN:
                x[k] += dt * v[k] + sixth * (2.0 * a[k] + row[k])
                v[k] += half * (a[k] + row[k])
                a[k] = row[k]
            if kind[k] == FREE:
                x[k] += dt * v[k] + 2.0 * sixth * a[k]
                v[k] += half * a[k]
                row[k] -= second * x[k] + first * v[k]
        for link in range(links):
            near, far = crush_ends[link, 0], crush_ends[link, 1]
            force = 0.0
            if near >= 0:
                force = kx[link, t] * (x[near] - x[far]) + kv[link, t] * (v[near] - v[far]) + kp[link, t] * peak[link]
            for end in range(2):
                if knot[link, t, end] >= 0:
                    force += weight[link, t, end] * change[others + knot[link, t, end]]
            row[ends[link, 0]] -= inverse_mass[ends[link, 0]] * force
            row[ends[link, 1]] += inverse_mass[ends[link, 1]] * force
        for m in range(len(remembers)):
            force = recalled[m, t] * memory[m]
            row[ends[remembers[m], 0]] -= inverse_mass[ends[remembers[m], 0]] * force
            row[ends[remembers[m], 1]] += inverse_mass[ends[remembers[m], 1]] * force
        if changed[t]:
            _implicit(t, half, sixth, observer, ends, crush_ends, inverse_mass, kind, kx, kv, matrix, inverse)
        for k in range(b):
            if kind[k] == FREE:
                a[k] = 0.0
                for m in range(b):
                    if kind[m] == FREE:
                        a[k] += inverse[k, m] * row[m]
        for k in range(b):
            if kind[k] == FREE:
                x[k] += sixth * a[k]
                v[k] += half * a[k]
            found[t, k] = a[k]
        for link in range(links):
            near, far = crush_ends[link, 0], crush_ends[link, 1]
            if loading[link, t] and near >= 0:
                peak[link] = x[near] - x[far]
        for m in range(len(remembers)):
            near, far = crush_ends[remembers[m], 0], crush_ends[remembers[m], 1]
            if near >= 0:
                memory[m] += by_crush[m, t] * (x[near] - x[far])
    return found


@njit(cache=True, error_model="numpy", inline="always")
def _implicit(t, half, sixth, observer, ends, crush_ends, inverse_mass, kind, kx, kv, matrix, inverse):
    """Inverse of I - dt^2/6 A_x - dt/2 A_v: what the end of a step feeds back into its own acceleration.

    Bodies that are not free stand apart in it.
    """
    n = len(matrix)
    for i in range(n):
        for j in range(n):
            matrix[i, j] = 0.0
            inverse[i, j] = 0.0
        matrix[i, i] = 1.0 + sixth * observer**2 + half * 2.0 * observer
        inverse[i, i] = 1.0
    for link in range(len(ends)):
        near, far = crush_ends[link, 0], crush_ends[link, 1]
        if near < 0:
            continue
        stiffness = sixth * kx[link, t] + half * kv[link, t]
        for side in range(2):
            k = ends[link, side]
            if kind[k] != FREE:
                continue
            share = stiffness * inverse_mass[k] * (-1.0 if side == 0 else 1.0)
            if kind[near] == FREE:
                matrix[k, near] -= share
            if kind[far] == FREE:
                matrix[k, far] += share
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


@njit(cache=True, fastmath=True, error_model="numpy", inline="always")
def _sample(sampling, t, active, row, v, x, out):
    """Add this instant's rows to the bins of the samples that see it, each output with its own lag."""
    body, of_motion, gain, lag, fraction, bins, weight = sampling
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
            shown = row if of_motion[q] == 0 else v if of_motion[q] == 1 else x
            for j in range(min(active, out.shape[2])):
                out[to, q, j] += scale * shown[of, j]
