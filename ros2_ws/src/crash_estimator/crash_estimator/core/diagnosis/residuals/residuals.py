"""What a fit leaves: residuals, their size against the noise floor, and whether they are white."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..mechanics.linearization import Equations, linearise
from ..mechanics.link_force import LinkForce
from ..mechanics.outputs import output_noise, predicted
from ..observation.record import ObservedRecord
from ..observation.whitening import filtered
from ..output_error.gauss_newton import Fit
from ..output_error.normal_equations import may_diverge, whitened
from ..output_error.problem import OutputErrorProblem, Point
from ..output_error.simulation import simulate
from ..parameterization.layout import Experiment, Layout
from .band_test import Absorbed, BandTest, band_test, band_test_of_fit

UNBOUNDED = 1e3
"""Times the largest value measured, as which a prediction counts that is beyond, or no number: whatever is asked of it,
a motion without bounds is far off. No bounded one leaves a hundredth of that; halved and
doubled it changed nothing of 34 looked-at cases."""


class Residuals(NamedTuple):
    """Residuals of one model on all records."""

    predicted: tuple[np.ndarray, ...]  # per record (n, q) SI
    residual: tuple[np.ndarray, ...]  # per record (n, q) SI, measured minus predicted; NaN where not valid
    noise: tuple[np.ndarray, ...]  # per record (q,) SI, standard deviation that noise alone gives a residual
    in_noise: tuple[np.ndarray, ...]  # per record (n, q) residual in units of the noise, as if that were white
    links: tuple[list[LinkForce], ...]
    band_test: BandTest
    rms: float  # m/s^2
    mean_square: float  # in units of the noise

    @property
    def white(self) -> bool:
        """Nothing but noise, by the band test."""
        return self.band_test.white


def output_scale(layout: Layout) -> np.ndarray:
    """(q,) from each output's unit to m/s^2."""
    return np.array([output.to_acceleration for output in layout.outputs])


@may_diverge
def rms(layout: Layout, values: Sequence[np.ndarray]) -> float:
    """Root mean square over all outputs and records, m/s^2."""
    scaled = np.concatenate([(v * output_scale(layout)).ravel() for v in values])
    return float(np.sqrt(np.nanmean(scaled**2)))


def noise_floor(layout: Layout, records: Sequence[ObservedRecord]) -> float:
    """The RMS that the sensors' noise alone leaves, m/s^2."""
    return rms(layout, [record.noise_of_samples for record in records])


@may_diverge
def analyse(fitted: Fit, sharply: bool = False) -> Residuals:
    """What a fit leaves; sharply: white is only what looks so also beside what the fit must have absorbed.

    That shows where a curve has not yet been let fold (`free_curve.adapted_roughness`), too: it is for finished models.
    """
    problem = fitted.problem
    equations = _equations(problem, fitted.point)
    found = _residuals(problem, fitted.point, equations)
    if not sharply or not found.white or problem.noise_is_inflated:
        return found
    absorbed = [_absorbed(fitted, *each) for each in zip(problem.experiments, equations, strict=True)]
    sharper = band_test_of_fit(absorbed, _noise_samples(problem.records))
    return found if sharper.white else found._replace(band_test=sharper)


def _absorbed(fitted: Fit, experiment: Experiment, equations: Equations) -> list[Absorbed]:
    """One for each output."""
    trajectory = fitted.trajectories[experiment.index]
    out = whitened(experiment, fitted.theta, trajectory, equations)
    residual, jacobian, columns = out[:, :, 0], out[:, :, 1:], equations.columns
    covariance = fitted.covariance[np.ix_(columns, columns)]
    std = np.sqrt(np.diagonal(covariance))  # of units that differ by many orders of magnitude
    values, vectors = np.linalg.eigh(covariance / np.outer(std, std))
    roots = (jacobian * std) @ (vectors * np.sqrt(np.maximum(values, 0.0)))
    period = float(experiment.record.time[-1]) / experiment.record.bins
    return [Absorbed(residual[:, q], roots[:, q], period) for q in range(residual.shape[1])]


def _equations(problem: OutputErrorProblem, point: Point) -> list[Equations]:
    pairs = zip(problem.experiments, point.trajectories, strict=True)
    return [linearise(experiment, point.theta, trajectory) for experiment, trajectory in pairs]


def _residuals(problem: OutputErrorProblem, point: Point, equations: Sequence[Equations]) -> Residuals:
    theta = point.theta
    outputs, residuals = [], []
    for experiment, each, trajectory in zip(problem.experiments, equations, point.trajectories, strict=True):
        record = experiment.record
        limit = UNBOUNDED * np.nanmax(np.abs(record.measured), axis=0)
        output = np.nan_to_num(predicted(experiment, theta, each.rows, trajectory)[record.at], nan=np.inf)
        output = np.clip(output, -limit, limit)
        outputs.append(output)
        residuals.append(np.where(record.valid[record.at] > 0.0, record.measured - output, np.nan))
    links = tuple(each.links for each in equations)
    noise = tuple(output_noise(experiment, theta).std for experiment in problem.experiments)
    records = problem.records
    scaled = [_white(r, residual / std) for r, residual, std in zip(records, residuals, noise, strict=True)]
    tested = band_test(scaled, _noise_samples(records), [record.period for record in records])
    compared = float(np.mean([record.compared.mean() for record in records]))
    mean_square = float(np.nanmean(np.concatenate([z.ravel() for z in scaled]) ** 2)) / compared
    size = rms(problem.layout, residuals)
    return Residuals(tuple(outputs), tuple(residuals), noise, tuple(scaled), links, tested, size, mean_square)


def _noise_samples(records: Sequence[ObservedRecord]) -> list[np.ndarray]:
    """(q,) of each, that its noise was found from."""
    return [np.array([spectrum.samples for spectrum in record.spectra]) for record in records]


def _white(record: ObservedRecord, z: np.ndarray) -> np.ndarray:
    """Residuals (n, q) in units of the noise, as if that were white, in the band that is compared."""
    weight = record.weights_of(len(z))
    if weight is None or record.noise_is_inflated:
        return z
    return np.where(np.isfinite(z), filtered(np.nan_to_num(z), weight), np.nan)


@may_diverge
def free_run(fitted: Fit) -> Residuals:
    """Simulation from the initial motion alone: nothing about this recording's sensors is fitted."""
    problem = fitted.problem
    theta = fitted.theta.copy()
    theta[problem.layout.common :] = 0.0
    run = simulate(problem, theta, fitted.trajectories)
    return _residuals(problem, run, _equations(problem, run))
