"""Sensitivities of a free-run simulation, by one pass along a trajectory (compiled).

A small change of the parameters moves the bodies by xi, which obeys the linear equations

    M_k xi''_k = sum over links of -+ (kx xi_X + kv xi_V + kp xi_peak + dF/dtheta) + external,

along the trajectory about which the forces were linearised. Every column of the result is one parameter; column
0 is driven by the defect, the amount by which the trajectory itself misses the equations of motion, so that a
trajectory that is not a simulation yet (the measured motion, to begin with) is corrected to first order.
Time steps follow `kinematics`: the acceleration is a straight line within a step (Newmark, beta 1/6, gamma 1/2).
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from .. import compile_cache as _compile_cache  # noqa: F401  before any compiled function is defined


class Linear(NamedTuple):
    """The linearised equations on g instants, for b bodies, l links and columns of nk curve knots and others."""

    dt: np.ndarray  # (g,) s to the instant from the one before; 0 at the first
    ends: np.ndarray  # (l, 2) bodies that the link's force acts on
    crush_ends: np.ndarray  # (l, 2) bodies whose distance is its crush; -1: measured, it does not move
    inverse_mass: (
        np.ndarray
    )  # (b,) 1/kg for a free body, 1 for a fixed one (its row is the force on it), 0 for a driven one
    kind: np.ndarray  # (b,) FREE, DRIVEN or FIXED
    kx: np.ndarray  # (g, l) dF/dX
    kv: np.ndarray  # (g, l) dF/dV
    kp: np.ndarray  # (g, l) dF/dX_peak
    loading: np.ndarray  # (g, l) the crush is at its peak
    knot: np.ndarray  # (g, l, 2) columns of the two curve knots in use; -1: none
    weight: np.ndarray  # (g, l, 2) dF/d(force at that knot)
    pull: float  # 1/s, observer that pulls the free bodies towards the measured motion: -pull^2 xi - 2 pull xi'
    extra: (
        np.ndarray
    )  # (g, b, 1 + pe) external acceleration (free, driven) or force (fixed) of column 0 and the last pe


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
    g, b, pe = system.extra.shape
    links = len(system.ends)
    columns = knots + pe
    x, v, a = np.zeros((b, columns)), np.zeros((b, columns)), np.zeros((b, columns))
    peak, force = np.zeros((links, columns)), np.zeros(columns)
    row = np.zeros((b, columns))
    number = np.full(b, -1)
    free = 0
    for k in range(b):
        if system.kind[k] == FREE:
            number[k] = free
            free += 1
    matrix, inverse = np.zeros((free, free)), np.zeros((free, free))
    for t in range(g):
        dt = system.dt[t]
        half, sixth = dt / 2.0, dt * dt / 6.0
        for k in range(b):
            xk, vk, ak = x[k], v[k], a[k]
            if system.kind[k] != FIXED:
                for j in range(columns):
                    xk[j] += dt * vk[j] + 2.0 * sixth * ak[j]
                    vk[j] += half * ak[j]
            _external(system.extra[t, k], row[k], knots, pe)
            if system.kind[k] == FREE and system.pull > 0.0:
                rk, first, second = row[k], 2.0 * system.pull, system.pull**2
                for j in range(columns):
                    rk[j] -= second * xk[j] + first * vk[j]
            if system.kind[k] == DRIVEN:
                rk = row[k]
                for j in range(columns):
                    ak[j] = rk[j]
                    xk[j] += sixth * ak[j]
                    vk[j] += half * ak[j]
        for link in range(links):
            _link_force(system, t, link, x, v, peak[link], force)
            for side in range(2):
                k = system.ends[link, side]
                if system.kind[k] == FREE:
                    scale = -system.inverse_mass[k] if side == 0 else system.inverse_mass[k]
                    rk = row[k]
                    for j in range(columns):
                        rk[j] += scale * force[j]
        _implicit(system, t, half, sixth, number, matrix, inverse)
        for k in range(b):
            if system.kind[k] == FREE:
                ak = a[k]
                ak[:] = 0.0
                for m in range(b):
                    if system.kind[m] == FREE and inverse[number[k], number[m]] != 0.0:
                        scale, rm = inverse[number[k], number[m]], row[m]
                        for j in range(columns):
                            ak[j] += scale * rm[j]
        for k in range(b):
            if system.kind[k] == FREE:
                xk, vk, ak, rk = x[k], v[k], a[k], row[k]
                first, second = 2.0 * system.pull, system.pull**2
                for j in range(columns):
                    xk[j] += sixth * ak[j]
                    vk[j] += half * ak[j]
                    rk[j] = ak[j] + second * xk[j] + first * vk[j]  # what the forces give, without the observer
        for link in range(links):
            first, last = system.crush_ends[link, 0], system.crush_ends[link, 1]
            if system.loading[t, link] and first >= 0:
                pl, xa, xb = peak[link], x[first], x[last]
                for j in range(columns):
                    pl[j] = xa[j] - xb[j]
            for side in range(2):
                k = system.ends[link, side]
                if system.kind[k] == FIXED and system.inverse_mass[k] > 0.0:
                    _link_force(system, t, link, x, v, peak[link], force)
                    sign, rk = -1.0 if side == 0 else 1.0, row[k]
                    for j in range(columns):
                        rk[j] += sign * force[j]
        _sample(sampling, t, row, out)
        if len(trace):
            for k in range(b):
                trace[t, k] = a[k, 0]


@njit(cache=True, fastmath=True, error_model="numpy")
def _external(extra, row, knots, pe):
    row[: knots + 1] = 0.0
    row[0] = extra[0]
    for j in range(1, pe):
        row[knots + j] = extra[j]


@njit(cache=True, fastmath=True, error_model="numpy")
def _link_force(system, t, link, x, v, peak, force):
    """Change of the link's force in every column."""
    kx, kv, kp = system.kx[t, link], system.kv[t, link], system.kp[t, link]
    first, last = system.crush_ends[link, 0], system.crush_ends[link, 1]
    if first < 0 or (kx == 0.0 and kv == 0.0 and kp == 0.0):
        force[:] = 0.0
    else:
        xa, xb, va, vb = x[first], x[last], v[first], v[last]
        if system.loading[t, link]:
            kx += kp
            for j in range(len(force)):
                force[j] = kx * (xa[j] - xb[j]) + kv * (va[j] - vb[j])
        else:
            for j in range(len(force)):
                force[j] = kx * (xa[j] - xb[j]) + kv * (va[j] - vb[j]) + kp * peak[j]
    for side in range(2):
        column = system.knot[t, link, side]
        if column >= 0:
            force[column] += system.weight[t, link, side]


