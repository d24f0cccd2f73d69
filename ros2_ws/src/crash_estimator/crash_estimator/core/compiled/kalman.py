"""The constrained Kalman filter, one equation after the other, its covariance in factors (`factors.py`).

The errors of the equations are independent (R2 is diagonal), so their updates may be made in turn, each with
a scalar instead of a matrix to invert:  s = psi P psi' + r,  L = P psi' / s,  P = (I - L psi) P (I - L psi)' + L r L'.

The row of L of a parameter that is held is 0; where it is held at a bound it has left psi as well. With L = K - H, K
the gain of all and H its held rows, that is

    P = P - s K K' + s H H'

the update of all, which factors take, and a square added for those that are held (Zanetti and D'Souza 2012, AAS
12-619).
"""

from typing import NamedTuple

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


class Filter(NamedTuple):
    """What one filter has of the state; w: its parameters, and errors of zero offsets."""

    theta: np.ndarray  # (w,)
    factors: np.ndarray  # (w, w)
    noise: np.ndarray  # (q,) R2
    beside: np.ndarray  # (w, w)
    shared: np.ndarray  # (3, b, w)


@njit(cache=True, inline="always")
def kalman_step(
    plan, method, n, s, row, dt, known, gradient, by_errors, errors, active, walk, learnt, target, clamped
):  # fmt: skip
    """The zero offsets' errors where they are estimated, and a step of the filter."""
    if n.offsets and np.isnan(s.noise[0]):
        count = s.count.max()
        for b in range(n.offsets):
            variance = s.squares[b] / count * (1.0 / count + dt / RECORD) if count >= FEWEST else 0.0
            s.factors[n.estimated + b, n.estimated + b] = variance
            if count >= FEWEST:
                s.beside[n.estimated + b, n.estimated + b] = s.squares[b] / count**2 - variance
    for i in range(len(known)):
        target[i] = row.measured[i] - known[i]
    filtered(
        plan, method, Filter(s.theta, s.factors, s.noise, s.beside, s.beside_shared), dt, gradient, by_errors, errors,
        active, walk, learnt, target, clamped, row.innovation_covariance, row.residual_std,
    )  # fmt: skip
    product_of(s.factors, s.covariance)
    for j in range(n.estimated):
        for k in range(n.estimated):
            s.stated[j, k] = s.covariance[j, k] + s.beside[j, k]


@njit(cache=True)
def filtered(
    plan, method, f, dt, gradient, by_errors, errors, active, walk, learnt, target, clamped, innovation_covariance,
    residual_std,
):  # fmt: skip
    """Random walk, update, and adaptation of R2 to what the model cannot follow."""
    p, q = len(f.theta), len(target)
    unit, through = np.empty(p), np.empty((q, p))
    for j in range(len(walk)):
        size = max(abs(f.theta[j]), SMALLEST_SHARE * plan.scale[j])
        if walk[j] > 0.0:
            widen(f.factors, walk[j] * size**2, j, unit)
    for i in range(q):
        if np.isnan(f.noise[i]):
            f.noise[i] = learnt[i] if learnt[i] == learnt[i] else 1.0
    seen_through(f.factors, gradient, f.noise, through, innovation_covariance)
    before, gain = f.theta.copy(), np.empty((p, q))
    kalman_update(
        f.theta, f.factors, f.noise, gradient, target, active, plan.lower, plan.upper, method.constrained, clamped, gain
    )
    for i in range(q):
        if target[i] == target[i]:
            pass_one(f.beside, f.shared, gain[:, i], gradient[i], by_errors[:, i], errors, unit)
    _left(f, gradient, gain, target, through, residual_std)
    if method.noise_memory > 0.0:
        share = dt / (dt + method.noise_memory)
        for i in range(q):
            residual, innovation = target[i], target[i]
            for j in range(p):
                residual -= gradient[i, j] * f.theta[j]
                innovation -= gradient[i, j] * before[j]
            product = residual * innovation
            if product == product:
                f.noise[i] += share * (max(product, 0.0) - f.noise[i])
            f.noise[i] = max(f.noise[i], learnt[i] if learnt[i] == learnt[i] else QUIETEST**2)


@njit(cache=True)
def _left(f, gradient, gain, target, through, residual_std):
    """`residual_variance` of estimators/update.py, its root; gain (w, q) becomes the influence of each equation."""
    q, w = gradient.shape
    spread = np.empty((q, q))
    seen_through(f.factors, gradient, f.noise, through, spread)  # R2 is in it
    for i in range(q):
        if target[i] != target[i]:
            continue
        for k in range(i):
            met = 0.0
            for j in range(w):
                met += gradient[i, j] * gain[j, k]
            for j in range(w):
                gain[j, k] -= gain[j, i] * met
    for i in range(q):
        own = 0.0
        for j in range(w):
            own += gradient[i, j] * gain[j, i]
        residual_std[i] = np.sqrt(max(spread[i, i] - 2.0 * own * f.noise[i], 0.0))
