"""The constrained Kalman filter, one equation after the other, its covariance in factors (`factors.py`).

The errors of the equations are independent (R2 is diagonal), so their updates may be made in turn, each with
a scalar instead of a matrix to invert:  s = psi P psi' + r,  L = P psi' / s,  P = (I - L psi) P (I - L psi)' + L r L'.

The row of L of a parameter that is held is 0; where it is held at a bound it has left psi as well. With L = K - H, K
the gain of all and H its held rows, that is

    P = P - s K K' + s H H'

the update of all, which factors take, and a square added for those that are held (Zanetti and D'Souza 2012, AAS
12-619).
"""

import numpy as np
from numba import njit

from ..kinematics import FEWEST, RECORD
from ..regression import QUIETEST
from ..regressor_errors import SMALLEST_SHARE
from .factors import add_square, observe, product_of, seen_through, widen
from .regressor_errors import pass_one


@njit(cache=True)
def kalman_update(theta, factors, noise, gradient, target, active, lower, upper, constrained, clamped, gain):
    """Update theta (p,) and its covariance's factors (p, p) in place by one sample of q equations.

    noise (q,) variances; gradient (q, p); target (q,) measured minus known, NaN where not measured; active (p,) 1.0
    where estimated; lower, upper: bounds of the first of them; clamped (p,) is set to 1.0 where one is held at its
    bound; gain (p, q) is filled with that of each equation in its turn.
    """
    start = theta.copy()
    prior = factors.copy()
    free = active.copy()
    clamped[:] = 0.0
    psi = np.empty(len(theta))
    spread = np.empty(len(theta))
    while True:
        theta[:] = start
        factors[:] = prior
        gain[:, :] = 0.0
        for i in range(len(target)):
            if target[i] == target[i]:
                _one_equation(theta, factors, noise[i], gradient[i], target[i], free, clamped, psi, spread, gain[:, i])
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
def _one_equation(theta, factors, r, gradient, target, free, clamped, psi, spread, gain):
    """spread: first P psi', then of that only what is held."""
    error, last = target, -1
    for j in range(len(theta)):
        error -= gradient[j] * theta[j]
        psi[j] = 0.0 if clamped[j] else gradient[j]
    s = observe(factors, psi, r, spread)
    if s == 0.0:  # neither noise nor anything to learn
        return
    for j in range(len(theta)):
        if free[j] == 1.0:
            gain[j] = spread[j] / s
            theta[j] += spread[j] / s * error
            spread[j] = 0.0
        elif spread[j] != 0.0:
            last = j
    add_square(factors, 1.0 / s, spread, last)


@njit(cache=True, inline="always")
def kalman_step(
    plan, method, n, s, row, dt, known, gradient, by_errors, errors, active, walk, learnt, target, clamped
):  # fmt: skip
    """Random walk, update, and adaptation of R2 to what the model cannot follow."""
    p, q = len(s.theta), len(known)
    unit, through = np.empty(p), np.empty((q, p))
    for j in range(n.estimated):
        size = max(abs(s.theta[j]), SMALLEST_SHARE * plan.scale[j])
        if walk[j] > 0.0:
            widen(s.factors, walk[j] * size**2, j, unit)
    if n.offsets and np.isnan(s.noise[0]):
        count = s.count.max()
        for b in range(n.offsets):
            variance = s.squares[b] / count * (1.0 / count + dt / RECORD) if count >= FEWEST else 0.0
            s.factors[n.estimated + b, n.estimated + b] = variance
            if count >= FEWEST:
                s.beside[n.estimated + b, n.estimated + b] = s.squares[b] / count**2 - variance
    for i in range(q):
        if np.isnan(s.noise[i]):
            s.noise[i] = learnt[i] if learnt[i] == learnt[i] else 1.0
        target[i] = row.measured[i] - known[i]
    seen_through(s.factors, gradient, s.noise, through, row.innovation_covariance)
    before, gain = s.theta.copy(), np.empty((p, q))
    kalman_update(
        s.theta, s.factors, s.noise, gradient, target, active, plan.lower, plan.upper, method.constrained, clamped, gain
    )
    for i in range(q):
        if target[i] == target[i]:
            pass_one(s.beside, s.beside_shared, gain[:, i], gradient[i], by_errors[:, i], errors, unit)
    product_of(s.factors, s.covariance)
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
            s.noise[i] = max(s.noise[i], learnt[i] if learnt[i] == learnt[i] else QUIETEST**2)
