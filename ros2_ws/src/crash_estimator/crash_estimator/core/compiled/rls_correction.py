"""One correction of RLS and MRLS: `estimators/rls.py` as loops."""

from typing import NamedTuple

import numpy as np
from numba import njit

from .linear import invert, multiply
from .regressor_errors import pass_on
from .short_loops import short_loops


class Recursion(NamedTuple):
    """What a correction changes of the state. (To hand on all of that, or a whole plan, takes a microsecond.)"""

    theta: np.ndarray  # (p,)
    information: np.ndarray  # (p, p) S
    carried: np.ndarray  # (p, p)
    error_covariance: np.ndarray  # (q, q) Lambda
    gamma: np.ndarray  # (1,)
    influence: np.ndarray  # (m, p, q) B_i
    beside: np.ndarray  # (p, p)
    shared: np.ndarray  # (3, b, p)


@njit(cache=True, inline="always")
def recursion_of(s):
    return Recursion(
        s.theta, s.information, s.carried, s.error_covariance, s.gamma, s.window_influence, s.beside, s.beside_shared
    )


@njit(cache=True)
def correct(
    limits, method, walks, r, gradient, by_errors, errors, target, active, learnt, dt, multiplier, error, clamped, gain
):  # fmt: skip
    """One step of the recursion in place; fills error (q,) (NaN where not measured), clamped (p,) and gain (p, q).

    The influence of the sample itself is left to the caller. walks: a filter beside it (`lag.py`) counts what errors of
    the motion do.
    """
    short_loops()
    p, q = len(r.theta), len(target)
    of_q, of_p = np.empty((q + p + 2, q)), np.empty((q + 3 * p + 3, p))  # two are found sooner than eleven
    weight, valid, residual, before = of_q[:q], of_q[q], of_q[q + 1], of_q[q + 2 :]
    weighted, start, free, pull = of_p[:q], of_p[q], of_p[q + 1], of_p[q + 2]
    inverse, lessen, once = of_p[q + 3 : q + 3 + p], of_p[q + 3 + p : q + 3 + 2 * p], of_p[q + 3 + 2 * p :]
    forgetting = method.forgetting if method.forgetting == method.forgetting else np.exp(-dt / method.memory)
    r.gamma[0] = 1.0 / (forgetting / r.gamma[0] + 1.0)
    gamma = r.gamma[0]
    for i in range(q):
        error[i] = target[i]
        for j in range(p):
            error[i] -= gradient[i, j] * r.theta[j]
        valid[i] = 1.0 if error[i] == error[i] else 0.0
    for i in range(q):
        for k in range(q):
            product = error[i] * error[k] if valid[i] and valid[k] else 0.0
            r.error_covariance[i, k] += gamma * (product - r.error_covariance[i, k])
            weight[i, k] = r.error_covariance[i, k]
        if learnt[i] == learnt[i]:
            weight[i, i] += method.noise_floor * learnt[i]
    invert(weight, valid, residual)
    multiply(weight, gradient, weighted)
    root = np.sqrt(forgetting)
    for j in range(p):
        start[j], free[j], clamped[j] = r.theta[j], 0.0, 0.0
        for i in range(q):
            if active[j] and valid[i] and gradient[i, j] != 0.0:
                free[j] = 1.0
        if free[j]:  # it is excited: what was known of it fades
            for k in range(p):
                r.information[j, k] *= root
                r.information[k, j] *= root
        else:
            for i in range(q):
                weighted[i, j] = 0.0
    for j in range(p):
        if free[j]:
            for i in range(q):
                if gradient[i, j] != 0.0:
                    for k in range(p):
                        r.information[j, k] += gradient[i, j] * weighted[i, k]
    while True:
        for i in range(q):
            residual[i] = 0.0
            if valid[i]:
                residual[i] = target[i]
                for j in range(p):
                    residual[i] -= gradient[i, j] * start[j]
        for j in range(p):
            for k in range(p):
                inverse[j, k] = r.information[j, k]
        invert(inverse, free, pull)
        multiply(inverse, weighted.T, gain)
        gain *= multiplier
        again = False
        for j in range(p):
            step = 0.0
            for i in range(q):
                step += gain[j, i] * residual[i]
            limit = method.step_limit * limits.scale[j]
            if multiplier != 1.0 and abs(step) > limit:
                for i in range(q):
                    gain[j, i] *= limit / abs(step)
                step = min(max(step, -limit), limit)
            r.theta[j] = start[j] + step
            if free[j] and (r.theta[j] < limits.lower[j] or r.theta[j] > limits.upper[j]):
                start[j] = min(max(r.theta[j], limits.lower[j]), limits.upper[j])
                free[j] = 0.0
                clamped[j] = 1.0
                again = True
        if not again:
            break
    multiply(gain, gradient, lessen)
    for j in range(p):
        for k in range(p):
            lessen[j, k] = (1.0 if j == k else 0.0) - lessen[j, k]
    multiply(lessen, r.carried, once)
    multiply(lessen, once.T, r.carried)
    for t in range(len(r.influence)):
        for j in range(p):
            for i in range(q):
                before[j, i] = r.influence[t, j, i]
        multiply(lessen, before, r.influence[t])
    if not walks:
        pass_on(r.beside, r.shared, gain, gradient, by_errors, errors)


@njit(cache=True, inline="always")
def add_influence(covariance, influence, variance):
    """covariance += B diag(r) B', in place. Most of B is 0: it is of what its sample has excited."""
    p, q = influence.shape
    for j in range(p):
        for i in range(q):
            part = influence[j, i] * variance[i]
            if part != 0.0:
                for k in range(p):
                    covariance[j, k] += part * influence[k, i]


@njit(cache=True, inline="always")
def covariance_of(carried, influence, variance, covariance):
    """Fill covariance (p, p) with what has been carried on and what the window's samples (m, p, q) add."""
    for j in range(len(carried)):
        for k in range(len(carried)):
            covariance[j, k] = 0.5 * (carried[j, k] + carried[k, j])
    for t in range(len(influence)):
        add_influence(covariance, influence[t], variance[t])
