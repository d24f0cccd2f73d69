"""What a system's recordings say, before the impact, of their sensors' noise: all that are alike, together.

What is slow shows but a few times in some tens of milliseconds at rest: the same sensor in other recordings, and others
of the same kind, tell more of the noise's colour.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from crash_replay.conditioning import RESTS_AT_ZERO
from crash_replay.onset import find_onset
from crash_replay.recording import Recording

from ...noise_spectrum import Colour, colour_of
from ...sensor_noise import ENOUGH


class Rest(NamedTuple):
    """Of one recording."""

    ends: int  # ns
    colours: Mapping[str, Sequence[Colour]]
    """By channel, those that its noise may have: of all channels of its quantity in all recordings, and its own."""


def rests_of(recordings: Sequence[Recording]) -> list[Rest]:
    """Of recordings of one system; only those that are sampled alike say something of each other's colour."""
    ends = [_rest_ends(recording) for recording in recordings]
    by_period: dict[int, list[dict[str, np.ndarray]]] = {}
    for recording, end in zip(recordings, ends, strict=True):
        by_period.setdefault(_period(recording), []).append(_at_rest(recording, end))
    colours = {period: _colours(rests, recordings[0]) for period, rests in by_period.items()}
    return [Rest(end, colours[_period(recording)]) for recording, end in zip(recordings, ends, strict=True)]


def _rest_ends(recording: Recording) -> int:
    """Until when nothing moves, the stated time zero or an earlier onset; motion is no noise of a sensor's."""
    onset = find_onset(recording)
    return min(0, onset.time_ns - onset.precision_ns) if onset and onset.differs else 0


def _period(recording: Recording) -> int:
    """us, between samples."""
    return round(recording.sample_period * 1e6)


def _at_rest(recording: Recording, end: int) -> dict[str, np.ndarray]:
    """Values of the channels that rest, where there are enough of them."""
    quiet = recording.time_ns < end
    if np.count_nonzero(quiet) < ENOUGH:
        return {}
    names = [channel.name for channel in recording.test.channels if channel.quantity in RESTS_AT_ZERO]
    valid = [name for name in names if np.isfinite(recording.column(name)).any()]
    return {name: bridged(recording, name)[quiet] for name in valid}


def _colours(rests: Sequence[Mapping[str, np.ndarray]], first: Recording) -> dict[str, Sequence[Colour]]:
    quantity = {channel.name: channel.quantity for channel in first.test.channels}
    alike: dict[str, list[str]] = {}
    for name in dict.fromkeys(name for rest in rests for name in rest):
        alike.setdefault(quantity.get(name, name), []).append(name)
    found: dict[str, Sequence[Colour]] = {}
    for names in alike.values():
        of_each = {name: [rest[name] for rest in rests if name in rest] for name in names}
        of_all = colour_of([rest for each in of_each.values() for rest in each])
        found |= {name: (of_all, colour_of(each)) for name, each in of_each.items()}
    return found


def bridged(recording: Recording, name: str) -> np.ndarray:
    """(n,) a channel's values, straight lines where they are not valid; some must be."""
    values = recording.column(name)
    valid = np.isfinite(values)
    return np.interp(recording.time_ns, recording.time_ns[valid], values[valid])
