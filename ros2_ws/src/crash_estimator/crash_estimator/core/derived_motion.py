"""Accelerations of bodies that are observed by their displacement or velocity alone, found from the whole recording,
and of those that nothing observes, by the momentum.

The derivative is that of a local polynomial (Savitzky and Golay 1964), over the longest window that still follows the
channel to within its noise. It looks ahead: nothing here serves a node that follows sample by sample.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from crash_replay.recording import Channel, Recording

from .differences import by_differences, by_rounding
from .momentum import acceleration_by_momentum
from .structure import Body, ModelError, Structure

ORDER = 4
"""Of the local polynomial: its second derivative is a parabola, as an acceleration between its inflections is."""
WINDOWS = (5, 7, 11, 15, 21, 31, 43, 61, 85, 121)
"""Samples, each about 1.4 times the one before. The first passes through all of its samples, and leaves nothing."""
FOLLOWS = 1.5
"""What a window leaves, as a multiple of what white noise leaves of it: more, and it has cut the motion itself."""


class Smoothed(NamedTuple):
    """A channel (n,) and its derivatives by the time, in its unit per s and per s^2."""

    value: np.ndarray
    first: np.ndarray
    second: np.ndarray


def with_accelerations(
    structure: Structure, recordings: Sequence[Recording]
) -> tuple[Structure, tuple[Recording, ...]]:
    """The same where every free body has an acceleration channel: a derived one where it is observed otherwise, or not
    at all.

    Where a test does not say how a body starts that is observed by its displacement or velocity, that channel says it.
    """
    names = {
        body.name: f"{body.motion_channel or body.name}_derived_acceleration"
        for body in structure.bodies if body.free and not body.acceleration
    }  # fmt: skip
    if not names:
        return structure, tuple(recordings)
    derived = [
        replace(body, acceleration=(names[body.name],), derived=True) if body.name in names else body
        for body in structure.bodies
    ]
    observed = [body for body in derived if body.name in names and body.motion_channel]
    unobserved = [body for body in derived if not body.is_measured and body.name in names]
    structure = replace(structure, bodies=tuple(derived))
    found = []
    for recording in recordings:
        for body in observed:
            recording = _with_acceleration(recording, body, names[body.name])
        for body in unobserved:
            values = acceleration_by_momentum(structure, body.name, recording)
            channel = Channel(names[body.name], "acceleration", body.name, source="derived from the momentum")
            recording = _with_channel(recording, channel, values)
        found.append(recording)
    return structure, tuple(found)


def _with_acceleration(recording: Recording, body: Body, name: str) -> Recording:
    test = recording.test
    values = recording.column(body.motion_channel)
    valid = np.isfinite(values)
    if not valid.any():
        raise ModelError(f"test {test.id}: channel {body.motion_channel} has no valid sample")
    bridged = np.interp(recording.time, recording.time[valid], values[valid])
    found = smoothed(bridged, recording.sample_period)
    start = int(np.searchsorted(recording.time_ns, 0))
    start = min(start, len(values) - 1)
    velocity, acceleration = (found.first, found.second) if body.displacement else (found.value, found.first)
    displacement = {body.name: float(found.value[start])} if body.displacement else {}
    test = replace(
        test,
        initial_velocity={body.name: float(velocity[start])} | dict(test.initial_velocity),
        initial_displacement=displacement | dict(test.initial_displacement),
    )
    channel = Channel(name, "acceleration", body.name, source=f"derived from {body.motion_channel}")
    return _with_channel(replace(recording, test=test), channel, np.where(valid, acceleration, np.nan))


def _with_channel(recording: Recording, channel: Channel, values: np.ndarray) -> Recording:
    test = replace(recording.test, channels=(*recording.test.channels, channel))
    return replace(recording, test=test, values=np.column_stack([recording.values, values]))


def smoothed(values: np.ndarray, period: float) -> Smoothed:
    """Of values (n,) on an even grid of `period` s."""
    from scipy.signal import savgol_filter  # it takes longer to import than all the rest: few models need it

    best = WINDOWS[0]
    if len(values) < best:
        nothing = np.full_like(values, np.nan)
        return Smoothed(values, nothing, nothing)
    noise = max(by_differences(values), by_rounding(values))
    for window in WINDOWS[1:]:
        if window > len(values):
            break
        kept = savgol_filter(values, window, ORDER)
        share = 1.0 - savgol_filter(np.eye(1, window, window // 2)[0], window, ORDER)[window // 2]
        if float(np.std(values - kept)) > FOLLOWS * noise * np.sqrt(share):
            break
        best = window
    return Smoothed(*(savgol_filter(values, best, ORDER, deriv=k, delta=period) for k in range(3)))


def between_samples(time: np.ndarray, values: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """A measured force (n,) as a function of the time in s: what oscillates with few samples a period keeps its size.

    A straight line between samples would take 4 % off what has nine of them a period. Raises ModelError where fewer
    than two are valid.
    """
    from scipy.interpolate import CubicSpline  # late, as above

    valid = np.isfinite(values)
    if np.count_nonzero(valid) < 2:
        raise ModelError("a force that is applied to a body needs two valid samples at least")
    offset = values[valid & (time < 0.0)].mean() if (valid & (time < 0.0)).any() else 0.0
    return CubicSpline(time[valid], values[valid] - offset)
