"""A recorded crash test: named channels in SI units on one time base, and where they came from.

Pure data: no file format and no ROS here. Readers make recordings (`readers/`), `bag.py` stores
them, the nodes and commands fold them through estimators sample by sample.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import NamedTuple

import numpy as np

from . import limits
from .fault import Fault
from .foreign_text import visible

SI_UNIT = {
    "acceleration": "m/s^2",
    "velocity": "m/s",
    "displacement": "m",
    "force": "N",
    "moment": "N*m",
    "angular_velocity": "rad/s",
}
"""The quantities a channel may have, and the unit its values are in."""


class RecordingError(Fault):
    """The data or a file that describes it is at fault; the message is one readable line."""


class Sample(NamedTuple):
    """All channels at one instant."""

    number: int  # counted from 0 at the recording's first sample
    time_ns: int  # ns since the impact
    values: np.ndarray  # (channels,) SI; NaN where a channel has no valid value

    @property
    def time(self) -> float:
        """Seconds since the impact."""
        return self.time_ns * 1e-9


@dataclass(frozen=True)
class Channel:
    """One sensor's name and meaning; its values are a column of `Recording.values`. Its texts can be printed."""

    name: str
    quantity: str  # a key of SI_UNIT
    body: str = ""
    axis: str = ""  # x, y, z, or "" where the quantity has none
    source: str = ""  # file, column or curve

    def __post_init__(self):
        for text in ("name", "quantity", "body", "axis", "source"):
            object.__setattr__(self, text, visible(getattr(self, text)))
        if self.quantity not in SI_UNIT:
            raise RecordingError(
                f"channel {self.name}: quantity must be one of {', '.join(SI_UNIT)}, got {self.quantity!r}"
            )

    @property
    def unit(self) -> str:
        return SI_UNIT[self.quantity]


@dataclass(frozen=True)
class Test:
    """What a test is, without its samples. Its texts can be printed."""

    id: str
    channels: tuple[Channel, ...]
    title: str = ""
    source: str = ""
    initial_velocity: Mapping[str, float] = field(default_factory=dict)  # body -> m/s, at time zero and before
    initial_displacement: Mapping[str, float] = field(default_factory=dict)  # body -> m at time zero
    notes: tuple[str, ...] = ()  # what the import did and left out
    impact_ns: int = 0  # when it was: ns since 1970, UTC; 0: not known

    __test__ = False  # not a pytest class

    def __post_init__(self):
        for text in ("id", "title", "source"):
            object.__setattr__(self, text, visible(getattr(self, text)))
        for by_body in ("initial_velocity", "initial_displacement"):
            object.__setattr__(self, by_body, {visible(body): value for body, value in getattr(self, by_body).items()})
        object.__setattr__(self, "notes", tuple(map(visible, self.notes)))
        doubled = [name for name, count in Counter(self.channel_names).items() if count > 1]
        if doubled:
            raise RecordingError(f"test {self._shown}: channel {min(doubled)} appears more than once")
        if wrong := self._what_is_wrong():
            raise RecordingError(f"test {self._shown}: {wrong}")

    def _what_is_wrong(self) -> str:
        """Of the numbers and texts."""
        for what, motion, limit in (
            ("initial velocity", self.initial_velocity, limits.VELOCITY),
            ("initial displacement", self.initial_displacement, limits.DISPLACEMENT),
        ):
            for body, value in motion.items():
                if wrong := limit.wrong(value):
                    return f"{what} of {limits.shown(body)} {wrong}"
        of_channels = (text for c in self.channels for text in (c.name, c.body, c.source))
        texts = (self.id, self.title, self.source, *of_channels, *self.initial_velocity, *self.notes)
        return limits.count_wrong("has", len(self.channels), limits.CHANNELS) or limits.text_wrong(texts)

    @property
    def _shown(self) -> str:
        return self.id if len(self.id) <= 60 else limits.shown(self.id)

    @property
    def channel_names(self) -> tuple[str, ...]:
        return tuple(channel.name for channel in self.channels)

    def index(self, name: str, wanted_by: str = "") -> int:
        """Column of the channel `name`; a RecordingError that names the nearest ones if there is none."""
        names = self.channel_names
        if name in names:
            return names.index(name)
        near = get_close_matches(name, names, n=3, cutoff=0.5) or sorted(names)[:8]
        by = f" (wanted by {wanted_by})" if wanted_by else ""
        raise RecordingError(f"test {self.id} has no channel {name!r}{by}; nearest: {', '.join(near) or 'none at all'}")


@dataclass(frozen=True)
class Recording:
    """A test and its samples.

    time_ns (n,) int64, ns since the impact, strictly increasing, samples before it negative;
    values (n, channels) float64 in SI units, NaN where a channel has no valid value.
    """

    test: Test
    time_ns: np.ndarray
    values: np.ndarray

    def __post_init__(self):
        expected = (len(self.time_ns), len(self.test.channels))
        if self.values.shape != expected:
            raise RecordingError(f"test {self.test.id}: values must have shape {expected}, got {self.values.shape}")
        if not len(self.time_ns):
            raise RecordingError(f"test {self.test.id} has no samples")
        wrong = limits.size_wrong(*expected) or limits.times_wrong(self.time_ns[[0, -1]] * 1e-9)
        if wrong:
            raise RecordingError(f"test {self.test.id}: {wrong}")
        backwards = np.flatnonzero(np.diff(self.time_ns) <= 0)
        if len(backwards):
            k = int(backwards[0]) + 1
            raise RecordingError(
                f"test {self.test.id}: time must increase from sample to sample, but sample {k} at "
                f"{self.time_ns[k] * 1e-9:.6f} s follows {self.time_ns[k - 1] * 1e-9:.6f} s"
            )

    def __len__(self) -> int:
        return len(self.time_ns)

    @property
    def has_values(self) -> bool:
        """Whether any channel has a valid value anywhere."""
        return bool(np.isfinite(self.values).any())

    @property
    def time(self) -> np.ndarray:
        """(n,) seconds since the impact."""
        return self.time_ns * 1e-9

    @property
    def sample_period(self) -> float:
        """Median step of time, s (0 for a single sample)."""
        return float(np.median(np.diff(self.time_ns))) * 1e-9 if len(self) > 1 else 0.0

    def column(self, name: str) -> np.ndarray:
        """(n,) values of one channel, SI."""
        return self.values[:, self.test.index(name)]

    def samples(self) -> Iterator[Sample]:
        """The samples in order, as a live replay would deliver them."""
        for number, (time_ns, values) in enumerate(zip(self.time_ns.tolist(), self.values)):
            yield Sample(number, time_ns, values)
