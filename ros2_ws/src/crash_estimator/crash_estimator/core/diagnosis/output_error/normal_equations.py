"""Normal equations of the output error, linearised along a trajectory that need not be a simulation yet."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit

from ... import compile_cache as _compile_cache  # noqa: F401  before any compiled function is defined
from ..mechanics.driven_motion import measured_motion
from ..mechanics.linearization import Equations, Observer, OtherLaw, linearise
from ..mechanics.outputs import by_channel_errors, output_noise, predicted
from ..observation.grid import binned
from ..observation.record import ObservedRecord
from ..observation.trajectory import Trajectory
from ..parameterization.layout import FREE, Experiment
from .continuation import FREE_RUN, Stage
from .problem import OutputErrorProblem, Point
from .sensitivity_equations import propagate

may_diverge = np.errstate(over="ignore", invalid="ignore", divide="ignore")
"""A trial step can lead into motions without bounds; `gauss_newton.solve` notices that its result is not finite."""


class Normal(NamedTuple):
    """Whitened residual and its derivative at one parameter vector, summed up: cost(d) = c - 2 b d + d A d."""

    matrix: np.ndarray  # (p, p)
    vector: np.ndarray  # (p,)
    cost: float  # sum of squares of the whitened residual
    samples: int
    grown: float  # 2 sum of ln(noise with that of measured inertias / noise): what louder noise costs in likelihood

    def with_more(self, columns: np.ndarray, out: np.ndarray) -> "Normal":
        """With one experiment's outputs more: out (bins, q, 1 + columns), residual and derivative, of the parameters
        columns. The matrix and the vector are added to in place."""
        flat = out.reshape(-1, out.shape[-1])
        products = flat.T @ flat
        _put(columns, products, self.matrix, self.vector)
        return self._replace(cost=self.cost + float(products[0, 0]), samples=self.samples + len(flat))


def nothing_yet(size: int) -> Normal:
    """Of so many parameters."""
    return Normal(np.zeros((size, size)), np.zeros(size), 0.0, 0, 0.0)


@may_diverge
def normal_equations(
    problem: OutputErrorProblem, point: Point, stage: Stage = FREE_RUN, others: Sequence[OtherLaw] = ()
) -> tuple[Normal, list[Equations]]:
    """Summed up over the experiments; others: laws that are tried out, each with a parameter after the layout's."""
    found, every = nothing_yet(problem.layout.size + len(others)), []
    for experiment, trajectory in zip(problem.experiments, point.trajectories, strict=True):
        observer = Observer(stage.observer, measured_motion(experiment, point.theta)) if stage.observer else None
        equations = linearise(experiment, point.theta, trajectory, others, observer, stage.contact_ramp)
        found = _summed(found, experiment, point.theta, trajectory, equations, observer)
        every.append(equations)
    return found, every


@may_diverge
def equation_error(problem: OutputErrorProblem, point: Point) -> Normal:
    """The same on a given motion, which changes neither with the forces nor with what elements remember."""
    found = nothing_yet(problem.layout.size)
    for experiment, trajectory in zip(problem.experiments, point.trajectories, strict=True):
        equations = linearise(experiment, point.theta, trajectory)
        linear = equations.linear
        still, forgotten = np.zeros_like(linear.kx), np.zeros_like(linear.recalled)
        equations = equations._replace(linear=linear._replace(kx=still, kv=still, kp=still, recalled=forgotten))
        found = _summed(found, experiment, point.theta, trajectory, equations)
    return found


def _summed(so_far: Normal, experiment: Experiment, theta, trajectory, equations, observer=None) -> Normal:
    """With one experiment more, and what the noise that grows with parameters adds."""
    record = experiment.record
    out = whitened(experiment, theta, trajectory, equations, observer, in_time=False)
    found = so_far.with_more(equations.columns, out)
    noise = output_noise(experiment, theta, record.per_bin)
    if not noise.growth:
        return found
    filled = _filled(record)
    for q, parameter, slope in noise.growth:
        # a noisy regressor draws its coefficient towards zero, by as much as the noise it brings grows with it
        found.vector[parameter] += slope * filled[q]
    return found._replace(grown=found.grown + 2.0 * float(filled @ np.log(noise.std / record.noise)))


@njit(cache=True)
def _put(columns, products, matrix, vector):
    """Add the products of a record's columns where their parameters are."""
    for i in range(len(columns)):
        vector[columns[i]] += products[0, i + 1]
        for j in range(len(columns)):
            matrix[columns[i], columns[j]] += products[i + 1, j + 1]


def _filled(record: ObservedRecord) -> np.ndarray:
    """(q,) bins with a valid sample, as many as are compared."""
    return np.count_nonzero(binned(record.bin, record.valid, record.bins), axis=0) * record.compared


def whitened(
    experiment: Experiment, theta: np.ndarray, trajectory: Trajectory, equations: Equations,
    observer: Observer | None = None, in_time: bool = True,
) -> np.ndarray:  # fmt: skip
    """(bins, q, 1 + columns): whitened binned residual corrected for the defect, then its derivative.

    in_time: `ObservedRecord.whitened`.
    """
    layout, record, _ = experiment
    out = np.zeros((record.bins, len(layout.outputs), 1 + len(equations.columns)))
    propagate(equations.linear, equations.sampling, out)
    # what acts on outputs only is linearised at the forces' prediction: the measured motion itself is noisy
    weight = equations.sampling.weight
    position = {int(p): j + 1 for j, p in enumerate(equations.columns[: equations.linear.others - 1])}
    for q, parameter, column in by_channel_errors(experiment, theta, equations.rows, trajectory):
        out[:, q, position[parameter]] += binned(record.bin, (weight[:, q] * column)[:, None], record.bins)[:, 0]
    # along the trajectory: the free bodies' own acceleration less the observer's; fixed forces are in column 0
    along = np.where(layout.kind == FREE, trajectory.a, 0.0)
    if observer:
        along += np.where(layout.kind == FREE, observer.acceleration(trajectory), 0.0)
    misfit = -predicted(experiment, theta, along, trajectory)
    misfit[record.at] += np.where(np.isnan(record.measured), 0.0, record.measured)  # thrice as fast as nan_to_num
    out[:, :, 0] = binned(record.bin, weight * misfit, record.bins) - out[:, :, 0]
    return record.whitened(out, in_time)
