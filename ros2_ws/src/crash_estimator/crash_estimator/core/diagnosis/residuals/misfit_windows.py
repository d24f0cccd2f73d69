"""Where a model fails: time windows in which the residual leaves its band, the body, and what its elements do then; a
window ends where they begin to do something else."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import chdtri

from ...estimate import ElementState
from ..mechanics.link_force import LinkForce
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
    found: list[MisfitWindow] = []
    tests = sum(record.measured.size for record in records)
    for r, record in enumerate(records):
        windows = []
        time = record.time[record.at]
        length = min(max(int(round(WINDOW / record.period)), 4), len(time))
        for q, output in enumerate(layout.outputs):
            residual, scale = residuals.residual[r][:, q], output_scale(layout)[q]
            z2 = np.nan_to_num(residual / residuals.noise[r][q]) ** 2
            mean = np.convolve(z2, np.full(length, 1.0 / length), "same")
            outside = mean > chdtri(length, SIGNIFICANT / tests) / length  # a sum of squares: chi-squared
            outside &= np.isfinite(residual)
            for run in _runs(outside, length):
                for first, last, state in _phases(layout, residuals.links[r], output.body, record.at, run, length):
                    within = slice(first, last + 1)
                    windows.append(
                        MisfitWindow(
                            start=float(time[first]),
                            end=float(time[last]),
                            body=layout.structure.bodies[output.body].name,
                            state=state.name.lower(),
                            rms=float(scale * np.sqrt(np.nanmean(residual[within] ** 2))),
                            recording=record.test.id,
                            measured=float(scale * np.nanmean(record.measured[within, q])),
                            predicted=float(scale * np.nanmean(residuals.predicted[r][within, q])),
                        )
                    )
        found += sorted(windows, key=lambda window: (window.start, window.body))
    return tuple(found)


def _runs(outside: np.ndarray, length: int) -> list[tuple[int, int]]:
    """First and last index of each stretch; stretches less than a window apart are one."""
    index = np.flatnonzero(outside)
    if not len(index):
        return []
    breaks = np.flatnonzero(np.diff(index) > length)
    return list(zip(index[np.r_[0, breaks + 1]].tolist(), index[np.r_[breaks, len(index) - 1]].tolist()))


def _phases(
    layout: Layout, links: Sequence[LinkForce], body: int, at: np.ndarray, run: tuple[int, int], length: int
) -> list[tuple[int, int, ElementState]]:
    """First and last index of each part of a stretch in which the body's element that carries most does one thing, for
    as long as a window."""
    first, last = run
    at = at[first : last + 1]
    mine = [force for link, force in zip(layout.links, links, strict=True) if body in link.ends]
    busiest = max(mine, key=lambda force: float(np.abs(force.force[at]).mean()), default=None)
    if busiest is None:
        return [(first, last, ElementState.APART)]
    carries = np.where(busiest.unloads[at], ElementState.UNLOADING, ElementState.LOADING)
    state = np.where(busiest.apart[at], ElementState.APART, carries)
    changes = np.flatnonzero(np.diff(state)) + 1
    kept = [int(k) for k, n in zip(np.r_[0, changes], np.diff(np.r_[0, changes, len(at)])) if n >= length]
    kept = [k for n, k in enumerate(kept) if not n or state[k] != state[kept[n - 1]]]
    if not kept:
        return [(first, last, ElementState(int(np.bincount(state).argmax())))]
    starts = [first, *(first + k for k in kept[1:])]
    ends = [start - 1 for start in starts[1:]] + [last]
    return [(one, end, ElementState(int(state[k]))) for one, end, k in zip(starts, ends, kept, strict=True)]
