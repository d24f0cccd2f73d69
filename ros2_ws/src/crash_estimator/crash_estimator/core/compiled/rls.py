"""RLS and MRLS: `estimators/rls.py` as loops."""

from typing import NamedTuple

import numpy as np
from numba import njit

from .factors import product_of
from .kalman import Filter, Limits, adapt, let_walk, update
from .linear import invert, multiply
from .regressor_errors import late, move_on, pass_on


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


@njit(cache=True)
def correct(
    limits, method, walks, r, gradient, by_errors, errors, target, active, learnt, dt, multiplier, error, clamped, gain
):  # fmt: skip
    """One step of the recursion in place; fills error (q,) (NaN where not measured), clamped (p,) and gain (p, q).

    The influence of the sample itself is left to the caller. walks: a filter beside it (`lag.py`) counts what errors of
    the motion do.
    """
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


@njit(cache=True)
def chosen_variance(s, out):
    """m E[(mean v)^2 | mean error] of a window that is used again, for each equation."""
    m, q, p = s.window_gradient.shape
    covariance_of(s.carried, s.window_influence, s.window_variance, s.covariance)
    for i in range(q):
        error, mean = 0.0, np.zeros(p)
        for t in range(m):
            if s.window_error[t, i] == s.window_error[t, i]:
                error += s.window_error[t, i] / m
            for j in range(p):
                mean[j] += s.window_gradient[t, i, j] / m
        spread = 0.0
        for j in range(p):
            for k in range(p):
                spread += mean[j] * s.covariance[j, k] * mean[k]
        share = s.noise[i] / (s.noise[i] + m * spread)
        out[i] = m * (share * error) ** 2 + (1.0 - share) * s.noise[i]


@njit(cache=True, inline="always")
def excess_of(method, noise, errors):
    """The largest moving mean of the errors (m, q) over its limit."""
    m, q = errors.shape
    largest = 0.0
    for i in range(q):
        mean = 0.0
        for t in range(m):
            if errors[t, i] == errors[t, i]:
                mean += errors[t, i]
        largest = max(largest, abs(mean / m) / (method.error_limit * np.sqrt(noise[i] / m)))
    return largest


@njit(cache=True, inline="always")
def recursion_of(s):
    return Recursion(
        s.theta, s.information, s.carried, s.error_covariance, s.gamma, s.window_influence, s.beside, s.beside_shared
    )


@njit(cache=True)
def rewind(limits, method, walks, s, by_errors, errors, clamped, excess):
    """Use the window again with the larger correction while that lessens the mean error -> passes made.

    excess: of that mean over its limit, as it is.
    """
    m, q = s.window_error.shape
    repeated, error, held = np.empty((m, q)), np.empty(q), clamped.copy()
    gain, chosen = np.empty((len(s.theta), q)), np.empty(q)
    passes = 0
    while passes < method.rewinds and excess > 1.0:
        theta, information, carried = s.theta.copy(), s.information.copy(), s.carried.copy()
        error_covariance, gamma, influence = s.error_covariance.copy(), s.gamma[0], s.window_influence.copy()
        beside, shared = s.beside.copy(), s.beside_shared.copy()
        chosen_variance(s, chosen)
        for t in range(m):
            correct(
                limits, method, walks, recursion_of(s), s.window_gradient[t], by_errors, errors, s.window_target[t],
                s.window_active[t], s.window_noise[t], s.window_dt[t], method.cr, error, held, gain,
            )  # fmt: skip
            s.window_influence[t] += gain
            repeated[t] = error
        now = excess_of(method, s.noise, repeated)
        if now >= excess:
            s.theta[:], s.information[:, :], s.carried[:, :] = theta, information, carried
            s.error_covariance[:, :], s.gamma[0], s.window_influence[:] = error_covariance, gamma, influence
            s.beside[:, :], s.beside_shared[:] = beside, shared
            break
        s.window_error[:, :] = repeated
        s.window_variance[:] = np.maximum(s.window_variance, chosen)
        clamped[:] = held
        excess = now
        passes += 1
    return passes


