"""The simulation of a problem at given parameters: Newton's method on the whole motion, until it obeys them."""

from collections.abc import Sequence

import numpy as np

from ..mechanics.linearization import linearise
from ..observation.trajectory import Trajectory
from .gauss_newton import advance
from .normal_equations import may_diverge
from .problem import OutputErrorProblem, Point

MOST_STEPS = 8
"""Newton's method squares the error in each; a contact that opens at another instant takes one or two more."""

CONVERGED = 1e-6
"""Change of the accelerations, as a share of the largest, at which a simulation is done."""


@may_diverge
def simulate(problem: OutputErrorProblem, theta: np.ndarray, start: Sequence[Trajectory]) -> Point:
    """theta (p,); start: motions to begin with, one for each recording."""
    still, motions = np.zeros(problem.layout.size), []
    for experiment, motion in zip(problem.experiments, problem.moved(theta, start).trajectories, strict=True):
        moved = motion
        for _ in range(MOST_STEPS):
            last = moved
            moved = advance(experiment, theta, still, last, linearise(experiment, theta, last))
            if np.abs(moved.a - last.a).max() < CONVERGED * np.abs(moved.a).max():
                break
        motions.append(moved)
    return Point(theta, motions)
