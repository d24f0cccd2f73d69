"""Motions of all bodies on a record's grid, integrated from their accelerations."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit

from ... import compile_cache as _compile_cache  # noqa: F401  before any compiled function is defined
from ...effects.base import ElementMotion
from ...kinematics import RATE_SMOOTHING
from ...structure import Structure
from .record import ObservedRecord


class Trajectory(NamedTuple):
    """g instants, b bodies; a fixed body rests. One body's instants lie next to each other."""

    a: np.ndarray  # (g, b) m/s^2
    v: np.ndarray  # (g, b) m/s
    x: np.ndarray  # (g, b) m


def integrate(dt: np.ndarray, a: np.ndarray, v0: np.ndarray, x0: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(g, b) velocity and displacement of a piecewise-linear acceleration (as in `kinematics`)."""
    v, x = np.empty_like(a), np.empty_like(a)
    _integrate(dt, a, np.asarray(v0, float), np.asarray(x0, float), v, x)
    return v, x


@njit(cache=True)
def _integrate(dt, a, v0, x0, v, x):
    for k in range(a.shape[1]):
        rate, place, last = v0[k], x0[k], a[0, k]
        for t in range(len(dt)):
            step, now = dt[t], a[t, k]
            place += step * rate + step * step * (2.0 * last + now) / 6.0
            rate += 0.5 * step * (last + now)
            v[t, k], x[t, k], last = rate, place, now


def measured_trajectory(structure: Structure, record: ObservedRecord) -> Trajectory:
    """From the measured accelerations."""
    a = np.zeros((len(structure.bodies), len(record.time))).T
    for k, body in enumerate(structure.bodies):
        if body.acceleration:
            a[:, k] = np.mean([record.signals[name].on_grid for name in body.acceleration], axis=0)
    v, x = integrate(record.dt, a, record.initial_velocity, record.initial_displacement)
    return Trajectory(a, v, x)


def element_motion(structure: Structure, record: ObservedRecord, trajectory: Trajectory, element: int) -> ElementMotion:
    """Crush, rate and peak of an element; its static force is left at 0."""
    given = structure.elements[element]
    crush, rate = crush_and_rate(record, trajectory, structure.ends[element], given.displacement, given.velocity)
    peak = np.maximum(np.maximum.accumulate(crush), 0.0)
    return ElementMotion(record.time, crush, rate, peak, np.zeros_like(crush))


def crush_and_rate(
    record: ObservedRecord, trajectory: Trajectory, ends: Sequence[int], displacement: str | None, velocity: str | None
) -> tuple[np.ndarray, np.ndarray]:
    """(g,) between two bodies, or from measured channels; where only the crush has one, the rate is its smoothed
    slope."""
    if not displacement:
        a, b = ends
        return trajectory.x[:, a] - trajectory.x[:, b], trajectory.v[:, a] - trajectory.v[:, b]
    crush = record.signals[displacement].on_grid
    if velocity:
        return crush, record.signals[velocity].on_grid
    slope = np.gradient(crush, record.time)
    width = max(int(round(RATE_SMOOTHING / record.step)), 1) | 1
    padded = np.concatenate([np.full(width // 2, slope[0]), slope, np.full(width // 2, slope[-1])])
    return crush, np.convolve(padded, np.full(width, 1.0 / width), "valid")
