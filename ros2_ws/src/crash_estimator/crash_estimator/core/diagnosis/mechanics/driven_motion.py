"""Motions as the sensors show them, if they err as the parameters say; where bodies start, and driven ones go."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...effects.effect import Addition
from ..observation.record import ObservedRecord
from ..observation.trajectory import Trajectory, integrate
from ..parameterization.layout import FREE, Experiment, Layout
from ..parameterization.magnitudes import attached_start


class Distortion(NamedTuple):
    """A channel's error: recorded(t) = (1 + gain) true(t - delay) + offset(t), and its parameters (-1: none)."""

    gain: float = 0.0
    delay: float = 0.0
    by_gain: int = -1
    by_delay: int = -1
    offsets: tuple[tuple[int, float, Addition], ...] = ()  # parameter, its value, what it is of

    @property
    def parameters(self) -> list[int]:
        return [p for p in (self.by_gain, self.by_delay, *(p for p, _, _ in self.offsets)) if p >= 0]

    def offset(self, time: np.ndarray) -> np.ndarray | float:
        """(g,) at s since the impact."""
        return sum(value * one.effect.course(one.variant, time) for _, value, one in self.offsets)

    def offset_by(self, time: np.ndarray) -> list[tuple[int, np.ndarray]]:
        """Its derivatives: (parameter, (g,))."""
        return [(p, one.effect.course(one.variant, time)) for p, _, one in self.offsets]


def distortion(layout: Layout, theta: np.ndarray, channel: str) -> Distortion:
    found = Distortion()
    for term in (t for t in layout.terms if channel in t.addition.effect.channels(layout.structure, t.addition.target)):
        p, value = term.coefficient, float(theta[term.coefficient])
        match term.addition.effect.distorts:
            case "gain":
                found = found._replace(gain=value, by_gain=p)
            case "delay":  # at its limit it may be a rounding error below
                found = found._replace(delay=max(value, 0.0), by_delay=p)
            case "offset":
                found = found._replace(offsets=(*found.offsets, (p, value, term.addition)))
    return found


def driven_motion(experiment: Experiment, theta: np.ndarray) -> np.ndarray:
    """Acceleration (g, b) of the driven bodies."""
    layout, record, r = experiment
    a = _shown_by(_driving(layout), experiment, theta)
    for k, modes in layout.modes[r].items():
        a[:, k] += record.cosines[:, : len(modes)] @ theta[modes]
    return a


def driven_by(experiment: Experiment, theta: np.ndarray) -> list[tuple[int, int, np.ndarray]]:
    """Its derivatives: (body, parameter, (g,))."""
    layout, record, r = experiment
    by = []
    for k, names in _driving(layout).items():
        for name in names:
            d = distortion(layout, theta, name)
            true, share = true_acceleration(record, name, d), 1.0 / len(names)
            if d.by_gain >= 0:
                by.append((k, d.by_gain, -share * true / (1.0 + d.gain)))
            by += [(k, p, -share / (1.0 + d.gain) * course) for p, course in d.offset_by(record.time)]
            if d.by_delay >= 0:
                signal, after, step = record.signals[name], record.time + d.delay, 0.5 * record.step
                up, down = (np.interp(after + s * step, signal.time, signal.values) for s in (1.0, -1.0))
                by.append((k, d.by_delay, share * (up - down) / (2.0 * step) / (1.0 + d.gain)))
        by += [(k, p, record.cosines[:, j]) for j, p in enumerate(layout.modes[r][k])]
    return by


def _driving(layout: Layout) -> dict[int, Sequence[str]]:
    """The driven bodies, and the channels that each is driven by."""
    found: dict[int, Sequence[str]] = {
        k: body.acceleration for k, body in enumerate(layout.structure.bodies) if body.driven
    }
    return found | {k: (channel,) for channel, k in layout.attached.items()}


def _shown_by(channels: Mapping[int, Sequence[str]], experiment: Experiment, theta: np.ndarray) -> np.ndarray:
    """Acceleration (g, b) of bodies: the mean of their channels, if these err as theta says."""
    layout, record, _ = experiment
    a = np.zeros((len(layout.bodies), len(record.time))).T
    for k, names in channels.items():
        for name in names:
            a[:, k] += true_acceleration(record, name, distortion(layout, theta, name)) / len(names)
    return a


def true_acceleration(record: ObservedRecord, channel: str, d: Distortion) -> np.ndarray:
    """(g,) What a channel has measured, if it errs like that."""
    signal = record.signals[channel]
    recorded = np.interp(record.time + d.delay, signal.time, signal.values) if d.delay else signal.on_grid
    return (recorded - d.offset(record.time)) / (1.0 + d.gain)


def start_values(experiment: Experiment, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(b,) initial velocities and displacements, attached bodies included."""
    by = [theta[parameter] * change for parameter, change in start_by(experiment)]
    v0, x0 = np.array(stated_start(experiment)) + sum(by)
    return v0, x0


def start_by(experiment: Experiment) -> list[tuple[int, np.ndarray]]:
    """Their derivatives: (parameter, (2, b)). What touches late has farther to coast."""
    layout, record, r = experiment
    index, found = layout.structure.body_index, []
    v0, _ = stated_start(experiment)
    here = (term for term in layout.terms if term.addition.recording in ("", record.test.id))
    for term in (term for term in here if term.addition.effect.changes_start):
        faster = term.addition.effect.start_velocity(term.addition.target, index, v0)
        found.append((term.coefficient, np.array([faster, np.zeros_like(v0)])))
    if layout.late[r] >= 0:
        found.append((layout.late[r], np.array([np.zeros_like(v0), -v0])))
    return found


def stated_start(experiment: Experiment) -> tuple[np.ndarray, np.ndarray]:
    """(b,) initial velocities and displacements as the test states them."""
    layout, record, _ = experiment
    v0, x0 = np.zeros((2, len(layout.bodies)))
    own = slice(len(layout.structure.bodies))
    v0[own], x0[own] = record.initial_velocity, record.initial_displacement
    for addition in (term.addition for term in layout.terms if term.addition.attaches_body):
        k = layout.attached[addition.target]
        x0[k], v0[k] = attached_start(layout.structure, record, addition)
    return v0, x0


def measured_motion(experiment: Experiment, theta: np.ndarray) -> Trajectory:
    """What the sensors say of the motion, if they err as theta says."""
    own = {k: body.acceleration for k, body in enumerate(experiment.layout.structure.bodies) if body.free}
    return motion_of(experiment, theta, _shown_by(own, experiment, theta))


def motion_of(experiment: Experiment, theta: np.ndarray, free: np.ndarray) -> Trajectory:
    """The trajectory in which free bodies accelerate as given (g, bodies) and driven ones as theta says."""
    layout, record, _ = experiment
    a = driven_motion(experiment, theta)
    for k in np.flatnonzero(layout.kind == FREE):
        a[:, k] = free[:, k]
    v0, x0 = start_values(experiment, theta)
    v, x = integrate(record.dt, a, v0, x0)
    return Trajectory(a, v, x)
