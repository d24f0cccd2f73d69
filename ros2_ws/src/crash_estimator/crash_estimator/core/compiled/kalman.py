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
from .short_loops import short_loops


@njit(cache=True)
def kalman_update(theta, factors, noise, gradient, target, active, lower, upper, constrained, clamped, gain):
    """Update theta (p,) and its covariance's factors (p, p) in place by one sample of q equations.

    noise (q,) variances; gradient (q, p); target (q,) measured minus known, NaN where not measured; active (p,) 1.0
    where estimated; lower, upper: bounds of the first of them; clamped (p,) is set to 1.0 where one is held at its
    bound; gain (p, q) is filled with that of each equation in its turn.
    """
    short_loops()
    p = len(theta)
    room = np.empty((p + 4, p))  # one piece of memory is found sooner than five
    start, free, psi, spread, prior = room[0], room[1], room[2], room[3], room[4:]
    for j in range(p):
        start[j], free[j], clamped[j] = theta[j], active[j], 0.0
        for k in range(p):
            prior[j, k] = factors[j, k]
    while True:
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
        theta[:] = start
        factors[:] = prior


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


class Limits(NamedTuple):
    """What a parameter may be, and how large it is. (To hand on a whole plan takes a microsecond.)"""

    lower: np.ndarray  # (p,)
    upper: np.ndarray  # (p,)
    scale: np.ndarray  # (p,)


class Filter(NamedTuple):
    """What one filter has of the state; w: its parameters, and errors of zero offsets."""

    theta: np.ndarray  # (w,)
    factors: np.ndarray  # (w, w)
    noise: np.ndarray  # (q,) R2
    beside: np.ndarray  # (w, w)
    shared: np.ndarray  # (3, b, w)


@njit(cache=True, inline="always")
def kalman_step(plan, method, n, s, row, dt, w):
    """The zero offsets' errors where they are estimated, and a step of the filter."""
    if n.offsets and np.isnan(s.noise[0]):
        count = s.count.max()
        for b in range(n.offsets):
            variance = s.squares[b] / count * (1.0 / count + dt / RECORD) if count >= FEWEST else 0.0
            s.factors[n.estimated + b, n.estimated + b] = variance
            if count >= FEWEST:
                s.beside[n.estimated + b, n.estimated + b] = s.squares[b] / count**2 - variance
    for i in range(n.equations):
        w.target[i] = row.measured[i] - w.known[i]
    limits = Limits(plan.lower, plan.upper, plan.scale)
    both = Filter(s.theta, s.factors, s.noise, s.beside, s.beside_shared)
    let_walk(limits, both, w)
    seen_through(s.factors, w.gradient, s.noise, w.through, row.innovation_covariance)
    update(limits, method, both, w, w.clamped)
    _left(both, w, row.residual_std)
    adapt(method, both, dt, w)
    product_of(s.factors, s.covariance)
    for j in range(n.estimated):
        for k in range(n.estimated):
            s.stated[j, k] = s.covariance[j, k] + s.beside[j, k]


@njit(cache=True, inline="always")
def let_walk(limits, f, w):
    """A step of the random walk; at the first one R2 starts from what is known of the sensors. w: `layout.SCRATCH`."""
    for j in range(len(w.walk)):
        size = max(abs(f.theta[j]), SMALLEST_SHARE * limits.scale[j])
        if w.walk[j] > 0.0:
            widen(f.factors, w.walk[j] * size**2, j, w.unit)
    for i in range(len(w.target)):
        if np.isnan(f.noise[i]):
            f.noise[i] = w.learnt[i] if w.learnt[i] == w.learnt[i] else 1.0


@njit(cache=True, inline="always")
def update(limits, method, f, w, clamped):
    """By one sample, of the errors that are counted beside, too."""
    p = len(f.theta)
    for j in range(p):
        w.unfiltered[j] = f.theta[j]
    kalman_update(
        f.theta, f.factors, f.noise, w.gradient, w.target, w.active, limits.lower, limits.upper, method.constrained,
        clamped, w.gain,
    )  # fmt: skip
    for i in range(len(w.target)):
        if w.target[i] == w.target[i]:
            for j in range(p):  # one at its bound counts as known, as it does in P
                w.seen[j] = 0.0 if clamped[j] else w.gradient[i, j]
            pass_one(f.beside, f.shared, w.gain[:, i], w.seen, w.by_errors[:, i], w.errors, w.unit)


@njit(cache=True, inline="always")
def adapt(method, f, dt, w):
    """R2, to what the model cannot follow."""
    if method.noise_memory > 0.0:
        share = dt / (dt + method.noise_memory)
        for i in range(len(w.target)):
            residual, innovation, learnt = w.target[i], w.target[i], w.learnt[i]
            for j in range(len(f.theta)):
                residual -= w.gradient[i, j] * f.theta[j]
                innovation -= w.gradient[i, j] * w.unfiltered[j]
            product = residual * innovation
            if product == product:
                f.noise[i] += share * (max(product, 0.0) - f.noise[i])
            f.noise[i] = max(f.noise[i], learnt if learnt == learnt else QUIETEST**2)


@njit(cache=True, inline="always")
def _left(f, w, residual_std):
    """`residual_variance` of estimators/update.py, its root; the gain becomes the influence of each equation."""
    q, p = w.gradient.shape
    gain = w.gain
    seen_through(f.factors, w.gradient, f.noise, w.through, w.spread)  # R2 is in it
    for i in range(q):
        if w.target[i] != w.target[i]:
            continue
        for k in range(i):
            met = 0.0
            for j in range(p):
                met += w.gradient[i, j] * gain[j, k]
            for j in range(p):
                gain[j, k] -= gain[j, i] * met
    for i in range(q):
        own = 0.0
        for j in range(p):
            own += w.gradient[i, j] * gain[j, i]
        residual_std[i] = np.sqrt(max(w.spread[i, i] - 2.0 * own * f.noise[i], 0.0))
