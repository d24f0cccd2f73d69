"""RLS and MRLS: `estimators/rls.py` as loops."""

import numpy as np
from numba import njit


@njit(cache=True)
def invert(matrix, out):
    """Inverse of a symmetric positive matrix, after scaling its diagonal to 1 (N/m beside N s/m)."""
    n = len(matrix)
    scale = np.empty(n)
    for j in range(n):
        scale[j] = 1.0 / np.sqrt(matrix[j, j])
    scaled = np.empty((n, n))
    for j in range(n):
        for k in range(n):
            scaled[j, k] = matrix[j, k] * scale[j] * scale[k]
    inverse = np.linalg.inv(scaled)
    for j in range(n):
        for k in range(n):
            out[j, k] = inverse[j, k] * scale[j] * scale[k]


@njit(cache=True)
def _submatrix_inverse(matrix, keep):
    """Inverse of the rows and columns that are kept, zero elsewhere."""
    n = len(matrix)
    index = np.flatnonzero(keep)
    small, inverse = np.empty((len(index), len(index))), np.empty((len(index), len(index)))
    out = np.zeros((n, n))
    if not len(index):
        return out
    for a in range(len(index)):
        for b in range(len(index)):
            small[a, b] = matrix[index[a], index[b]]
    invert(small, inverse)
    for a in range(len(index)):
        for b in range(len(index)):
            out[index[a], index[b]] = inverse[a, b]
    return out


@njit(cache=True)
def correct(plan, method, s, gradient, target, active, learnt, dt, multiplier, error, clamped):
    """One step of the recursion in place; fills error (q,) (NaN where not measured) and clamped (p,)."""
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
    weight = _submatrix_inverse(floored, valid)
    excited = np.zeros(p)
    for j in range(p):
        for i in range(q):
            if active[j] and valid[i] and gradient[i, j] != 0.0:
                excited[j] = 1.0
    weighted = weight @ gradient
    root = np.sqrt(forgetting)
    for j in range(p):
        fade_j = root if excited[j] else 1.0
        for k in range(p):
            fade_k = root if excited[k] else 1.0
            gained = 0.0
            for i in range(q):
                gained += gradient[i, j] * weighted[i, k]
            s.information[j, k] = fade_j * s.information[j, k] * fade_k + gained
            s.spread[j, k] = fade_j**2 * s.spread[j, k] * fade_k**2 + gained
    free = excited.copy()
    clamped[:] = 0.0
    start = s.theta.copy()
    residual = np.empty(q)
    while True:
        for i in range(q):
            residual[i] = 0.0
            if valid[i]:
                residual[i] = target[i]
                for j in range(p):
                    residual[i] -= gradient[i, j] * start[j]
        pull = weighted.T @ residual
        inverse = _submatrix_inverse(s.information, free)
        again = False
        for j in range(p):
            step = 0.0
            for k in range(p):
                step += inverse[j, k] * pull[k] * free[k]
            step *= multiplier
            if multiplier != 1.0:
                limit = method.step_limit * plan.scale[j]
                step = min(max(step, -limit), limit)
            s.theta[j] = start[j] + step if free[j] else start[j]
        for j in range(p):
            if free[j] and (s.theta[j] < plan.lower[j] or s.theta[j] > plan.upper[j]):
                start[j] = min(max(s.theta[j], plan.lower[j]), plan.upper[j])
                free[j] = 0.0
                clamped[j] = 1.0
                again = True
        if not again:
            return


@njit(cache=True)
def covariance_of(s):
    """S^-1 spread S^-1, into the state."""
    p = len(s.theta)
    inverse = np.empty((p, p))
    invert(s.information, inverse)
    covariance = inverse @ s.spread @ inverse
    for j in range(p):
        for k in range(p):
            s.covariance[j, k] = 0.5 * (covariance[j, k] + covariance[k, j])


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
def rewind(plan, method, s, clamped):
    """Use the window again with the larger correction while that lessens the mean error -> passes made."""
    m, q = s.window_error.shape
    errors, error, held = np.empty((m, q)), np.empty(q), clamped.copy()
    passes, excess = 0, excess_of(method, s, s.window_error)
    while passes < method.rewinds and excess > 1.0:
        theta, information, spread = s.theta.copy(), s.information.copy(), s.spread.copy()
        error_covariance, gamma = s.error_covariance.copy(), s.gamma[0]
        for t in range(m):
            correct(
                plan, method, s, s.window_gradient[t], s.window_target[t], s.window_active[t], s.window_noise[t],
                s.window_dt[t], method.cr, error, held,
            )  # fmt: skip
            errors[t] = error
        now = excess_of(method, s, errors)
        if now >= excess:
            s.theta[:], s.information[:, :], s.spread[:, :] = theta, information, spread
            s.error_covariance[:, :], s.gamma[0] = error_covariance, gamma
            break
        s.window_error[:, :] = errors
        clamped[:] = held
        excess = now
        passes += 1
    return passes


@njit(cache=True)
def remember(s, gradient, target, learnt, active, dt, error, m):
    """Shift the window by one sample and put the new one at its end."""
    kept = min(int(s.clock[1]), m - 1)
    first = 1 if int(s.clock[1]) == m else 0
    if first:
        for t in range(m - 1):
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
    s.clock[1] = kept + 1


@njit(cache=True)
def rls_step(plan, method, s, row, dt, known, gradient, active, walk, learnt, target, clamped):
    """Correction, rewinds (MRLS), and the slow residual variance that sets the error limits."""
    p, q, m = len(s.theta), len(known), len(s.window_dt)
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
    error = np.empty(q)
    correct(plan, method, s, gradient, target, active, learnt, dt, 1.0, error, clamped)
    if m:
        remember(s, gradient, target, learnt, active, dt, error, m)
        row.rewinds[0] = rewind(plan, method, s, clamped) if int(s.clock[1]) == m else 0
    share = dt / (dt + 4.0 * method.memory)
    for i in range(q):
        residual = target[i]
        for j in range(p):
            residual -= gradient[i, j] * s.theta[j]
        if residual == residual:
            s.noise[i] += share * (residual**2 - s.noise[i])
        if learnt[i] == learnt[i]:
            s.noise[i] = max(s.noise[i], learnt[i])
    covariance_of(s)
