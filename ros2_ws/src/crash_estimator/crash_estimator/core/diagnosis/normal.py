"""Normal equations of the output error, linearised along a trajectory that need not be a simulation yet."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit

from .. import compile_cache as _compile_cache  # noqa: F401  before any compiled function is defined
from .layout import Layout
from .linearise import Equations, linearise, output_noise, predicted
from .motion import measured_motion
from .propagate import FREE, propagate
from .records import Record

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
        flat = whitened(layout, record, r, theta, trajectory, equations, target)
        flat = flat.reshape(-1, flat.shape[-1])
        products = flat.T @ flat
        _put(equations.columns, products, matrix, vector)
        noise, filled = output_noise(layout, record, theta, record.per_bin), _filled(record)
        for q, parameter, slope in noise.growth:
            # a noisy regressor draws its coefficient towards zero, by as much as the noise it brings grows with it
            vector[parameter] += slope * filled[q]
        grown += 2.0 * float(filled @ np.log(noise.std / record.noise))
        cost += float(products[0, 0])
        samples += len(flat)
        every.append(equations)
    return Normal(matrix, vector, cost, samples, grown), every


@njit(cache=True)
def _put(columns, products, matrix, vector):
    """Add the products of a record's columns where their parameters are."""
    for i in range(len(columns)):
        vector[columns[i]] += products[0, i + 1]
        for j in range(len(columns)):
            matrix[columns[i], columns[j]] += products[i + 1, j + 1]


def _filled(record: Record) -> np.ndarray:
    """(q,) bins with a valid sample."""
    return np.count_nonzero(binned(record, record.valid), axis=0)


def whitened(layout, record, r, theta, trajectory, equations, target=None) -> np.ndarray:
    """(bins, q, 1 + columns): whitened binned residual corrected for the defect, then its derivative."""
    out = np.zeros((record.bins, len(layout.outputs), 1 + len(equations.columns)))
    propagate(equations.linear, equations.sampling, out)
    # what acts on outputs only is linearised at the forces' prediction: the measured motion itself is noisy
    weight = equations.sampling.weight
    position = {int(p): j + 1 for j, p in enumerate(equations.columns[: equations.linear.others - 1])}
    for q, parameter, column in predicted(layout, record, r, theta, equations.rows)[1]:
        out[:, q, position[parameter]] += binned(record, (weight[:, q] * column)[:, None])[:, 0]
    # along the trajectory: the free bodies' own acceleration less the observer's; fixed forces are in column 0
    along = np.where(layout.kind == FREE, trajectory.a, 0.0)
    if target is not None:
        pull = equations.linear.pull
        push = pull**2 * (trajectory.x - target.x) + 2.0 * pull * (trajectory.v - target.v)
        along += np.where(layout.kind == FREE, push, 0.0)
    misfit = record.on_grid - predicted(layout, record, r, theta, along)[0]
    out[:, :, 0] = binned(record, weight * misfit) - out[:, :, 0]
    return out if record.mix is None else record.mix @ out


def binned(record: Record, values: np.ndarray) -> np.ndarray:
    """(bins, columns) sums of values (g, columns) at the samples."""
    found = np.zeros((record.bins, values.shape[1]))
    _add_up(record.bin, values, found)
    return found


@njit(cache=True)
def _add_up(bins, values, found):
    for k in range(values.shape[1]):
        for t in range(len(bins)):
            if bins[t] >= 0:
                found[bins[t], k] += values[t, k]
