"""One sample, or a whole record, through the compiled recursion."""

import numpy as np
from numba import njit

from ..estimate import ParameterStatus
from .kalman import kalman_step
from .motion import APART, UNLOADING, move, regress, touch
from .regressor_errors import known_of, move_on, sensors_of
from .rls import rls_step
from .short_loops import short_loops
from .views import method_of, plan_views, row_views, scratch_views, size_of, state_views

ESTIMATED, KNOWN, UNLOADS, SEPARATE, CLAMPED, _ = (float(status) for status in ParameterStatus)


@njit(cache=True)
def follow(whole, others, state, times_ns, values, rows):
    """Fold (k, c) values at (k,) times through the method; `rows` (k, ...) are filled.

    `state`, which begins with the row before them, is changed in place.
    """
    short_loops()
    n, method = size_of(whole), method_of(others)
    plan = plan_views(whole[len(n) :], others[len(method) :], n)
    s = state_views(state[rows.shape[1] :], n)
    latest, last_row = np.zeros(rows.shape[1]), state[: rows.shape[1]]
    row, previous, w = row_views(latest, n), row_views(last_row, n), scratch_views(n)
    w.active[:] = 1.0
    for t in range(len(times_ns)):
        time = times_ns[t] * 1e-9
        dt = move(plan, s, row, times_ns[t], values[t], w)
        touch(plan, s, row, time, w)
        sensors_of(plan, s, w.zero, w.density, dt)
        known_of(w.zero, w.density, plan.velocity_variance, time, w.errors)
        excited = regress(plan, s, row, n, dt, time, w)
        w.before[:] = s.theta
        w.clamped[:] = 0.0
        row.rewinds[0] = 0.0
        if dt > 0.0 and excited:
            if n.offsets:
                for b in range(n.offsets):
                    if s.squares[b] > 0.0:  # its zero is estimated
                        w.zero[b] = 0.0
                known_of(w.zero, w.density, plan.velocity_variance, time, w.errors)
            if method.is_kalman:
                move_on(s, s.beside_shared, time)
                kalman_step(plan, method, n, s, row, dt, w)
            else:
                rls_step(plan, method, s, row, dt, time, w)
        else:
            w.gradient[:, n.estimated :] = 0.0  # nothing is expected of the zero offsets' errors without an update
            row.innovation_covariance[:, :] = 0.0
            for i in range(n.equations):
                row.innovation_covariance[i, i] = w.learnt[i] if w.learnt[i] == w.learnt[i] else 0.0
                row.residual_std[i] = np.sqrt(w.learnt[i])
        _report(plan, n, s, row, w)
        row.news[0] = _news(row, previous)
        last_row[:] = latest
        rows[t] = latest


@njit(cache=True)
def step(whole, others, before, after, time_ns, values, row):
    """`follow` for one sample of (c,) values: fills the state after it, which begins with its row of that length."""
    short_loops()
    after[:] = before
    times = np.empty(1, dtype=np.int64)
    times[0] = time_ns
    follow(whole, others, after, times, values.reshape((1, len(values))), after[:row].reshape((1, row)))


@njit(cache=True, inline="always")
def _report(plan, n, s, row, w):
    """Write the estimate: what the parameters now predict, and how sure that is."""
    per_unit, shift, known, gradient, before, clamped = w.per_unit, w.shift, w.known, w.gradient, w.before, w.clamped
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
        if slot < 0 or per_unit[j] == 0.0:
            continue
        for h in range(len(per_unit)):
            if plan.element[h] == k and plan.slot[h] >= 0:
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
