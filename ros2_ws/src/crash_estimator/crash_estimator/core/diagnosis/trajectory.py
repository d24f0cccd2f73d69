"""Motions of all bodies on a record's grid, integrated from their accelerations."""

from typing import NamedTuple

import numpy as np

from ..effects.base import ElementMotion
from ..kinematics import RATE_SMOOTHING
from ..structure import Structure
from .records import Record


class Trajectory(NamedTuple):
    """g instants, b bodies; a fixed body rests."""

    a: np.ndarray  # (g, b) m/s^2
    v: np.ndarray  # (g, b) m/s
    x: np.ndarray  # (g, b) m


def integrate(dt: np.ndarray, a: np.ndarray, v0: np.ndarray, x0: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(g, b) velocity and displacement of a piecewise-linear acceleration (as in `kinematics`)."""
    last = np.concatenate([a[:1], a[:-1]])
    step = dt[:, None]
    v = v0 + np.cumsum(0.5 * step * (last + a), axis=0)
    before = np.concatenate([np.broadcast_to(v0, (1, a.shape[1])), v[:-1]])
    x = x0 + np.cumsum(step * before + step * step * (2.0 * last + a) / 6.0, axis=0)
    return v, x


def measured_trajectory(structure: Structure, record: Record) -> Trajectory:
    """From the measured accelerations."""
    a = np.zeros((len(record.time), len(structure.bodies)))
    for k, body in enumerate(structure.bodies):
        if body.acceleration:
            signals = [record.signals[name] for name in body.acceleration]
            a[:, k] = np.mean([np.interp(record.time, s.time, s.values) for s in signals], axis=0)
    v, x = integrate(record.dt, a, record.initial_velocity, record.initial_displacement)
    return Trajectory(a, v, x)


def element_motion(structure: Structure, record: Record, trajectory: Trajectory, element: int) -> ElementMotion:
    """Crush, rate and peak of an element; its static force is left at 0."""
    a, b = structure.ends[element]
    given = structure.elements[element]
    if given.displacement:
        crush, rate = measured_crush(record, given.displacement, given.velocity)
    else:
        crush, rate = trajectory.x[:, a] - trajectory.x[:, b], trajectory.v[:, a] - trajectory.v[:, b]
    peak = np.maximum(np.maximum.accumulate(crush), 0.0)
    return ElementMotion(record.time, crush, rate, peak, np.zeros_like(crush))


def measured_crush(record: Record, displacement: str, velocity: str | None) -> tuple[np.ndarray, np.ndarray]:
    """(g,) crush and rate from measured channels; without its own channel the rate is the crush's smoothed slope."""
    signal = record.signals[displacement]
    crush = np.interp(record.time, signal.time, signal.values)
    if velocity:
        signal = record.signals[velocity]
        return crush, np.interp(record.time, signal.time, signal.values)
    slope = np.gradient(crush, record.time)
    width = max(int(round(RATE_SMOOTHING / record.step)), 1) | 1
    padded = np.concatenate([np.full(width // 2, slope[0]), slope, np.full(width // 2, slope[-1])])
    return crush, np.convolve(padded, np.full(width, 1.0 / width), "valid")
