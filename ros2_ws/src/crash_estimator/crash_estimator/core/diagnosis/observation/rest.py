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


class Quiet(NamedTuple):
    """What one recording says."""

    ends: int  # ns
    period: int  # us, between samples
    values: Mapping[tuple[str, str], np.ndarray]  # by quantity and channel, of those that rest; empty where too few


class Rest(NamedTuple):
    """Of one recording, with what the others say."""

    ends: int  # ns
    colours: Mapping[str, Sequence[Colour]]
    """By channel, those that its noise may have: of all channels of its quantity in all recordings, and its own."""


def quiet_of(recording: Recording) -> Quiet:
    """Until the stated time zero, or an earlier onset; motion is no noise of a sensor's."""
    onset = find_onset(recording)
    end = min(0, onset.time_ns - onset.precision_ns) if onset and onset.differs else 0
    quiet = recording.time_ns < end
    rests = (channel for channel in recording.test.channels if channel.quantity in RESTS_AT_ZERO)
    values = {
        (channel.quantity, channel.name): bridged(recording, channel.name)[quiet]
        for channel in rests
        if np.count_nonzero(quiet) >= ENOUGH and np.isfinite(recording.column(channel.name)).any()
    }
    return Quiet(end, round(recording.sample_period * 1e6), values)


def rest_of(one: Quiet, others: Sequence[Quiet] = ()) -> Rest:
    """Others of the same system; only those that are sampled alike say something of its noise's colour."""
    alike = [one, *(other for other in others if other.period == one.period)]
    colours: dict[str, Sequence[Colour]] = {}
    for quantity in dict.fromkeys(quantity for quantity, _ in one.values):
        rests = [(name, rest) for each in alike for (what, name), rest in each.values.items() if what == quantity]
        of_all = colour_of([rest for _, rest in rests])
        for name in dict.fromkeys(name for name, _ in rests):
            colours[name] = of_all, colour_of([rest for its, rest in rests if its == name])
    return Rest(one.ends, colours)


def rests_of(recordings: Sequence[Recording]) -> list[Rest]:
    """Of recordings of one system."""
    each = [quiet_of(recording) for recording in recordings]
    return [rest_of(one, [*each[:k], *each[k + 1 :]]) for k, one in enumerate(each)]


def bridged(recording: Recording, name: str) -> np.ndarray:
    """(n,) a channel's values, straight lines where they are not valid; some must be."""
    values = recording.column(name)
    valid = np.isfinite(values)
    return np.interp(recording.time_ns, recording.time_ns[valid], values[valid])
