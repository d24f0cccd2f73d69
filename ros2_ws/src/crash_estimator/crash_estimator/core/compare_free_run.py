"""How well a free run matches what was measured: peaks, rms and rating, signal by signal."""

from typing import NamedTuple

import numpy as np

from .estimate import Description
from .free_run import FreeRun
from .rating import Rating, rate
from .structure import Structure


class Comparison(NamedTuple):
    """One signal, simulated against measured."""

    name: str
    unit: str
    measured_peak: float  # the value largest in magnitude
    simulated_peak: float
    rms: float  # of the difference
    rating: Rating | None  # None: too short, with gaps, or constant


def compare(
    structure: Structure, description: Description, run: FreeRun, smooth=lambda values: values
) -> list[Comparison]:
    """Every equation's signal and every free body's velocity; `smooth` (a filter) is applied to both signals."""
    signals = [
        (name, unit, smooth(run.measured[:, k]), smooth(run.predicted[:, k]))
        for k, (name, unit) in enumerate(zip(description.equations, description.equation_units))
    ]
    signals += [
        (f"{body.name} velocity", "m/s", run.measured_velocity[:, k], run.velocity[:, k])
        for k, body in enumerate(structure.bodies)
        if body.free and body.acceleration
    ]
    return [_comparison(*signal) for signal in signals]


def _comparison(name: str, unit: str, measured: np.ndarray, simulated: np.ndarray) -> Comparison:
    valid = np.isfinite(measured) & np.isfinite(simulated)
    try:
        rating = rate(measured, simulated)
    except ValueError:
        rating = None
    if not valid.any():
        return Comparison(name, unit, np.nan, np.nan, np.nan, rating)
    peak, simulated_peak = (float(s[valid][np.argmax(np.abs(s[valid]))]) for s in (measured, simulated))
    rms = float(np.sqrt(np.mean((measured - simulated)[valid] ** 2)))
    return Comparison(name, unit, peak, simulated_peak, rms, rating)
