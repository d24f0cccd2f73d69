"""Where a fit of the live ranking starts: at what the same model was fitted by at the update before.

Between two updates a few samples are new, and the crushes met may have grown: the knots of the curves move, the
parameters keep their meaning. The motion goes on as it was fitted, and as it is measured where it is new.
"""

from collections.abc import Sequence

import numpy as np

from .curves import value
from .fit import Fit
from .layout import Layout
from .motion import measured_motion, motion_of
from .propagate import FREE
from .records import DRIVEN_MODES, Record
from .trajectory import Trajectory


def carried_on(
    last: Fit, before: Sequence[Record], layout: Layout, records: Sequence[Record]
) -> tuple[np.ndarray, list[Trajectory]]:
    """Start of a fit of `layout` to records, from a fit of the same additions to the records of the update before."""
    theta = _parameters(last, layout)
    starts = zip(records, before, last.trajectories)
    return theta, [_motion(layout, r, theta, record, old.time, a) for r, (record, old, (a, _, _)) in enumerate(starts)]


def _parameters(last: Fit, layout: Layout) -> np.ndarray:
    theta, old = layout.start.copy(), last.layout
    curves = {link.name: link.curve for link in old.links}
    for link in layout.links:
        if link.curve is not None:
            here = link.curve.column >= 0
            theta[link.curve.column[here]] = value(curves[link.name], last.theta, link.curve.knots[here])
    theta[layout.knots : layout.common] = last.theta[old.knots : old.common]
    for r, first in enumerate(layout.offsets):
        outputs = np.arange(len(layout.outputs))
        theta[first + outputs] = last.theta[old.offsets[r] + outputs]
        for body, mode in layout.modes[r].items():
            modes = np.arange(DRIVEN_MODES + 1)
            theta[mode + modes] = last.theta[old.modes[r][body] + modes]
    return np.clip(theta, layout.prior.low, layout.prior.high)


def _motion(layout: Layout, r: int, theta, record: Record, time: np.ndarray, a: np.ndarray) -> Trajectory:
    """The fitted accelerations a (g, b) of the instants before, then the measured ones."""
    if len(time) == len(record.time) and np.array_equal(time, record.time):
        return motion_of(layout, record, r, theta, a)
    free = measured_motion(layout, record, r, theta).a.copy()
    known = record.time <= time[-1]
    for k in np.flatnonzero(layout.kind == FREE):
        free[known, k] = np.interp(record.time[known], time, a[:, k])
    return motion_of(layout, record, r, theta, free)
