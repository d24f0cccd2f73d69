"""The recursion's memory as one flat array of doubles, and the rows that it writes.

One array makes a state cheap to copy, to keep as a checkpoint and to compare to the last bit. A row of output
holds one estimate; nodes publish slices of many rows as they are.
"""

from typing import NamedTuple

import numpy as np


class Size(NamedTuple):
    """How many there are."""

    channels: int
    bodies: int
    elements: int
    parameters: int  # known ones included
    estimated: int
    offsets: int  # errors of zero offsets that are estimated beside them: one for each body, or none
    equations: int
    window: int  # m, samples that MRLS may use again


def state_fields(size: Size) -> dict[str, tuple[int, ...]]:
    """Name -> shape of everything that the recursion remembers after a sample."""
    c, b, e, _, p, n, q, m = size
    return {
        "clock": (2,),  # time of the last sample after the impact in ns, -1 before; samples in the window
        "count": (c,),  # pre-impact samples
        "offset": (c,),
        "squares": (b,),
        "force_squares": (q,),
        "displacement": (b,),
        "velocity": (b,),
        "acceleration": (b,),
        "crush": (e,),
        "rate": (e,),
        "peak": (e,),
        "peak_rate": (e,),
        "contact": (e,),  # ElementState
        "theta": (p + n,),  # the estimated parameters only, here and below, and the errors of the zero offsets
        "covariance": (p, p),
        "factors": (p + n, p + n),  # of the Kalman filter's covariance, see factors.py
        "noise": (q,),  # R2 of the Kalman filter, slow residual variance of RLS; NaN until the first update
        "information": (p, p),  # RLS from here on
        "carried": (p, p),
        "error_covariance": (q, q),
        "gamma": (1,),
        "window_gradient": (m, q, p),
        "window_target": (m, q),  # measured minus known
        "window_noise": (m, q),
        "window_active": (m, p),
        "window_dt": (m,),
        "window_error": (m, q),
        "window_influence": (m, p, q),
        "window_variance": (m, q),
        "beside": (p + n, p + n),  # what errors of the motion add to the covariance
        "beside_shared": (3, b, p + n),  # its part with each body's errors: zero, velocity, displacement
        "beside_time": (1,),  # s since the impact
        "stated": (p, p),  # the covariance with it, and with the lag
        "walking": (p,),  # RLS: theta of the filter beside it that lets it walk; `factors` are that filter's
        "walking_noise": (q,),
        "walking_beside": (p, p),
        "walking_shared": (3, b, p),
    }


def row_fields(size: Size) -> dict[str, tuple[int, ...]]:
    """Name -> shape of one estimate; the names are those of `Estimate`, the covariance that of the estimated ones."""
    _, b, e, all_p, p, _, q, _ = size
    return {
        "parameters": (all_p,),
        "std": (all_p,),
        "status": (all_p,),
        "measured": (q,),
        "predicted": (q,),
        "innovation": (q,),
        "innovation_std": (q,),
        "residual": (q,),
        "residual_std": (q,),
        "crush": (e,),
        "rate": (e,),
        "force": (e,),
        "force_std": (e,),
        "state": (e,),
        "displacement": (b,),
        "velocity": (b,),
        "acceleration": (b,),
        "covariance": (p, p),
        "innovation_covariance": (q, q),
        "rewinds": (1,),  # passes of MRLS over its window at this sample
        "news": (1,),  # 1: it has an event to tell of, perhaps
    }


def slices(fields: dict[str, tuple[int, ...]]) -> dict[str, slice]:
    """Name -> its place in the flat array."""
    places, start = {}, 0
    for name, shape in fields.items():
        stop = start + int(np.prod(shape))
        places[name] = slice(start, stop)
        start = stop
    return places


def length(fields: dict[str, tuple[int, ...]]) -> int:
    return sum(int(np.prod(shape)) for shape in fields.values())
