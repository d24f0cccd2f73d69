"""RLS and MRLS: `estimators/rls.py` as loops."""

import numpy as np
from numba import njit

from .factors import product_of
from .kalman import Filter, Limits, adapt, let_walk, update
from .linear import multiply
from .regressor_errors import late, move_on
from .rls_correction import add_influence, correct, covariance_of, recursion_of
from .rls_rewinding import excess_of, remember, rewind


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
