"""RLS and MRLS: `estimators/rls.py` as loops."""

import numpy as np
from numba import njit

from .factors import product_of
from .kalman import Filter, Limits, filtered
from .linear import invert, multiply
from .regressor_errors import late, pass_on


@njit(cache=True)
def correct(
    limits, method, s, gradient, by_errors, errors, target, active, learnt, dt, multiplier, error, clamped, gain
):  # fmt: skip
    """One step of the recursion in place; fills error (q,) (NaN where not measured), clamped (p,) and gain (p, q).

    The influence of the sample itself is left to the caller.
    """
    p, q = len(s.theta), len(target)
    forgetting = method.forgetting if method.forgetting == method.forgetting else np.exp(-dt / method.memory)
    s.gamma[0] = 1.0 / (forgetting / s.gamma[0] + 1.0)
    gamma = s.gamma[0]
    valid = np.zeros(q)
    for i in range(q):
        error[i] = target[i]
        for j in range(p):
            error[i] -= gradient[i, j] * s.theta[j]
        valid[i] = 1.0 if error[i] == error[i] else 0.0
    floored = np.empty((q, q))
    for i in range(q):
        for k in range(q):
            product = error[i] * error[k] if valid[i] and valid[k] else 0.0
            s.error_covariance[i, k] += gamma * (product - s.error_covariance[i, k])
            floored[i, k] = s.error_covariance[i, k]
        if learnt[i] == learnt[i]:
            floored[i, i] += method.noise_floor * learnt[i]
    weight, weighted = np.empty((q, q)), np.empty((q, p))
    invert(floored, valid, weight)
    excited = np.zeros(p)
    for j in range(p):
        for i in range(q):
            if active[j] and valid[i] and gradient[i, j] != 0.0:
                excited[j] = 1.0
    multiply(weight, gradient, weighted)
    for i in range(q):
        for j in range(p):
            weighted[i, j] *= excited[j]
    root = np.sqrt(forgetting)
    for j in range(p):
        fade_j = root if excited[j] else 1.0
        for k in range(p):
            fade_k = root if excited[k] else 1.0
            gained = 0.0
            for i in range(q):
                gained += excited[j] * gradient[i, j] * weighted[i, k]
            s.information[j, k] = fade_j * s.information[j, k] * fade_k + gained
    free = excited.copy()
    clamped[:] = 0.0
    start = s.theta.copy()
    residual, pull, inverse = np.empty(q), np.empty(p), np.empty((p, p))
    while True:
        for i in range(q):
            residual[i] = 0.0
            if valid[i]:
                residual[i] = target[i]
                for j in range(p):
                    residual[i] -= gradient[i, j] * start[j]
        invert(s.information, free, inverse)
        multiply(inverse, weighted.T, gain)
        gain *= multiplier
        for j in range(p):
            pull[j] = 0.0
            for i in range(q):
                pull[j] += weighted[i, j] * residual[i]
        again = False
        for j in range(p):
            step = 0.0
            for k in range(p):
                step += inverse[j, k] * pull[k]
            step *= multiplier
            limit = method.step_limit * limits.scale[j]
            if multiplier != 1.0 and abs(step) > limit:
                gain[j] *= limit / abs(step)
                step = min(max(step, -limit), limit)
            s.theta[j] = start[j] + step
        for j in range(p):
            if free[j] and (s.theta[j] < limits.lower[j] or s.theta[j] > limits.upper[j]):
                start[j] = min(max(s.theta[j], limits.lower[j]), limits.upper[j])
                free[j] = 0.0
                clamped[j] = 1.0
                again = True
        if not again:
            break
    lessen, once = np.empty((p, p)), np.empty((p, p))
    multiply(gain, gradient, lessen)
    for j in range(p):
        for k in range(p):
            lessen[j, k] = (1.0 if j == k else 0.0) - lessen[j, k]
    multiply(lessen, s.carried, once)
    multiply(once, lessen.T, s.carried)
    before = np.empty((p, q))
    for t in range(len(s.window_dt)):
        before[:, :] = s.window_influence[t]
        multiply(lessen, before, s.window_influence[t])
    pass_on(s.beside, s.beside_shared, gain, gradient, by_errors, errors)


@njit(cache=True)
def add_influence(covariance, influence, variance):
    """covariance += B diag(r) B', in place."""
    p, q = influence.shape
    for j in range(p):
        for k in range(p):
            for i in range(q):
                covariance[j, k] += influence[j, i] * variance[i] * influence[k, i]


@njit(cache=True)
def covariance_of(s):
    """What has been carried on and what the window's samples add, into the state."""
    p = len(s.theta)
    covariance = s.carried.copy()
    for t in range(len(s.window_dt)):
        add_influence(covariance, s.window_influence[t], s.window_variance[t])
    for j in range(p):
        for k in range(p):
            s.covariance[j, k] = 0.5 * (covariance[j, k] + covariance[k, j])


@njit(cache=True)
def chosen_variance(s, out):
    """m E[(mean v)^2 | mean error] of a window that is used again, for each equation."""
    m, q, p = s.window_gradient.shape
    covariance_of(s)
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


