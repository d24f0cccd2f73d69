"""Motion, contact and regression of one sample: `kinematics.py`, `contact.py` and `regression.py` as loops."""

import numpy as np
from numba import njit

from ..contact import REVERSAL
from ..estimate import ElementState
from ..kinematics import FEWEST, RATE_SMOOTHING, STANDS
from ..regression import QUIETEST, SHORTEST_CRUSH
from ..regressor_errors import HIDDEN

LOADING, UNLOADING, APART = (float(state) for state in ElementState)


@njit(cache=True, inline="always")
def move(plan, s, row, time_ns, raw, w):
    """Integrate the bodies' motion and the elements' crush by one sample -> dt in s (0 before the impact).

    Writes the motion to the state and to the row; w: `layout.SCRATCH`.
    """
    values, bodies_now = w.clean, w.now
    before = time_ns < 0
    if before:
        for c in range(len(raw)):
            if raw[c] == raw[c]:
                s.count[c] += 1.0
                s.offset[c] += (raw[c] - s.offset[c]) / s.count[c]
    for c in range(len(raw)):
        values[c] = raw[c] - s.offset[c] if plan.has_offset[c] else raw[c]
    started = s.clock[0] >= 0.0
    dt = 0.0 if before else (time_ns - max(s.clock[0], 0.0)) * 1e-9
    for k in range(len(bodies_now)):
        first, last = plan.first_channel[k], plan.last_channel[k]
        total, valid = 0.0, 0
        for j in range(first, last):
            value = values[plan.body_channels[j]]
            if value == value:
                total += value
                valid += 1
        measured = total / valid if valid else (np.nan if last > first else 0.0)
        bodies_now[k] = measured
        if before:
            s.displacement[k] = plan.initial_displacement[k]
            row.displacement[k] = plan.initial_displacement[k] + plan.initial_velocity[k] * (time_ns * 1e-9)
            if measured == measured:
                s.squares[k] += measured**2
        else:
            now = measured if measured == measured else s.acceleration[k]
            then = s.acceleration[k] if started else now
            s.displacement[k] = s.displacement[k] + dt * s.velocity[k] + dt * dt * (2.0 * then + now) / 6.0
            s.velocity[k] = s.velocity[k] + 0.5 * dt * (then + now)
            s.acceleration[k] = now
            row.displacement[k] = s.displacement[k]
        row.velocity[k] = s.velocity[k]
        row.acceleration[k] = measured
    if not before:
        s.clock[0] = time_ns
    for k in range(len(plan.unloading)):
        a, b = plan.ends[k, 0], plan.ends[k, 1]
        crush = row.displacement[a] - row.displacement[b]
        rate = row.velocity[a] - row.velocity[b]
        column = plan.crush_channel[k]
        if column >= 0:
            if before and values[column] == values[column]:
                mean = s.offset[column]
                stands = abs(values[column] - mean) <= STANDS * abs(mean)
                s.zero[k] = mean if stands and (mean > 0.0 or not plan.compression_only[k]) else 0.0
            crush = values[column] - s.zero[k] if values[column] == values[column] else s.crush[k]
            if plan.rate_channel[k] < 0:
                slope = (crush - s.crush[k]) / dt if dt > 0.0 else 0.0
                rate = s.rate[k] + (slope - s.rate[k]) * dt / (dt + RATE_SMOOTHING)
        column = plan.rate_channel[k]
        if column >= 0:
            rate = values[column] if values[column] == values[column] else s.rate[k]
        s.crush[k] = row.crush[k] = crush
        s.rate[k] = row.rate[k] = rate
    for i in range(len(plan.equation_body)):
        body = plan.equation_body[i]
        row.measured[i] = bodies_now[body] if body >= 0 else values[plan.force_channel[i]]
        if before and row.measured[i] == row.measured[i]:
            s.force_squares[i] += row.measured[i] ** 2
    return dt


@njit(cache=True, inline="always")
def touch(plan, s, row, time, w):
    """Loading, unloading or apart; the springs' force is K lever + shift."""
    lever, shift = w.lever, w.shift
    for k in range(len(lever)):
        if time < 0.0:
            lever[k] = shift[k] = 0.0
            row.state[k] = APART
            continue
        crush = row.crush[k]
        s.peak[k] = max(s.peak[k], crush)
        plastic = plan.unloading[k] > 0.0
        on_line = plastic and crush < s.peak[k]
        lever[k] = s.peak[k] if on_line else crush
        shift[k] = plan.unloading[k] * (crush - s.peak[k]) if on_line else 0.0
        stiffness = value_of(plan.value, plan.slot, s.theta, plan.stiffness[k])
        spent = on_line and stiffness * lever[k] + shift[k] <= 0.0
        s.peak_rate[k] = max(s.peak_rate[k], abs(row.rate[k]))
        still = abs(row.rate[k]) <= REVERSAL * s.peak_rate[k]
        turned = s.contact[k] == UNLOADING if still else row.rate[k] < 0.0
        state = LOADING
        if plan.compression_only[k] and (crush <= 0.0 or spent):
            state = APART
            lever[k] = shift[k] = 0.0
        elif on_line or (not plastic and turned):
            state = UNLOADING
        s.contact[k] = row.state[k] = state


