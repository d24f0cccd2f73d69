"""Mean and variance of error, input and output per equation, as in the thesis's tables 5.1 and 5.2."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .estimate import Estimate


class EquationError(NamedTuple):
    """One row of the table, over the samples after the impact with a valid measurement."""

    equation: str
    unit: str
    samples: int
    input_mean: float  # measured
    input_variance: float
    output_mean: float  # predicted with the updated parameters
    output_variance: float
    error_mean: float  # residual: input minus output
    error_variance: float
    rms: float  # of the residual


def equation_errors(description, estimates: Sequence[Estimate]) -> list[EquationError]:
    """One row per equation; description is the estimator's Description."""
    after = [estimate for estimate in estimates if estimate.time_ns >= 0]
    rows = []
    for k, (name, unit) in enumerate(zip(description.equations, description.equation_units)):
        measured = np.array([e.measured[k] for e in after])
        predicted = np.array([e.predicted[k] for e in after])
        valid = ~np.isnan(measured)
        measured, predicted = measured[valid], predicted[valid]
        if not len(measured):
            rows.append(EquationError._make((name, unit, 0, *[float("nan")] * 7)))
            continue
        error = measured - predicted
        statistics = [float(f(x)) for x in (measured, predicted, error) for f in (np.mean, np.var)]
        rows.append(EquationError._make((name, unit, len(error), *statistics, float(np.sqrt(np.mean(error**2))))))
    return rows
