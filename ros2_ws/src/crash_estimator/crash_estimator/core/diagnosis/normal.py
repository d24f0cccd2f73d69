"""Normal equations of the output error, linearised along a trajectory that need not be a simulation yet."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .layout import Layout
from .linearise import Equations, linearise, output_noise, predicted
from .motion import measured_motion
from .propagate import FREE, propagate
from .records import Record

NO_TRACE = np.zeros((0, 0))

may_diverge = np.errstate(over="ignore", invalid="ignore", divide="ignore")
"""A trial step can lead into motions without bounds; that its result is not finite is noticed in `fit.solve`."""


class Stage(NamedTuple):
    pull: float  # 1/s, observer
    inflate: float  # factor on the noise
    blur: float  # steps of time in which contact opens and closes


FREE_RUN = Stage(0.0, 1.0, 1.0)


class Normal(NamedTuple):
    """Whitened residual and its derivative at one parameter vector, summed up: cost(d) = c - 2 b d + d A d."""

    matrix: np.ndarray  # (p, p)
    vector: np.ndarray  # (p,)
    cost: float  # sum of squares of the whitened residual
    samples: int
    grown: float  # 2 sum of ln(noise with that of measured inertias / noise): what louder noise costs in likelihood


@may_diverge
def normal_equations(
    layout: Layout,
    records: Sequence[Record],
    theta,
    trajectories,
    follow: bool = True,
    switched=(),
    stage: Stage = FREE_RUN,
) -> tuple[Normal, list[Equations]]:
    """follow=False leaves out that the motion changes with the forces: the equation error on the given motion."""
    size = layout.size + len(switched)
    matrix, vector = np.zeros((size, size)), np.zeros(size)
    cost, samples, grown, every = 0.0, 0, 0.0, []
    for r, (record, trajectory) in enumerate(zip(records, trajectories)):
        target = measured_motion(layout, record, r, theta) if stage.pull else None
        equations = linearise(layout, record, r, theta, trajectory, switched, stage.pull, target, stage.blur)
        if not follow:
            still = np.zeros_like(equations.linear.kx)
            equations = equations._replace(linear=equations.linear._replace(kx=still, kv=still, kp=still))
        residual, jacobian = whitened(layout, record, r, theta, trajectory, equations, target)
        flat = jacobian.reshape(-1, jacobian.shape[-1])
        c = equations.columns
        matrix[np.ix_(c, c)] += flat.T @ flat
        vector[c] += flat.T @ residual.ravel()
        noise, filled = output_noise(layout, record, theta, record.per_bin), _filled(record)
        for q, parameter, slope in noise.growth:
            # a noisy regressor draws its coefficient towards zero, by as much as the noise it brings grows with it
            vector[parameter] += slope * filled[q]
        grown += 2.0 * float(filled @ np.log(noise.std / record.noise))
        cost += float(residual.ravel() @ residual.ravel())
        samples += residual.size
        every.append(equations)
    return Normal(matrix, vector, cost, samples, grown), every


def _filled(record: Record) -> np.ndarray:
    """(q,) bins with a valid sample."""
    return np.array([np.count_nonzero(_binned(record, valid)) for valid in record.valid.T])


def whitened(layout, record, r, theta, trajectory, equations, target=None) -> tuple[np.ndarray, np.ndarray]:
    """Whitened binned residual (bins, q) corrected for the defect, and its derivative (bins, q, columns)."""
    out = np.zeros((record.bins, len(layout.outputs), 1 + len(equations.columns)))
    propagate(equations.linear, layout.knots, equations.sampling, out, NO_TRACE)
    # what acts on outputs only is linearised at the forces' prediction: the measured motion itself is noisy
    by = predicted(layout, record, r, theta, equations.rows)[1]
    weight = equations.sampling.weight
    position = {int(p): j + 1 for j, p in enumerate(equations.columns)}
    for q, parameter, column in by:
        out[:, q, position[parameter]] += _binned(record, weight[:, q] * column)
    # along the trajectory: the free bodies' own acceleration less the observer's; fixed forces are in column 0
    along = np.where(layout.kind == FREE, trajectory.a, 0.0)
    if target is not None:
        pull = equations.linear.pull
        push = pull**2 * (trajectory.x - target.x) + 2.0 * pull * (trajectory.v - target.v)
        along += np.where(layout.kind == FREE, push, 0.0)
    misfit = np.zeros((len(record.time), len(layout.outputs)))
    misfit[record.at] = np.nan_to_num(record.measured - predicted(layout, record, r, theta, along)[0][record.at])
    residual = np.stack([_binned(record, weight[:, q] * misfit[:, q]) for q in range(len(layout.outputs))], axis=1)
    residual, jacobian = residual - out[:, :, 0], out[:, :, 1:]
    if record.mix is not None:
        residual, jacobian = residual @ record.mix.T, record.mix @ jacobian
    return residual, jacobian


def _binned(record: Record, values: np.ndarray) -> np.ndarray:
    return np.bincount(record.bin[record.at], weights=values[record.at], minlength=record.bins)
