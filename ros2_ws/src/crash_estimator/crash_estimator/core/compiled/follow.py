"""One sample, or a whole record, through the compiled recursion."""

import numpy as np
from numba import njit

from ..estimate import ParameterStatus
from .kalman import kalman_step
from .motion import APART, UNLOADING, move, regress, touch
from .regressor_errors import known_of, move_on, sensors_of
from .rls import rls_step
from .views import method_of, plan_views, row_views, size_of, state_views

ESTIMATED, KNOWN, UNLOADS, SEPARATE, CLAMPED, _ = (float(status) for status in ParameterStatus)


@njit(cache=True)
def follow(whole, others, state, last_row, times_ns, values, rows):
    """Fold (k, c) values at (k,) times through the method; (k, row) `rows` are filled.

    `state` and `last_row`, the row before them, are changed in place.
    """
    n, method = size_of(whole), method_of(others)
    plan, s = plan_views(whole, others, n), state_views(state, n)
    p, q, e = n.estimated, n.equations, n.elements
    by_errors, errors = np.zeros((3, q, n.bodies)), np.zeros((n.bodies, 7))
    zero, density = np.zeros(n.bodies), np.zeros(n.bodies)
    clean, bodies = np.empty(n.channels), np.empty(n.bodies)
    lever, shift, per_unit = np.empty(e), np.empty(e), np.empty(n.parameters)
    known, gradient, learnt, target = np.empty(q), np.empty((q, p + n.offsets)), np.empty(q), np.empty(q)
    active, walk = np.ones(p + n.offsets), np.empty(p)
    clamped, before = np.empty(p + n.offsets), np.empty(p + n.offsets)
    latest = np.empty(len(last_row))
    row, previous = row_views(latest, n), row_views(last_row, n)
    for t in range(len(times_ns)):
        time = times_ns[t] * 1e-9
        dt = move(plan, s, row, times_ns[t], values[t], clean, bodies)
        touch(plan, s, row, time, lever, shift)
        sensors_of(plan, s, zero, density, dt)
        known_of(zero, density, plan.velocity_variance, time, errors)
        excited = regress(
            plan, s, row, n, dt, time, lever, shift, per_unit, by_errors, errors, known, gradient, active, walk, learnt
        )
        before[:] = s.theta
        clamped[:] = 0.0
        row.rewinds[0] = 0.0
        if dt > 0.0 and excited:
            for b in range(n.offsets):
                if s.squares[b] > 0.0:  # its zero is estimated
                    zero[b] = 0.0
            known_of(zero, density, plan.velocity_variance, time, errors)
            move_on(s, time)
            if method.is_kalman:
                kalman_step(
                    plan, method, n, s, row, dt, known, gradient, by_errors, errors, active, walk, learnt, target,
                    clamped,
                )  # fmt: skip
            else:
                rls_step(
                    plan, method, s, row, dt, known, gradient, by_errors, errors, active, walk, learnt, target, clamped
                )
        else:
            gradient[:, p:] = 0.0  # nothing is expected of the zero offsets' errors without an update
            row.innovation_covariance[:, :] = 0.0
            for i in range(q):
                row.innovation_covariance[i, i] = learnt[i] if learnt[i] == learnt[i] else 0.0
                row.residual_std[i] = np.sqrt(learnt[i])
        _report(plan, n, s, row, per_unit, shift, known, gradient, before, clamped)
        row.news[0] = _news(row, previous)
        last_row[:] = latest
        rows[t] = latest


@njit(cache=True, inline="always")
def _report(plan, n, s, row, per_unit, shift, known, gradient, before, clamped):
    """Write the estimate: what the parameters now predict, and how sure that is."""
    p, q = len(s.theta), len(known)
    for j in range(len(per_unit)):
        k, slot = plan.element[j], plan.slot[j]
        if slot < 0:
            row.parameters[j], row.std[j], row.status[j] = plan.value[j], 0.0, KNOWN
            continue
        row.parameters[j] = s.theta[slot]
        row.std[j] = np.sqrt(s.stated[slot, slot])
        status = ESTIMATED
        if row.state[k] == APART:
            status = SEPARATE
        elif clamped[slot]:
            status = CLAMPED
        elif plan.is_stiffness[j] and plan.unloading[k] > 0.0 and row.state[k] == UNLOADING:
            status = UNLOADS
        row.status[j] = status
    for j in range(n.estimated):
        for h in range(j + 1):
            row.covariance[j, h] = row.covariance[h, j] = s.stated[j, h]
    for i in range(q):
        predicted = expected = known[i]
        for j in range(p):
            predicted += gradient[i, j] * s.theta[j]
            expected += gradient[i, j] * before[j]
        row.predicted[i] = predicted
        row.innovation[i] = row.measured[i] - expected
        row.residual[i] = row.measured[i] - predicted
        row.innovation_std[i] = np.sqrt(row.innovation_covariance[i, i])
    for k in range(len(shift)):
        row.force[k] = shift[k]
        row.force_std[k] = 0.0
    for j in range(len(per_unit)):
        k, slot = plan.element[j], plan.slot[j]
        row.force[k] += per_unit[j] * row.parameters[j]
        for h in range(len(per_unit)):
            if slot >= 0 and plan.element[h] == k and plan.slot[h] >= 0:
                row.force_std[k] += per_unit[j] * row.covariance[slot, plan.slot[h]] * per_unit[h]
    for k in range(len(shift)):
        row.force_std[k] = np.sqrt(max(row.force_std[k], 0.0))


@njit(cache=True, inline="always")
def _news(row, previous):
    """1.0 where something is not as it was at the sample before."""
    news = row.rewinds[0]
    for k in range(len(row.state)):
        news += row.state[k] != previous.state[k]
    for j in range(len(row.status)):
        news += row.status[j] != previous.status[j]
    for i in range(len(row.measured)):
        news += np.isnan(row.measured[i]) != np.isnan(previous.measured[i])
    return min(news, 1.0)
