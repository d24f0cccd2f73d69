"""What a diagnosis has found, simulated on another recording of the same system: nothing is fitted to that one."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from crash_replay.recording import Recording

from ...derived_motion import with_accelerations
from ...structure import Structure
from ..mechanics.linearization import linearise
from ..mechanics.outputs import predicted
from ..observation.record import observe
from ..output_error.problem import make_problem
from ..output_error.simulation import simulate
from ..parameterization.magnitudes import measure_magnitudes
from .diagnosis import Diagnosis


class Predicted(NamedTuple):
    """n samples of q outputs, SI."""

    time: np.ndarray  # (n,) s since the impact
    channels: tuple[str, ...]  # (q,)
    measured: np.ndarray  # (n, q), NaN where not valid
    predicted: np.ndarray  # (n, q), from the initial motion alone; zero offsets as where it was found

    def error(self, after: float = 0.0) -> np.ndarray:
        """(q,) RMS of measured minus predicted, over the samples after so many s."""
        return np.sqrt(np.nanmean((self.measured - self.predicted)[self.time > after] ** 2, axis=0))


def predict(found: Diagnosis, recording: Recording) -> Predicted:
    """The model with all that was named; its stiffnesses have to be constants, since a curve reaches only over the
    crushes that it was found on."""
    fitted = found.models[-1].fit
    layout = fitted.layout
    record = observe(layout.structure, with_accelerations(_as_given(layout.structure), [recording])[1][0])
    additions = [term.addition for term in layout.terms]
    magnitudes = measure_magnitudes(layout.structure, [record])
    problem = make_problem(magnitudes, [record], additions)
    outputs = np.arange(len(layout.outputs))
    theta = problem.layout.start.copy()
    theta[: problem.layout.common] = fitted.theta[: layout.common]
    theta[problem.layout.offsets[0] + outputs] = fitted.theta[layout.offsets[0] + outputs]
    point = simulate(problem, theta, problem.measured(theta).trajectories)
    (experiment,), (motion,) = problem.experiments, point.trajectories
    shown = predicted(experiment, theta, linearise(experiment, theta, motion).rows, motion)[record.at]
    return Predicted(record.time[record.at], tuple(o.channel for o in layout.outputs), record.measured, shown)


def _as_given(structure: Structure) -> Structure:
    bodies = (replace(b, acceleration=(), derived=False) if b.derived else b for b in structure.bodies)
    return replace(structure, bodies=tuple(bodies))
