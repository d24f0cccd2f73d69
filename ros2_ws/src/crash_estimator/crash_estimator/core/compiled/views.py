"""Named views of the flat arrays, in the order of `layout.py` (a test holds the two together)."""

from typing import NamedTuple

import numpy as np
from numba import njit

from .layout import Size
from .plan import MethodPlan, Plan


class StateViews(NamedTuple):
    clock: np.ndarray
    count: np.ndarray
    offset: np.ndarray
    squares: np.ndarray
    force_squares: np.ndarray
    displacement: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    crush: np.ndarray
    rate: np.ndarray
    peak: np.ndarray
    peak_rate: np.ndarray
    contact: np.ndarray
    theta: np.ndarray
    covariance: np.ndarray
    factors: np.ndarray
    noise: np.ndarray
    information: np.ndarray
    carried: np.ndarray
    error_covariance: np.ndarray
    gamma: np.ndarray
    window_gradient: np.ndarray
    window_target: np.ndarray
    window_noise: np.ndarray
    window_active: np.ndarray
    window_dt: np.ndarray
    window_error: np.ndarray
    window_influence: np.ndarray
    window_variance: np.ndarray
    beside: np.ndarray
    beside_shared: np.ndarray
    beside_time: np.ndarray
    stated: np.ndarray
    walking: np.ndarray
    walking_noise: np.ndarray
    walking_beside: np.ndarray
    walking_shared: np.ndarray


class RowViews(NamedTuple):
    parameters: np.ndarray
    std: np.ndarray
    status: np.ndarray
    measured: np.ndarray
    predicted: np.ndarray
    innovation: np.ndarray
    innovation_std: np.ndarray
    residual: np.ndarray
    residual_std: np.ndarray
    crush: np.ndarray
    rate: np.ndarray
    force: np.ndarray
    force_std: np.ndarray
    state: np.ndarray
    displacement: np.ndarray
    velocity: np.ndarray
    acceleration: np.ndarray
    covariance: np.ndarray
    innovation_covariance: np.ndarray
    rewinds: np.ndarray
    news: np.ndarray


@njit(cache=True, inline="always")
def cuts(sizes):
    """Where each part starts, and the end of the last."""
    k = np.zeros(len(sizes) + 1, dtype=np.int64)
    for i in range(len(sizes)):
        k[i + 1] = k[i] + sizes[i]
    return k


@njit(cache=True, inline="always")
def state_views(s, n):
    c, b, e, q, m = n.channels, n.bodies, n.elements, n.equations, n.window
    p = n.estimated
    w = n.estimated + n.offsets
    k = cuts((
        2, c, c, b, q, b, b, b, e, e, e, e, e, w, p * p, w * w, q, p * p, p * p, q * q, 1,
        m * q * p, m * q, m * q, m * p, m, m * q, m * p * q, m * q, w * w, 3 * b * w, 1, p * p, p, q,
        p * p, 3 * b * p,
    ))  # fmt: skip
    return StateViews(
        s[k[0] : k[1]],  # clock
        s[k[1] : k[2]],  # count
        s[k[2] : k[3]],  # offset
        s[k[3] : k[4]],  # squares
        s[k[4] : k[5]],  # force_squares
        s[k[5] : k[6]],  # displacement
        s[k[6] : k[7]],  # velocity
        s[k[7] : k[8]],  # acceleration
        s[k[8] : k[9]],  # crush
        s[k[9] : k[10]],  # rate
        s[k[10] : k[11]],  # peak
        s[k[11] : k[12]],  # peak_rate
        s[k[12] : k[13]],  # contact
        s[k[13] : k[14]],  # theta
        s[k[14] : k[15]].reshape((p, p)),  # covariance
        s[k[15] : k[16]].reshape((w, w)),  # factors
        s[k[16] : k[17]],  # noise
        s[k[17] : k[18]].reshape((p, p)),  # information
        s[k[18] : k[19]].reshape((p, p)),  # carried
        s[k[19] : k[20]].reshape((q, q)),  # error_covariance
        s[k[20] : k[21]],  # gamma
        s[k[21] : k[22]].reshape((m, q, p)),  # window_gradient
        s[k[22] : k[23]].reshape((m, q)),  # window_target
        s[k[23] : k[24]].reshape((m, q)),  # window_noise
        s[k[24] : k[25]].reshape((m, p)),  # window_active
        s[k[25] : k[26]],  # window_dt
        s[k[26] : k[27]].reshape((m, q)),  # window_error
        s[k[27] : k[28]].reshape((m, p, q)),  # window_influence
        s[k[28] : k[29]].reshape((m, q)),  # window_variance
        s[k[29] : k[30]].reshape((w, w)),  # beside
        s[k[30] : k[31]].reshape((3, b, w)),  # beside_shared
        s[k[31] : k[32]],  # beside_time
        s[k[32] : k[33]].reshape((p, p)),  # stated
        s[k[33] : k[34]],  # walking
        s[k[34] : k[35]],  # walking_noise
        s[k[35] : k[36]].reshape((p, p)),  # walking_beside
        s[k[36] : k[37]].reshape((3, b, p)),  # walking_shared
    )


