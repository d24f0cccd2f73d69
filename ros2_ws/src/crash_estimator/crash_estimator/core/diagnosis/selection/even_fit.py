"""A model fitted with all outputs alike, where its size is asked for.

In a noise that is found from what a model leaves, one channel may be followed at the cost of another: that ranks
effects, as a relation between channels has the weight that it deserves, but how much is left would hang on which
channel that is, and change with the last digit of a sample.
"""

import numpy as np

from ..observation.record import ObservedRecord
from ..observation.trajectory import Trajectory
from ..output_error.continuation import FROM_SIMULATION
from ..output_error.gauss_newton import Fit, fit
from ..output_error.problem import OutputErrorProblem
from ..output_error.simulation import simulate
from ..parameterization.layout import Layout
from ..residuals.in_band import in_band
from ..residuals.residuals import analyse, output_scale
from .fitted_model import Model
from .search_limit import search_is_over


def evenly_fitted(model: Model, cfc: int | None, other: Model | None = None) -> Model:
    """Of fits from where the model, and another with the same additions, have ended, and from the measured motion, the
    one that leaves the least below a class; where noise was not taken larger, or there is no time, the model itself.

    Whether all that is left is noise only the sensors' own noise decides: what was found of that stays.
    """
    problem = model.fit.problem
    if not problem.noise_is_inflated or search_is_over():
        return model
    evenly = problem.on([_all_alike(record, problem.layout) for record in problem.records])
    ended = [model.fit, other.fit] if other and _as_many_parameters(other.fit.layout, problem.layout) else [model.fit]
    fits = [one._replace(problem=evenly) for one in ended]
    fits += [fit(evenly, model.fit.point), *(fit(evenly, one.point, FROM_SIMULATION) for one in ended), fit(evenly)]
    settled = [one._replace(trajectories=_settled(evenly, one)) for one in fits]
    found = [model._replace(fit=one, residuals=analyse(one)) for one in settled]
    least = min(found, key=lambda one: np.nan_to_num(in_band(one.fit, one.residuals, cfc).rms, nan=np.inf))
    return least._replace(residuals=least.residuals._replace(band_test=model.residuals.band_test))


def _as_many_parameters(one: Layout, other: Layout) -> bool:
    """Else curves have more cells, or reach elsewhere."""
    return (one.knots, one.names) == (other.knots, other.names)


def _settled(problem: OutputErrorProblem, found: Fit) -> tuple[Trajectory, ...]:
    """The motion that its parameters simulate: the last step of a fit is taken to first order."""
    return tuple(simulate(problem, found.theta, found.trajectories).trajectories)


def _all_alike(record: ObservedRecord, layout: Layout) -> ObservedRecord:
    """With as much noise in all, and independent noise in each of them, but equal in m/s^2."""
    noise = record.noise * output_scale(layout)
    root = noise[:, None] * np.linalg.inv(record.whitener)
    return record._replace(whitener=np.diag(noise / np.sqrt((root**2).sum() / len(noise))))