@njit(cache=True, inline="always")
def regress(plan, s, row, n, dt, time, w):
    """Fill the regression of this sample -> whether it says anything about an estimated parameter.

    per_unit (all,) is each parameter's force for one unit of it, by_errors (3, q, b) each equation's change for an
    error of a body's zero, velocity and displacement; the others are as in `regression.Regression`, gradient with the
    offsets' columns at its end.
    """
    lever, shift, per_unit, known, gradient = w.lever, w.shift, w.per_unit, w.known, w.gradient
    by_errors, errors, active, walk, noise = w.by_errors, w.errors, w.active, w.walk, w.learnt
    q = len(known)
    before_impact = s.count.max() if len(s.count) else 0.0
    for i in range(q):
        body = plan.equation_body[i]
        squares = s.squares[body] if body >= 0 else s.force_squares[i]
        learnt = squares / before_impact if before_impact >= FEWEST else np.nan
        variance = learnt if np.isnan(plan.given_noise[i]) else plan.given_noise[i]
        noise[i] = max(variance, QUIETEST**2) if variance == variance else np.nan
        known[i] = 0.0
        for k in range(len(shift)):
            known[i] += plan.share[i, k] * shift[k]
    excited = False
    gradient[:, :] = 0.0
    for j in range(len(per_unit)):
        k, slot = plan.element[j], plan.slot[j]
        carries = row.state[k] != APART
        per_unit[j] = lever[k] if plan.is_stiffness[j] else (row.rate[k] if carries else 0.0)
        if slot < 0:
            for i in range(q):
                known[i] += plan.share[i, k] * per_unit[j] * plan.value[j]
            continue
        walk[slot] = active[slot] = 0.0
        if not carries:
            continue
        spread = 0.0
        for end in range(2):
            b = plan.ends[k, end]
            spread += plan.crush_of_body[k, b] ** 2 * errors[b, 5]
        if plan.is_stiffness[j] and abs(lever[k]) < HIDDEN * np.sqrt(spread):
            for i in range(q):
                gradient[i, slot] = plan.share[i, k] * per_unit[j]
            continue
        active[slot] = 1.0
        on_line = plan.unloading[k] > 0.0 and row.state[k] == UNLOADING
        if not on_line:
            folds = abs(row.rate[k]) * dt / max(abs(row.crush[k]), SHORTEST_CRUSH)
            walk[slot] = plan.drift_squared[slot] * folds
        for i in range(q):
            gradient[i, slot] = plan.share[i, k] * per_unit[j]
            if gradient[i, slot] != 0.0 and row.measured[i] == row.measured[i]:
                excited = True
    gradient[:, n.estimated :] = plan.own_offset[:, : n.offsets]
    by_errors[0] = plan.own_offset
    by_errors[1:] = 0.0
    for k in range(len(shift)):
        if row.state[k] == APART:
            continue
        slope = likely_slope = plan.unloading[k]
        if row.state[k] != UNLOADING or not plan.unloading[k] > 0.0:
            slope = value_of(plan.value, plan.slot, s.theta, plan.stiffness[k])
            likely_slope = likely(slope, plan.slot, s, plan.stiffness[k])
        damping = value_of(plan.value, plan.slot, s.theta, plan.damping[k])
        likely_damping = likely(damping, plan.slot, s, plan.damping[k])
        for end in range(2):
            b = plan.ends[k, end]
            sign = plan.crush_of_body[k, b]
            if sign != 0.0:
                for i in range(q):
                    by_errors[1, i, b] -= plan.share[i, k] * likely_damping * sign
                    by_errors[2, i, b] -= plan.share[i, k] * likely_slope * sign
                    if b < n.offsets:
                        moved = 0.5 * time**2 * slope + time * damping
                        gradient[i, n.estimated + b] -= plan.share[i, k] * moved * sign
    return excited


@njit(cache=True, inline="always")
def value_of(value, slot, theta, j):
    """The parameter's known or latest value."""
    return value[j] if slot[j] < 0 else theta[slot[j]]


@njit(cache=True, inline="always")
def likely(value, slot, s, j):
    """The parameter's root mean square, with the sign of its latest value."""
    k = slot[j]
    return value if k < 0 else np.copysign(np.sqrt(value**2 + s.stated[k, k]), value)
