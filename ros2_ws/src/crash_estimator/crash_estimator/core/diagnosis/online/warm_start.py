"""Where a fit of the live ranking starts: at what the same model was fitted by at the update before.

Between two updates a few samples are new, and the crushes met may have grown: the knots of the curves move, the
parameters keep their meaning. The motion goes on as it was fitted, and as it is measured where it is new.
"""

import numpy as np

from ..mechanics.driven_motion import measured_motion, motion_of
from ..observation.trajectory import Trajectory
from ..output_error.gauss_newton import Fit
from ..output_error.problem import OutputErrorProblem, Point
from ..parameterization.free_curve import value
from ..parameterization.layout import FREE, Experiment, Layout


def carried_on(last: Fit, problem: OutputErrorProblem) -> Point:
    """Start of a fit, from one of the same additions to the records of the update before."""
    theta = _parameters(last, problem.layout)
    each = zip(problem.experiments, last.problem.records, last.trajectories, strict=True)
    return Point(theta, [_motion(experiment, theta, old.time, motion.a) for experiment, old, motion in each])


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
        for body, modes in layout.modes[r].items():
            theta[modes] = last.theta[old.modes[r][body]]
    return np.clip(theta, layout.prior.low, layout.prior.high)


def _motion(experiment: Experiment, theta: np.ndarray, time: np.ndarray, a: np.ndarray) -> Trajectory:
    """The fitted accelerations a (g, b) of the instants before, then the measured ones."""
    now = experiment.record.time
    if len(time) == len(now) and np.array_equal(time, now):
        return motion_of(experiment, theta, a)
    free = measured_motion(experiment, theta).a.copy()
    known = now <= time[-1]
    for k in np.flatnonzero(experiment.layout.kind == FREE):
        free[known, k] = np.interp(now[known], time, a[:, k])
    return motion_of(experiment, theta, free)
