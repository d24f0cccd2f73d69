"""Named views of the flat arrays, in the order of `layout.py` (a test holds the two together)."""

from typing import NamedTuple

import numpy as np
from numba import njit


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


@njit(cache=True)
def cuts(sizes):
    """Where each part starts, and the end of the last."""
    k = np.zeros(len(sizes) + 1, dtype=np.int64)
    for i in range(len(sizes)):
        k[i + 1] = k[i] + sizes[i]
    return k


@njit(cache=True)
def state_views(s, n):
    c, b, e, q, m = n.channels, n.bodies, n.elements, n.equations, n.window
    p = n.estimated
    w = n.estimated + n.offsets
    k = cuts((2, c, c, b, q, b, b, b, e, e, e, e, e, p, w * w, q, p * p, p * p, q * q, 1, m * q * p, m * q, m * q, m * p, m, m * q, m * p * q, m * q))
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
        s[k[14] : k[15]].reshape((w, w)),  # covariance
        s[k[15] : k[16]],  # noise
        s[k[16] : k[17]].reshape((p, p)),  # information
        s[k[17] : k[18]].reshape((p, p)),  # carried
        s[k[18] : k[19]].reshape((q, q)),  # error_covariance
        s[k[19] : k[20]],  # gamma
        s[k[20] : k[21]].reshape((m, q, p)),  # window_gradient
        s[k[21] : k[22]].reshape((m, q)),  # window_target
        s[k[22] : k[23]].reshape((m, q)),  # window_noise
        s[k[23] : k[24]].reshape((m, p)),  # window_active
        s[k[24] : k[25]],  # window_dt
        s[k[25] : k[26]].reshape((m, q)),  # window_error
        s[k[26] : k[27]].reshape((m, p, q)),  # window_influence
        s[k[27] : k[28]].reshape((m, q)),  # window_variance
    )


@njit(cache=True)
def row_views(r, n):
    a, b, e, p, q = n.parameters, n.bodies, n.elements, n.estimated, n.equations
    k = cuts((a, a, a, q, q, q, q, q, q, e, e, e, e, e, b, b, b, p * p, q * q, 1))
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
    )
