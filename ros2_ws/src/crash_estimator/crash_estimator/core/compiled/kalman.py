"""The constrained Kalman filter, one equation after the other.

The errors of the equations are independent (R2 is diagonal), so their updates may be made in turn, each with
a scalar instead of a matrix to invert:  s = psi P psi' + r,  L = P psi' / s,  P = (I - L psi) P (I - L psi)' + L r L'.
"""

import numpy as np
from numba import njit

from ..estimators.kalman import SMALLEST_SHARE
from ..kinematics import FEWEST, RECORD


@njit(cache=True)
def kalman_update(theta, covariance, noise, gradient, target, active, lower, upper, constrained, clamped):
    """Update theta (p,) and its covariance (p, p) in place by one sample of q equations.

    noise (q,) variances; gradient (q, p); target (q,) measured minus known, NaN where not measured; active (p,) 1.0 where
    estimated; lower, upper: bounds of the first of them; clamped (p,) is set to 1.0 where one is held at its bound.
    """
    start = theta.copy()
    prior = covariance.copy()
    free = active.copy()
    clamped[:] = 0.0
    gain = np.zeros(len(covariance))
    spread = np.empty(len(covariance))
    while True:
        theta[:] = start
        covariance[:] = prior
        for i in range(len(target)):
            if target[i] == target[i]:
                _one_equation(theta, covariance, noise[i], gradient[i], target[i], free, gain, spread)
        again = False
        if constrained:
            for j in range(len(lower)):
                if free[j] == 1.0 and (theta[j] < lower[j] or theta[j] > upper[j]):
                    start[j] = min(max(theta[j], lower[j]), upper[j])
                    free[j] = 0.0
                    clamped[j] = 1.0
                    again = True
        if not again:
            break


@njit(cache=True, inline="always")
def _one_equation(theta, covariance, r, psi, target, free, gain, spread):
    n = len(theta)
    error, s = target, r
    for j in range(n):
        total = 0.0
        for k in range(n):
            if free[k] == 1.0:
                total += covariance[j, k] * psi[k]
        spread[j] = total
    for j in range(n):
        if free[j] == 1.0:
            s += psi[j] * spread[j]
    for j in range(n):
        error -= psi[j] * theta[j]
    for j in range(n):
        gain[j] = free[j] * spread[j] / s
        theta[j] += gain[j] * error
    # Joseph's form for one equation: T = (I - L psi) P, then T (I - L psi)' + L r L', with psi P = spread'
    for j in range(n):
        remaining = spread[j] - gain[j] * (s - r)
        for k in range(j + 1):
            value = covariance[j, k] - gain[j] * spread[k] - remaining * gain[k] + r * gain[j] * gain[k]
            covariance[j, k] = value
            covariance[k, j] = value


@njit(cache=True, inline="always")
def kalman_step(plan, method, n, s, row, dt, known, gradient, active, walk, learnt, target, clamped):
    """Random walk, update, and adaptation of R2 to what the model cannot follow."""
    p, q = len(s.theta), len(known)
    spread = np.empty(len(s.covariance))
    for j in range(n.estimated):
        size = max(abs(s.theta[j]), SMALLEST_SHARE * plan.scale[j])
        s.covariance[j, j] += walk[j] * size**2
    if n.offsets and np.isnan(s.noise[0]):
        count = s.count.max()
        for b in range(n.offsets):
            variance = s.squares[b] / count * (1.0 / count + dt / RECORD) if count >= FEWEST else 0.0
            s.covariance[n.estimated + b, n.estimated + b] = variance
    for i in range(q):
        if np.isnan(s.noise[i]):
            s.noise[i] = learnt[i] if learnt[i] == learnt[i] else 1.0
        target[i] = row.measured[i] - known[i]
    for i in range(q):
        for j in range(len(spread)):
            spread[j] = 0.0
            for h in range(len(spread)):
                spread[j] += s.covariance[j, h] * gradient[i, h]
        for k in range(q):
            total = s.noise[i] if i == k else 0.0
            for j in range(len(spread)):
                total += gradient[k, j] * spread[j]
            row.innovation_covariance[k, i] = total
    before = s.theta.copy()
    kalman_update(
        s.theta, s.covariance, s.noise, gradient, target, active, plan.lower, plan.upper, method.constrained, clamped
    )
    if method.noise_memory > 0.0:
        share = dt / (dt + method.noise_memory)
        for i in range(q):
            residual, innovation = target[i], target[i]
            for j in range(p):
                residual -= gradient[i, j] * s.theta[j]
                innovation -= gradient[i, j] * before[j]
            product = residual * innovation
            if product == product:
                s.noise[i] += share * (max(product, 0.0) - s.noise[i])
            if learnt[i] == learnt[i]:
                s.noise[i] = max(s.noise[i], learnt[i])