@njit(cache=True)
def excess_of(method, s, errors):
    """The largest moving mean of the error over its limit."""
    m, q = errors.shape
    largest = 0.0
    for i in range(q):
        mean = 0.0
        for t in range(m):
            if errors[t, i] == errors[t, i]:
                mean += errors[t, i] / m
        largest = max(largest, abs(mean) / (method.error_limit * np.sqrt(s.noise[i] / m)))
    return largest


@njit(cache=True)
def rewind(limits, method, s, by_errors, errors, clamped):
    """Use the window again with the larger correction while that lessens the mean error -> passes made."""
    m, q = s.window_error.shape
    repeated, error, held = np.empty((m, q)), np.empty(q), clamped.copy()
    gain, chosen = np.empty((len(s.theta), q)), np.empty(q)
    passes, excess = 0, excess_of(method, s, s.window_error)
    while passes < method.rewinds and excess > 1.0:
        theta, information, carried = s.theta.copy(), s.information.copy(), s.carried.copy()
        error_covariance, gamma, influence = s.error_covariance.copy(), s.gamma[0], s.window_influence.copy()
        beside, shared = s.beside.copy(), s.beside_shared.copy()
        chosen_variance(s, chosen)
        for t in range(m):
            correct(
                limits, method, s, s.window_gradient[t], by_errors, errors, s.window_target[t], s.window_active[t],
                s.window_noise[t], s.window_dt[t], method.cr, error, held, gain,
            )  # fmt: skip
            s.window_influence[t] += gain
            repeated[t] = error
        now = excess_of(method, s, repeated)
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


@njit(cache=True)
def remember(s, gradient, target, learnt, active, dt, error, gain, m):
    """Shift the window by one sample and put the new one at its end; the errors of what leaves it are carried on."""
    kept = min(int(s.clock[1]), m - 1)
    first = 1 if int(s.clock[1]) == m else 0
    if first:
        add_influence(s.carried, s.window_influence[0], s.window_variance[0])
        for t in range(m - 1):
            s.window_influence[t] = s.window_influence[t + 1]
            s.window_variance[t] = s.window_variance[t + 1]
            s.window_gradient[t] = s.window_gradient[t + 1]
            s.window_target[t] = s.window_target[t + 1]
            s.window_noise[t] = s.window_noise[t + 1]
            s.window_active[t] = s.window_active[t + 1]
            s.window_dt[t] = s.window_dt[t + 1]
            s.window_error[t] = s.window_error[t + 1]
    s.window_gradient[kept] = gradient
    s.window_target[kept] = target
    s.window_noise[kept] = learnt
    s.window_active[kept] = active
    s.window_dt[kept] = dt
    s.window_error[kept] = error
    s.window_influence[kept] = gain
    s.window_variance[kept] = s.noise
    s.clock[1] = kept + 1


@njit(cache=True, inline="always")
def rls_step(plan, method, s, row, dt, w):
    """Correction, rewinds (MRLS), and the slow residual variance that sets the error limits."""
    known, gradient, by_errors, errors, active = w.known, w.gradient, w.by_errors, w.errors, w.active
    learnt, target, clamped = w.learnt, w.target, w.clamped
    p, q, m = len(s.theta), len(known), len(s.window_dt)
    limits = Limits(plan.lower, plan.upper, plan.scale)
    unstarted = False
    for i in range(q):
        target[i] = row.measured[i] - known[i]
        unstarted = unstarted or np.isnan(s.noise[i])
    if unstarted:
        s.error_covariance[:, :] = 0.0
        for i in range(q):
            s.noise[i] = learnt[i] if learnt[i] == learnt[i] else 1.0
            s.error_covariance[i, i] = s.noise[i]
        covariance_of(s)
    for i in range(q):
        for k in range(q):
            total = s.noise[i] if i == k else 0.0
            for j in range(p):
                for h in range(p):
                    total += gradient[i, j] * s.covariance[j, h] * gradient[k, h]
            row.innovation_covariance[i, k] = total
    error, gain = np.empty(q), np.empty((p, q))
    correct(
        limits, method, s, gradient, by_errors, errors, target, active, learnt, dt, 1.0, error, clamped, gain
    )  # fmt: skip
    if not m:
        add_influence(s.carried, gain, s.noise)
    else:
        remember(s, gradient, target, learnt, active, dt, error, gain, m)
        row.rewinds[0] = rewind(limits, method, s, by_errors, errors, clamped) if int(s.clock[1]) == m else 0
        gain[:, :] = s.window_influence[int(s.clock[1]) - 1]
    covariance_of(s)
    for i in range(q):
        left = s.noise[i]
        for j in range(p):
            left -= 2.0 * gradient[i, j] * gain[j, i] * s.noise[i]
            for h in range(p):
                left += gradient[i, j] * s.covariance[j, h] * gradient[i, h]
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
    s.stated[:, :] = s.covariance + s.beside
    if plan.drift_squared.max() > 0.0:
        walking = Filter(s.walking, s.factors, s.walking_noise, s.walking_beside, s.walking_shared)
        filtered(limits, method, walking, dt, w, w.held, w.expected, w.left)
        product_of(s.factors, s.stated)
        s.stated[:, :] += s.walking_beside
        late(s.theta, s.walking, s.stated, s.stated)
