"""What a fit leaves: residuals, their size against the noise floor, and whether they are white."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .fit import Fit, advance
from .layout import Layout
from .linearise import Equations, linearise, output_noise, predicted
from .linkforce import LinkForce
from .motion import motion_of
from .normal import may_diverge, whitened
from .records import Record
from .trajectory import Trajectory
from .whiteness import Absorbed, Whiteness, whiteness, whiteness_of_fit

SIMULATION_STEPS = 8
SIMULATED = 1e-6
"""Change of the accelerations, as a share of the largest, at which a simulation is done."""


class Left(NamedTuple):
    """Residuals of one model on all records."""

    predicted: tuple[np.ndarray, ...]  # per record (n, q) SI
    residual: tuple[np.ndarray, ...]  # per record (n, q) SI, measured minus predicted; NaN where not valid
    noise: tuple[np.ndarray, ...]  # per record (q,) SI, standard deviation that noise alone gives a residual
    links: tuple[list[LinkForce], ...]
    whiteness: Whiteness
    rms: float  # m/s^2
    cost: float  # mean square in units of the noise


def output_scale(layout: Layout) -> np.ndarray:
    """(q,) from each output's unit to m/s^2: a force counts divided by the mass of all free bodies."""
    mass = sum(body.mass for body in layout.structure.bodies if body.free) or 1.0
    return np.array([1.0 / mass if output.fixed else 1.0 for output in layout.outputs])


@may_diverge
def rms(layout: Layout, values: Sequence[np.ndarray]) -> float:
    """Root mean square over all outputs and records, m/s^2."""
    scaled = np.concatenate([(v * output_scale(layout)).ravel() for v in values])
    return float(np.sqrt(np.nanmean(scaled**2)))


def noise_floor(layout: Layout, records: Sequence[Record]) -> float:
    """The RMS that the sensors' noise alone leaves, m/s^2."""
    return rms(layout, [np.where(np.isfinite(r.measured), r.noise, np.nan) for r in records])


@may_diverge
def assess(fitted: Fit, records: Sequence[Record], sharply: bool = False) -> Left:
    """What a fit leaves; sharply: white is only what looks so also beside what the fit must have absorbed.

    That shows where a curve has not yet been let fold (`curves.adapted_roughness`), too: it is for finished models.
    """
    equations = _equations(fitted.layout, records, fitted.theta, fitted.trajectories)
    left = _left(fitted.layout, records, fitted.theta, equations)
    if not sharply or not left.whiteness.white or records[0].mix is not None:
        return left
    absorbed = [_absorbed(fitted, record, r, equations[r]) for r, record in enumerate(records)]
    sharper = whiteness_of_fit(absorbed, [record.noise_samples for record in records])
    return left if sharper.white else left._replace(whiteness=sharper)


def _absorbed(fitted: Fit, record: Record, r: int, equations: Equations) -> list[Absorbed]:
    """One for each output."""
    out = whitened(fitted.layout, record, r, fitted.theta, fitted.trajectories[r], equations)
    residual, jacobian, columns = out[:, :, 0], out[:, :, 1:], equations.columns
    covariance = fitted.covariance[np.ix_(columns, columns)]
    std = np.sqrt(np.diagonal(covariance))  # of units that differ by many orders of magnitude
    values, vectors = np.linalg.eigh(covariance / np.outer(std, std))
    roots = (jacobian * std) @ (vectors * np.sqrt(np.maximum(values, 0.0)))
    period = float(record.time[-1]) / record.bins
    return [Absorbed(residual[:, q], roots[:, q], period) for q in range(residual.shape[1])]


def _equations(
    layout: Layout, records: Sequence[Record], theta: np.ndarray, trajectories: Sequence[Trajectory]
) -> list[Equations]:
    along = enumerate(zip(records, trajectories))
    return [linearise(layout, record, r, theta, trajectory) for r, (record, trajectory) in along]


def _left(layout: Layout, records: Sequence[Record], theta: np.ndarray, equations: Sequence[Equations]) -> Left:
    outputs, residuals = [], []
    for r, (record, each) in enumerate(zip(records, equations)):
        output = predicted(layout, record, r, theta, each.rows)[0][record.at]
        outputs.append(output)
        residuals.append(np.where(record.valid[record.at] > 0.0, record.measured - output, np.nan))
    links = tuple(each.links for each in equations)
    noise = tuple(output_noise(layout, record, theta).std for record in records)
    scaled = [residual / std for residual, std in zip(residuals, noise)]
    periods = [record.period for record in records]
    white = whiteness(scaled, [record.noise_samples for record in records], periods)
    cost = float(np.nanmean(np.concatenate([z.ravel() for z in scaled]) ** 2))
    return Left(tuple(outputs), tuple(residuals), noise, links, white, rms(layout, residuals), cost)


@may_diverge
def free_run(fitted: Fit, records: Sequence[Record]) -> Left:
    """Simulation from the initial motion alone: nothing about this recording's sensors is fitted."""
    layout = fitted.layout
    theta = fitted.theta.copy()
    theta[layout.common :] = 0.0
    trajectories = []
    for r, (record, trajectory) in enumerate(zip(records, fitted.trajectories)):
        moved = motion_of(layout, record, r, theta, trajectory.a)
        for _ in range(SIMULATION_STEPS):
            last, equations = moved, linearise(layout, record, r, theta, moved)
            moved = advance(layout, record, r, theta, np.zeros(layout.size), last, equations)
            if np.abs(moved.a - last.a).max() < SIMULATED * np.abs(moved.a).max():
                break
        trajectories.append(moved)
    return _left(layout, records, theta, _equations(layout, records, theta, trajectories))
