"""Motions as the sensors show them, if they err as the parameters say; where bodies start, and driven ones go."""

from typing import NamedTuple

import numpy as np

from ..effects.base import AttachedBody, ChannelError
from .layout import Layout
from .propagate import FREE
from .records import DRIVEN_MODES, Record
from .scales import attached_start
from .trajectory import Trajectory, integrate


class Distortion(NamedTuple):
    """A channel's error: recorded(t) = (1 + gain) true(t - delay) + offset, and its parameters (-1: none)."""

    gain: float = 0.0
    delay: float = 0.0
    offset: float = 0.0
    parameters: tuple[int, int, int] = (-1, -1, -1)


def distortion(layout: Layout, theta: np.ndarray, channel: str) -> Distortion:
    found, parameters = {"gain": 0.0, "delay": 0.0, "offset": 0.0}, {"gain": -1, "delay": -1, "offset": -1}
    for place in layout.places:
        if isinstance(place.addition.effect, ChannelError) and place.addition.target == channel:
            found[place.addition.effect.role] = float(theta[place.coefficient])
            parameters[place.addition.effect.role] = place.coefficient
    found["delay"] = max(found["delay"], 0.0)  # at its limit it may be a rounding error below
    return Distortion(**found, parameters=tuple(parameters.values()))


def driven_motion(layout: Layout, record: Record, r: int, theta: np.ndarray):
    """Acceleration (g, b) of the driven bodies, and its derivatives: a list of (body, parameter, (g,))."""
    structure = layout.structure
    g = len(record.time)
    a, by = np.zeros((g, len(layout.bodies))), []
    channels = {k: body.acceleration for k, body in enumerate(structure.bodies) if body.driven}
    channels |= {k: (channel,) for channel, k in layout.attached.items()}
    for k, names in channels.items():
        for name in names:
            d, signal = distortion(layout, theta, name), record.signals[name]
            share = 1.0 / len(names)
            after = record.time + d.delay
            true = (np.interp(after, signal.time, signal.values) - d.offset) / (1.0 + d.gain)
            a[:, k] += share * true
            gain, delay, offset = d.parameters
            if gain >= 0:
                by.append((k, gain, -share * true / (1.0 + d.gain)))
            if offset >= 0:
                by.append((k, offset, np.full(g, -share / (1.0 + d.gain))))
            if delay >= 0:
                step = 0.5 * record.step
                up, down = (np.interp(after + s * step, signal.time, signal.values) for s in (1.0, -1.0))
                by.append((k, delay, share * (up - down) / (2.0 * step) / (1.0 + d.gain)))
        first = layout.modes[r][k]
        a[:, k] += record.cosines @ theta[first : first + DRIVEN_MODES + 1]
        by += [(k, first + j, record.cosines[:, j]) for j in range(DRIVEN_MODES + 1)]
    return a, by


def start_values(layout: Layout, record: Record) -> tuple[np.ndarray, np.ndarray]:
    """(b,) initial velocities and displacements, attached bodies included."""
    v0, x0 = list(record.initial_velocity), list(record.initial_displacement)
    by_channel = {p.addition.target: p.addition for p in layout.places if isinstance(p.addition.effect, AttachedBody)}
    for channel in layout.attached:
        x, v = attached_start(layout.structure, record, by_channel[channel])
        v0.append(v)
        x0.append(x)
    return np.array(v0), np.array(x0)


def measured_motion(layout: Layout, record: Record, r: int, theta: np.ndarray) -> Trajectory:
    """What the sensors say of the motion, if they err as theta says."""
    a = np.zeros((len(record.time), len(layout.bodies)))
    for k, body in enumerate(layout.structure.bodies):
        for name in body.acceleration if body.free else ():
            d, signal = distortion(layout, theta, name), record.signals[name]
            recorded = np.interp(record.time + d.delay, signal.time, signal.values)
            a[:, k] += (recorded - d.offset) / (1.0 + d.gain) / len(body.acceleration)
    return motion_of(layout, record, r, theta, a)


def motion_of(layout: Layout, record: Record, r: int, theta: np.ndarray, free: np.ndarray) -> Trajectory:
    """The trajectory in which free bodies accelerate as given (g, bodies) and driven ones as theta says."""
    a = driven_motion(layout, record, r, theta)[0]
    for k in np.flatnonzero(layout.kind == FREE):
        a[:, k] = free[:, k]
    v0, x0 = start_values(layout, record)
    v, x = integrate(record.dt, a, v0, x0)
    return Trajectory(a, v, x)