@njit(cache=True, inline="always")
def row_views(r, n):
    a, b, e, p, q = n.parameters, n.bodies, n.elements, n.estimated, n.equations
    k = cuts((a, a, a, q, q, q, q, q, q, e, e, e, e, e, b, b, b, p * p, q * q, 1, 1))
    return RowViews(
        r[k[0] : k[1]],  # parameters
        r[k[1] : k[2]],  # std
        r[k[2] : k[3]],  # status
        r[k[3] : k[4]],  # measured
        r[k[4] : k[5]],  # predicted
        r[k[5] : k[6]],  # innovation
        r[k[6] : k[7]],  # innovation_std
        r[k[7] : k[8]],  # residual
        r[k[8] : k[9]],  # residual_std
        r[k[9] : k[10]],  # crush
        r[k[10] : k[11]],  # rate
        r[k[11] : k[12]],  # force
        r[k[12] : k[13]],  # force_std
        r[k[13] : k[14]],  # state
        r[k[14] : k[15]],  # displacement
        r[k[15] : k[16]],  # velocity
        r[k[16] : k[17]],  # acceleration
        r[k[17] : k[18]].reshape((p, p)),  # covariance
        r[k[18] : k[19]].reshape((q, q)),  # innovation_covariance
        r[k[19] : k[20]],  # rewinds
        r[k[20] : k[21]],  # news
    )


@njit(cache=True, inline="always")
def size_of(whole):
    return Size(whole[0], whole[1], whole[2], whole[3], whole[4], whole[5], whole[6], whole[7])


@njit(cache=True, inline="always")
def method_of(others):
    m = others
    return MethodPlan(m[0] != 0.0, m[1] != 0.0, m[2], m[3], m[4], m[5], m[6], m[7], int(m[8]), m[9])


@njit(cache=True, inline="always")
def plan_views(whole, others, n):
    i, x = whole[8:], others[10:]
    a, b, e, p, q = n.parameters, n.bodies, n.elements, n.estimated, n.equations
    k = cuts((b + 1, n.channels, 2 * e, e, e, q, q, e, a, a, a, e, e))
    h = cuts((b, b, q * e, e, a, q, p, p, p, p, p, p, q * b, e * b, b))
    return Plan(
        i[k[0] : k[1]],  # first_channel
        i[k[1] : k[2]],  # has_offset
        i[k[2] : k[3]].reshape((e, 2)),  # ends
        i[k[3] : k[4]],  # crush_channel
        i[k[4] : k[5]],  # rate_channel
        i[k[5] : k[6]],  # equation_body
        i[k[6] : k[7]],  # force_channel
        i[k[7] : k[8]],  # compression_only
        i[k[8] : k[9]],  # element
        i[k[9] : k[10]],  # is_stiffness
        i[k[10] : k[11]],  # slot
        i[k[11] : k[12]],  # stiffness
        i[k[12] : k[13]],  # damping
        i[k[13] :],  # body_channels
        x[h[0] : h[1]],  # initial_displacement
        x[h[1] : h[2]],  # initial_velocity
        x[h[2] : h[3]].reshape((q, e)),  # share
        x[h[3] : h[4]],  # unloading
        x[h[4] : h[5]],  # value
        x[h[5] : h[6]],  # given_noise
        x[h[6] : h[7]],  # drift_squared
        x[h[7] : h[8]],  # initial
        x[h[8] : h[9]],  # std
        x[h[9] : h[10]],  # lower
        x[h[10] : h[11]],  # upper
        x[h[11] : h[12]],  # scale
        x[h[12] : h[13]].reshape((q, b)),  # own_offset
        x[h[13] : h[14]].reshape((e, b)),  # crush_of_body
        x[h[14] : h[15]],  # velocity_variance
    )
