"""Where a model fails: time windows in which the residual leaves its band, the body, and what its elements do then."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import chdtri

from ...estimate import ElementState
from ..observation.record import ObservedRecord
from ..parameterization.layout import Layout
from .residuals import Residuals, output_scale

WINDOW = 2e-3
"""s: over which the residual's mean square is taken."""

SIGNIFICANT = 0.01
"""Probability that noise alone leaves the band anywhere."""


class MisfitWindow(NamedTuple):
    start: float  # s since the impact
    end: float  # s
    body: str
    state: str  # loading, unloading or apart: of the body's element that carries most
    rms: float  # m/s^2
    recording: str  # id of the test
    measured: float  # m/s^2, mean over the window; a force counts divided by the mass of all free bodies
    predicted: float  # m/s^2


def misfit_windows(layout: Layout, records: Sequence[ObservedRecord], residuals: Residuals) -> tuple[MisfitWindow, ...]:
    """Windows in order of time, record by record."""
    found = []
    tests = sum(record.measured.size for record in records)
    for r, record in enumerate(records):
        time = record.time[record.at]
        length = min(max(int(round(WINDOW / record.period)), 4), len(time))
        for q, output in enumerate(layout.outputs):
            residual, scale = residuals.residual[r][:, q], output_scale(layout)[q]
            z2 = np.nan_to_num(residual / residuals.noise[r][q]) ** 2
            mean = np.convolve(z2, np.full(length, 1.0 / length), "same")
            outside = mean > chdtri(length, SIGNIFICANT / tests) / length  # a sum of squares: chi-squared
            outside &= np.isfinite(residual)
            for first, last in _runs(outside, length):
                within = slice(first, last + 1)
                found.append(
                    MisfitWindow(
                        start=float(time[first]),
                        end=float(time[last]),
                        body=layout.structure.bodies[output.body].name,
                        state=_state(layout, residuals, r, output.body, record.at[within]),
                        rms=float(scale * np.sqrt(np.nanmean(residual[within] ** 2))),
                        recording=record.test.id,
                        measured=float(scale * np.nanmean(record.measured[within, q])),
                        predicted=float(scale * np.nanmean(residuals.predicted[r][within, q])),
                    )
                )
    order = [record.test.id for record in records]
    return tuple(sorted(found, key=lambda w: (order.index(w.recording), w.start, w.body)))


def _runs(outside: np.ndarray, length: int) -> list[tuple[int, int]]:
    """First and last index of each stretch; stretches less than a window apart are one."""
    index = np.flatnonzero(outside)
    if not len(index):
        return []
    breaks = np.flatnonzero(np.diff(index) > length)
    return list(zip(index[np.r_[0, breaks + 1]].tolist(), index[np.r_[breaks, len(index) - 1]].tolist()))


def _state(layout: Layout, residuals: Residuals, r: int, body: int, at: np.ndarray) -> str:
    mine = [force for link, force in zip(layout.links, residuals.links[r]) if body in link.ends]
    busiest = max(mine, key=lambda force: float(np.abs(force.force[at]).mean()), default=None)
    if busiest is None or busiest.apart[at].mean() > 0.5:
        state = ElementState.APART
    else:
        state = ElementState.UNLOADING if busiest.unloads[at].mean() > 0.5 else ElementState.LOADING
    return state.name.lower()
