"""Errors of the integrated motion in the covariance: `regressor_errors.py` as loops.

The arrays of all three kinds of error come one after the other: shared (3, b, w), by_errors (3, q, b), with 0 the zero
offset, 1 velocity and 2 displacement. Most bodies touch few equations: what is 0 in by_errors is passed over.
"""

import numpy as np
from numba import njit

from ..kinematics import FEWEST
from ..regressor_errors import ONE_SIDED, TWO_SIDED


@njit(cache=True, inline="always")
def sensors_of(plan, s, zero, density, dt):
    """Fill (b,) the variance of each body's zero, and the spectral density of the noise that is integrated."""
    count = s.count.max() if len(s.count) else 0.0
    if count < FEWEST:
        zero[:] = 0.0
        density[:] = 0.0
        return
    for b in range(len(zero)):
        zero[b] = s.squares[b] / count**2
        density[b] = s.squares[b] / count * dt
    for i in range(len(plan.equation_body)):
        if plan.equation_body[i] < 0:
            for b in range(len(zero)):
                if plan.own_offset[i, b] != 0.0:
                    zero[b] = s.force_squares[i] / count**2


@njit(cache=True, inline="always")
def known_of(zero, density, velocity, t, n):
    """Fill n (b, 7) with the covariance of each body's errors, zz, zu, zd, uu, ud, dd, and the density beside them."""
    for b in range(len(zero)):
        z, q, u = zero[b], density[b], velocity[b]
        n[b, 0] = z
        n[b, 1] = z * t
        n[b, 2] = 0.5 * z * t * t
        n[b, 3] = u + (z * t + q) * t
        n[b, 4] = (u + (0.5 * z * t + 0.5 * q) * t) * t
        n[b, 6] = q
        n[b, 5] = (u + (0.25 * z * t + q / 3.0) * t) * t * t


@njit(cache=True, inline="always")
def move_on(s, shared, time):
    """C goes on to the time of this sample, s since the impact: u += z dt, d += u dt + z dt^2 / 2."""
    dt = time - s.beside_time[0]
    s.beside_time[0] = time
    for b in range(shared.shape[1]):
        for j in range(shared.shape[2]):
            z, u = shared[0, b, j], shared[1, b, j]
            shared[1, b, j] = u + z * dt
            shared[2, b, j] += (u + 0.5 * z * dt) * dt


@njit(cache=True, inline="always")
def late(theta, of_filter, covariance, stated, more):
    """Fill stated (p, p) of theta (p,), given a filter's of that covariance (p, p), which may be `stated` itself; more
    (p,) is scratch."""
    for j in range(len(theta)):
        behind, s = of_filter[j] - theta[j], np.sqrt(max(covariance[j, j], 0.0))
        reach = max(s, (abs(behind) + ONE_SIDED * s) / TWO_SIDED)
        more[j] = np.copysign(np.sqrt(max(reach**2 - s**2, 0.0)), behind)
    for j in range(len(theta)):
        for k in range(len(theta)):
            stated[j, k] = covariance[j, k] + more[j] * more[k]


@njit(cache=True, inline="always")
def pass_one(whole, shared, gain, psi, h, n, c):
    """`pass_on` for one equation: gain (w,), psi (w,), h (3, b); c (w,) is scratch.

    S + g c' + c g' + v g g' = S + g d' + d g' with d = c + v g / 2. A body without errors has none to share; most of
    psi is 0, and the gain of what is held: nothing is added for those.
    """
    w, v = len(gain), 0.0
    c[:] = 0.0
    for b in range(h.shape[1]):
        h0, h1, h2 = h[0, b], h[1, b], h[2, b]
        if h0 == 0.0 and h1 == 0.0 and h2 == 0.0:
            continue
        v += h0 * (h0 * n[b, 0] + 2.0 * (h1 * n[b, 1] + h2 * n[b, 2]))
        v += h1 * (h1 * n[b, 3] + 2.0 * h2 * n[b, 4]) + h2 * h2 * n[b, 5]
        for j in range(w):
            c[j] += h0 * shared[0, b, j] + h1 * shared[1, b, j] + h2 * shared[2, b, j]
    for j in range(w):
        if psi[j] != 0.0:
            v -= 2.0 * psi[j] * c[j]
    for k in range(w):
        if psi[k] != 0.0:
            for j in range(w):
                if psi[j] != 0.0:
                    v += psi[k] * psi[j] * whole[k, j]
    for k in range(w):
        if psi[k] != 0.0:
            for j in range(w):
                c[j] -= psi[k] * whole[k, j]
    for j in range(w):
        c[j] += 0.5 * v * gain[j]
    for j in range(w):
        if gain[j] != 0.0:
            for k in range(w):
                whole[j, k] += gain[j] * c[k] + c[j] * gain[k]
        else:
            for k in range(w):
                if gain[k] != 0.0:
                    whole[j, k] += c[j] * gain[k]
    for b in range(h.shape[1]):
        if n[b, 0] == 0.0 and n[b, 3] == 0.0 and n[b, 6] == 0.0:
            continue
        h0, h1, h2 = h[0, b], h[1, b], h[2, b]
        z = h0 * n[b, 0] + h1 * n[b, 1] + h2 * n[b, 2]
        u = h0 * (n[b, 1] + n[b, 6]) + h1 * n[b, 3] + h2 * n[b, 4]
        d = h0 * n[b, 2] + h1 * n[b, 4] + h2 * n[b, 5]
        for j in range(w):
            if psi[j] != 0.0:
                z -= psi[j] * shared[0, b, j]
                u -= psi[j] * shared[1, b, j]
                d -= psi[j] * shared[2, b, j]
        for j in range(w):
            if gain[j] != 0.0:
                shared[0, b, j] += gain[j] * z
                shared[1, b, j] += gain[j] * u
                shared[2, b, j] += gain[j] * d