@njit(cache=True, inline="always")
def remember(s, w, dt, error, gain):
    """Shift the window by one sample and put the new one at its end; the errors of what leaves it are carried on.

    One number after the other: to assign a part of an array to another takes ten times as long.
    """
    m, q, p = s.window_gradient.shape
    last = int(s.clock[1])
    if last == m:
        last = m - 1
        add_influence(s.carried, s.window_influence[0], s.window_variance[0])
        for t in range(last):
            s.window_dt[t] = s.window_dt[t + 1]
            for j in range(p):
                s.window_active[t, j] = s.window_active[t + 1, j]
            for i in range(q):
                s.window_target[t, i] = s.window_target[t + 1, i]
                s.window_noise[t, i] = s.window_noise[t + 1, i]
                s.window_error[t, i] = s.window_error[t + 1, i]
                s.window_variance[t, i] = s.window_variance[t + 1, i]
                for j in range(p):
                    s.window_gradient[t, i, j] = s.window_gradient[t + 1, i, j]
                    s.window_influence[t, j, i] = s.window_influence[t + 1, j, i]
    s.window_dt[last] = dt
    for j in range(p):
        s.window_active[last, j] = w.active[j]
    for i in range(q):
        s.window_target[last, i] = w.target[i]
        s.window_noise[last, i] = w.learnt[i]
        s.window_error[last, i] = error[i]
        s.window_variance[last, i] = s.noise[i]
        for j in range(p):
            s.window_gradient[last, i, j] = w.gradient[i, j]
            s.window_influence[last, j, i] = gain[j, i]
    s.clock[1] = last + 1


@njit(cache=True, inline="always")
def rls_step(plan, method, s, row, dt, time, w):
    """Correction, rewinds (MRLS), and the slow residual variance that sets the error limits."""
    gradient, learnt, target, clamped, through, gain = w.gradient, w.learnt, w.target, w.clamped, w.through, w.gain
    p, q, m = len(s.theta), len(target), len(s.window_dt)
    limits = Limits(plan.lower, plan.upper, plan.scale)
    unstarted = False
    for i in range(q):
        target[i] = row.measured[i] - w.known[i]
        unstarted = unstarted or np.isnan(s.noise[i])
    if unstarted:
        s.error_covariance[:, :] = 0.0
        for i in range(q):
            s.noise[i] = learnt[i] if learnt[i] == learnt[i] else 1.0
            s.error_covariance[i, i] = s.noise[i]
    multiply(gradient, s.covariance, through)
    for i in range(q):
        for k in range(i + 1):
            total = s.noise[i] if i == k else 0.0
            for j in range(p):
                total += through[i, j] * gradient[k, j]
            row.innovation_covariance[i, k] = row.innovation_covariance[k, i] = total
    error, walks = w.error, plan.drift_squared.max() > 0.0
    move_on(s, s.walking_shared if walks else s.beside_shared, time)
    correct(
        limits, method, walks, recursion_of(s), gradient, w.by_errors, w.errors, target, w.active, learnt, dt, 1.0,
        error, clamped, gain,
    )  # fmt: skip
    if not m:
        add_influence(s.carried, gain, s.noise)
    else:
        remember(s, w, dt, error, gain)
        last = int(s.clock[1]) - 1
        excess = excess_of(method, s.noise, s.window_error) if last == m - 1 else 0.0
        if excess > 1.0:
            row.rewinds[0] = rewind(limits, method, walks, s, w.by_errors, w.errors, clamped, excess)
            gain[:, :] = s.window_influence[last]
    covariance_of(s.carried, s.window_influence, s.window_variance, s.covariance)
    multiply(gradient, s.covariance, through)
    for i in range(q):
        left = s.noise[i]
        for j in range(p):
            left += gradient[i, j] * (through[i, j] - 2.0 * gain[j, i] * s.noise[i])
        row.residual_std[i] = np.sqrt(max(left, 0.0))
    share = dt / (dt + 4.0 * method.memory)
    for i in range(q):
        residual = target[i]
        for j in range(p):
            residual -= gradient[i, j] * s.theta[j]
        if residual == residual:
            s.noise[i] += share * (max(error[i] * residual, 0.0) - s.noise[i])
        if learnt[i] == learnt[i]:
            s.noise[i] = max(s.noise[i], learnt[i])
    if not walks:
        for j in range(p):
            for k in range(p):
                s.stated[j, k] = s.covariance[j, k] + s.beside[j, k]
    else:
        walking = Filter(s.walking, s.factors, s.walking_noise, s.walking_beside, s.walking_shared)
        let_walk(limits, walking, w)
        update(limits, method, walking, w, w.held)
        adapt(method, walking, dt, w)
        product_of(s.factors, s.stated)
        for j in range(p):
            for k in range(p):
                s.stated[j, k] += s.walking_beside[j, k]
        late(s.theta, s.walking, s.stated, s.stated, w.unit)
