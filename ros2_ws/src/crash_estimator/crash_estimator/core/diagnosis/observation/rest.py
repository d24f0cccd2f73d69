"""What a system's recordings say, before the impact, of their sensors' noise: all that are alike, together.

What is slow shows but a few times in some tens of milliseconds at rest: the same sensor in other recordings, and others
of the same kind, tell more of the noise's colour. A filter that runs backward, too, shows the motion before it begins:
where that hides the filter, the end of what is said to rest is left out.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from crash_replay.conditioning import RESTS_AT_ZERO
from crash_replay.onset import find_onset
from crash_replay.recording import Recording

from ...noise_spectrum import SLOWEST_FILTER, Colour, NoiseSpectrum, colour_of, seen_early
from ...sensor_noise import ENOUGH

EARLIEST = seen_early(SLOWEST_FILTER)
"""s before the impact in which any filter of SAE J211-1 may show what moves: they do not tell the noise's colour."""


class Quiet(NamedTuple):
    """What one recording says."""

    ends: int  # ns
    period: int  # us, between samples
    values: Mapping[tuple[str, str], np.ndarray]  # by quantity and channel, of those that rest; empty where too few
    early: float  # s before the stated time zero that the motion shows

    def without_the_last(self, seconds: float) -> "Quiet":
        """As it is where too little would be left."""
        samples = math.ceil(seconds * 1e6 / self.period)
        if samples == 0 or not self.values or any(len(rest) < samples + ENOUGH for rest in self.values.values()):
            return self
        values = {key: rest[:-samples] for key, rest in self.values.items()}
        return self._replace(ends=self.ends - samples * self.period * 1000, values=values)


class Rest(NamedTuple):
    """Of one recording, with what the others say."""

    ends: int  # ns
    colours: Mapping[str, Sequence[Colour]]
    """By channel, those that its noise may have: of all channels of its quantity in all recordings, and its own."""
    blurred: float = 0.0
    """s after the impact for which a filter that runs both ways shows what was before it as well: as long as any of the
    recordings shows the motion early."""


def quiet_of(recording: Recording) -> Quiet:
    """Until the stated time zero, or an earlier onset; motion is no noise of a sensor's."""
    onset = find_onset(recording)
    early = max(-onset.time, 0.0) if onset and onset.differs else 0.0
    end = min(0, onset.time_ns - onset.precision_ns) if onset and onset.differs else 0
    quiet = recording.time_ns < end
    rests = (channel for channel in recording.test.channels if channel.quantity in RESTS_AT_ZERO)
    values = {
        (channel.quantity, channel.name): bridged(recording, channel.name)[quiet]
        for channel in rests
        if np.count_nonzero(quiet) >= ENOUGH and np.isfinite(recording.column(channel.name)).any()
    }
    return Quiet(end, max(round(recording.sample_period * 1e6), 1), values, early)


def rest_of(one: Quiet, others: Sequence[Quiet]) -> Rest:
    """Others of the same system; only those that are sampled alike say something of its noise's colour."""
    alike = [one, *(other for other in others if other.period == one.period)]
    blurred = min(max(each.early for each in alike), EARLIEST)
    of_all = _colours(alike)
    if not seen_early_by(of_all.values()):  # or the end of the rests, which shows the motion, hides a filter
        early = seen_early_by(_colours([each.without_the_last(EARLIEST) for each in alike]).values())
        if early:
            one, *_ = alike = [each.without_the_last(early) for each in alike]
            of_all = _colours(alike)
    colours: dict[str, Sequence[Colour]] = {}
    for quantity, common in of_all.items():
        rests = _of_quantity(quantity, alike)
        for name in dict.fromkeys(name for name, _ in rests):
            colours[name] = common, colour_of([rest for its, rest in rests if its == name], one.period * 1e-6)
    return Rest(one.ends, colours, blurred)


def _of_quantity(quantity: str, alike: Sequence[Quiet]) -> list[tuple[str, np.ndarray]]:
    """Channels and their values at rest."""
    return [(name, rest) for each in alike for (what, name), rest in each.values.items() if what == quantity]


def _colours(alike: Sequence[Quiet]) -> dict[str, Colour]:
    """By quantity, of all its channels together."""
    quantities = dict.fromkeys(quantity for each in alike for quantity, _ in each.values)
    rests = {quantity: [rest for _, rest in _of_quantity(quantity, alike)] for quantity in quantities}
    return {quantity: colour_of(rests[quantity], alike[0].period * 1e-6) for quantity in quantities}


def seen_early_by(noises: Iterable[Colour | NoiseSpectrum]) -> float:
    """s before the motion begins in which the filters behind them may show it; 0 for none."""
    return max((seen_early(noise.corner) for noise in noises), default=0.0)


def rests_of(recordings: Sequence[Recording]) -> list[Rest]:
    """Of recordings of one system."""
    each = [quiet_of(recording) for recording in recordings]
    return [rest_of(one, [*each[:k], *each[k + 1 :]]) for k, one in enumerate(each)]


def bridged(recording: Recording, name: str) -> np.ndarray:
    """(n,) a channel's values, straight lines where they are not valid; some must be."""
    values = recording.column(name)
    valid = np.isfinite(values)
    return np.interp(recording.time_ns, recording.time_ns[valid], values[valid])