@njit(cache=True)
def pass_on(whole, shared, gain, gradient, by_errors, n):
    """S and C, in place, after theta += gain (y - gradient theta); gain (w, q), gradient (q, w), n of `known_of`.

    As in `pass_one`, with G for g and V (q, q) for v: S + G D' + D G', D = C + G V / 2.
    """
    w, q = gain.shape
    bodies = by_errors.shape[2]
    room = np.zeros((q, w + q + 3))  # one piece of memory is found sooner than three
    c, v, pull = room[:, :w], room[:, w : w + q], room[:, w + q :]
    for i in range(q):
        for b in range(bodies):
            h0, h1, h2 = by_errors[0, i, b], by_errors[1, i, b], by_errors[2, i, b]
            if h0 == 0.0 and h1 == 0.0 and h2 == 0.0:
                continue
            z = h0 * n[b, 0] + h1 * n[b, 1] + h2 * n[b, 2]
            u = h0 * n[b, 1] + h1 * n[b, 3] + h2 * n[b, 4]
            d = h0 * n[b, 2] + h1 * n[b, 4] + h2 * n[b, 5]
            for k in range(i + 1):
                v[i, k] += by_errors[0, k, b] * z + by_errors[1, k, b] * u + by_errors[2, k, b] * d
            for j in range(w):
                c[i, j] += h0 * shared[0, b, j] + h1 * shared[1, b, j] + h2 * shared[2, b, j]
    for i in range(q):  # Psi C' enters V from both sides: once as it is, once with Psi S Psi' taken off
        for j in range(w):
            if gradient[i, j] != 0.0:
                for k in range(i, q):
                    v[k, i] -= gradient[i, j] * c[k, j]
    for i in range(q):
        for j in range(w):
            if gradient[i, j] != 0.0:
                for k in range(w):
                    c[i, k] -= gradient[i, j] * whole[j, k]
    for i in range(q):
        for j in range(w):
            if gradient[i, j] != 0.0:
                for k in range(i + 1):
                    v[i, k] -= gradient[i, j] * c[k, j]
    for i in range(q):
        for k in range(i):
            v[k, i] = v[i, k]
    for i in range(q):
        for k in range(q):
            for j in range(w):
                c[i, j] += 0.5 * v[i, k] * gain[j, k]
    for j in range(w):
        for i in range(q):
            if gain[j, i] != 0.0:
                for k in range(w):
                    whole[j, k] += gain[j, i] * c[i, k]
                    whole[k, j] += gain[j, i] * c[i, k]
    for b in range(bodies):
        if n[b, 0] == 0.0 and n[b, 3] == 0.0 and n[b, 6] == 0.0:  # it has no errors to share
            continue
        for i in range(q):
            h0, h1, h2 = by_errors[0, i, b], by_errors[1, i, b], by_errors[2, i, b]
            pull[i, 0] = h0 * n[b, 0] + h1 * n[b, 1] + h2 * n[b, 2]
            pull[i, 1] = h0 * (n[b, 1] + n[b, 6]) + h1 * n[b, 3] + h2 * n[b, 4]
            pull[i, 2] = h0 * n[b, 2] + h1 * n[b, 4] + h2 * n[b, 5]
            for j in range(w):
                if gradient[i, j] != 0.0:
                    for kind in range(3):
                        pull[i, kind] -= gradient[i, j] * shared[kind, b, j]
        for j in range(w):
            for i in range(q):
                if gain[j, i] != 0.0:
                    for kind in range(3):
                        shared[kind, b, j] += gain[j, i] * pull[i, kind]