@njit(cache=True, error_model="numpy")
def _implicit(system, t, half, sixth, number, matrix, inverse):
    """Inverse of I - dt^2/6 A_x - dt/2 A_v: what the end of a step feeds back into its own acceleration."""
    matrix[:, :] = 0.0
    for i in range(len(matrix)):
        matrix[i, i] = 1.0 + sixth * system.pull**2 + half * 2.0 * system.pull
    for link in range(len(system.ends)):
        first, last = system.crush_ends[link, 0], system.crush_ends[link, 1]
        if first < 0:
            continue
        kx = system.kx[t, link] + (system.kp[t, link] if system.loading[t, link] else 0.0)
        stiffness = sixth * kx + half * system.kv[t, link]
        for side in range(2):
            k = system.ends[link, side]
            if number[k] < 0:
                continue
            share = stiffness * system.inverse_mass[k] * (-1.0 if side == 0 else 1.0)
            if number[first] >= 0:
                matrix[number[k], number[first]] -= share
            if number[last] >= 0:
                matrix[number[k], number[last]] += share
    n = len(matrix)
    inverse[:, :] = 0.0
    for i in range(n):
        inverse[i, i] = 1.0
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
    for q in range(len(sampling.body)):
        for part in range(2):
            share = sampling.fraction[q] if part else 1.0 - sampling.fraction[q]
            at = t + sampling.lag[q] + part
            if share == 0.0 or at >= len(sampling.bin) or sampling.bin[at] < 0:
                continue
            if t == 0 and part == 0 and sampling.fraction[q] > 0.0:
                continue  # that sample still shows an instant before the impact
            scale = share * sampling.gain[q] * sampling.weight[at, q]
            target, source = out[sampling.bin[at], q], row[sampling.body[q]]
            for j in range(len(source)):
                target[j] += scale * source[j]
