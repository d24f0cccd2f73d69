"""The recursion's memory as one flat array of doubles, and the rows that it writes.

One array makes a state cheap to copy, to keep as a checkpoint and to compare to the last bit. A row of output
holds one estimate; nodes publish slices of many rows as they are. Here is what the parts are called and how long they
are; `views.py` makes the compiled code's names for them.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ..estimate import ROW as QUANTITIES


class Size(NamedTuple):
    """How many there are."""

    channels: int
    accelerometers: int  # of all bodies
    bodies: int
    elements: int
    parameters: int  # known ones included
    estimated: int
    offsets: int  # errors of zero offsets that are estimated beside them: one for each body, or none
    unknowns: int  # estimated parameters, and these
    equations: int
    window: int  # m, samples that MRLS may use again


Shapes = Mapping[str, tuple[int | str, ...]]
"""Name -> its axes, each a length or what of `Size` it is as long as."""

ROW: Shapes = {
    **{name: (quantity.of,) for name, quantity in QUANTITIES.items()},
    "covariance": ("estimated", "estimated"),
    "innovation_covariance": ("equations", "equations"),
    "rewinds": (1,),  # passes of MRLS over its window at this sample
    "news": (1,),  # 1: it has an event to tell of, perhaps
}
"""One estimate, and a state's beginning; the names are those of `Estimate`, the covariance is of the estimated ones."""

STATE: Shapes = {
    "clock": (2,),  # time of the last sample after the impact in ns, -1 before; samples in the window
    "count": ("channels",),  # pre-impact samples
    "offset": ("channels",),
    "squares": ("bodies",),
    "force_squares": ("equations",),
    "displacement": ("bodies",),
    "velocity": ("bodies",),
    "acceleration": ("bodies",),
    "crush": ("elements",),
    "rate": ("elements",),
    "zero": ("elements",),  # of a measured crush
    "peak": ("elements",),
    "peak_rate": ("elements",),
    "contact": ("elements",),  # ElementState
    "theta": ("unknowns",),
    "covariance": ("estimated", "estimated"),
    "factors": ("unknowns", "unknowns"),  # of the Kalman filter's covariance, see factors.py
    "noise": ("equations",),  # R2 of the Kalman filter, slow residual variance of RLS; NaN until the first update
    "information": ("estimated", "estimated"),  # RLS from here on
    "carried": ("estimated", "estimated"),
    "error_covariance": ("equations", "equations"),
    "gamma": (1,),
    "window_gradient": ("window", "equations", "estimated"),
    "window_target": ("window", "equations"),  # measured minus known
    "window_noise": ("window", "equations"),
    "window_active": ("window", "estimated"),
    "window_dt": ("window",),
    "window_error": ("window", "equations"),
    "window_influence": ("window", "estimated", "equations"),
    "window_variance": ("window", "equations"),
    "beside": ("unknowns", "unknowns"),  # what errors of the motion add to the covariance
    "beside_shared": (3, "bodies", "unknowns"),  # its part with each body's errors: zero, velocity, displacement
    "beside_time": (1,),  # s since the impact
    "stated": ("estimated", "estimated"),  # the covariance with it, and with the lag
    "walking": ("estimated",),  # RLS: theta of the filter beside it that lets it walk; `factors` are that filter's
    "walking_noise": ("equations",),
    "walking_beside": ("estimated", "estimated"),
    "walking_shared": (3, "bodies", "estimated"),
}
"""What else the recursion remembers after a sample."""

SCRATCH: Shapes = {
    "by_errors": (3, "equations", "bodies"),
    "errors": ("bodies", 7),
    "zero": ("bodies",),
    "density": ("bodies",),
    "clean": ("channels",),
    "now": ("bodies",),
    "lever": ("elements",),
    "shift": ("elements",),
    "per_unit": ("parameters",),
    "known": ("equations",),
    "gradient": ("equations", "unknowns"),
    "learnt": ("equations",),
    "target": ("equations",),
    "active": ("unknowns",),
    "walk": ("estimated",),
    "clamped": ("unknowns",),
    "before": ("unknowns",),
    "through": ("equations", "unknowns"),
    "gain": ("unknowns", "equations"),
    "seen": ("unknowns",),
    "unit": ("unknowns",),
    "unfiltered": ("unknowns",),
    "spread": ("equations", "equations"),
    "error": ("equations",),
    "held": ("unknowns",),  # of the filter beside RLS
}
"""Room for what is computed anew at every sample."""


def shapes(parts: Shapes, size: Size) -> dict[str, tuple[int, ...]]:
    """Name -> shape."""
    return {
        name: tuple(axis if isinstance(axis, int) else getattr(size, axis) for axis in axes)
        for name, axes in parts.items()
    }


def slices(parts: Shapes, size: Size) -> dict[str, slice]:
    """Name -> its place in the flat array."""
    places, start = {}, 0
    for name, shape in shapes(parts, size).items():
        stop = start + int(np.prod(shape))
        places[name] = slice(start, stop)
        start = stop
    return places


def length(parts: Shapes, size: Size) -> int:
    return sum(int(np.prod(shape)) for shape in shapes(parts, size).values())
