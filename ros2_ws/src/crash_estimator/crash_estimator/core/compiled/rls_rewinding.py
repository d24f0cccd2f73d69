"""The window of MRLS, and its samples used again: `estimators/rls.py` as loops."""

import numpy as np
from numba import njit

from .rls_correction import add_influence, correct, covariance_of, recursion_of
from .short_loops import short_loops


@njit(cache=True)
def chosen_variance(s, out):
    """m E[(mean v)^2 | mean error] of a window that is used again, for each equation."""
    short_loops()
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


@njit(cache=True)
def rewind(limits, method, walks, s, by_errors, errors, clamped, excess):
    """Use the window again with the larger correction while that lessens the mean error -> passes made.

    excess: of that mean over its limit, as it is.
    """
    short_loops()
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
