"""Which part of a recording is replayed: its channels by name, its samples by time."""

from collections.abc import Sequence
from dataclasses import replace
from difflib import get_close_matches
from fnmatch import fnmatchcase
from typing import NamedTuple

import numpy as np

from .fault import Fault
from .recording import Recording

SECOND = 1_000_000_000


class SelectionError(Fault):
    """Nothing would be left to replay; the message is one readable line."""


class Window(NamedTuple):
    """From A to B: what all four leave is played. The parameters are called PARAMETERS."""

    start_offset: float = 0.0  # s after the first sample
    duration: float = 0.0  # s from there; 0: to the end
    begin: float = -np.inf  # s since the impact, parameter `from`
    until: float = np.inf  # s since the impact


PARAMETERS = ("start_offset", "duration", "from", "until")


def samples_within(window: Window, time_ns: np.ndarray) -> tuple[int, int]:
    """The window's samples first, ..., end - 1, both its ends included; time_ns (n,) ns since the impact, increasing.

    Raises SelectionError where there are none.
    """
    start = time_ns[0] + round(window.start_offset * SECOND)
    # rounded to ns: 0.0348 s is a sample of 10 kHz, though no float is
    low = max(start, _ns(window.begin))
    high = min(start + round(window.duration * SECOND) if window.duration else np.inf, _ns(window.until))
    first, end = int(np.searchsorted(time_ns, low)), int(np.searchsorted(time_ns, high, side="right"))
    if first < end:
        return first, end
    asked = [
        f"{name} {value:g} s" for name, value, none in zip(PARAMETERS, window, Window(), strict=True) if value != none
    ]
    there = f"{time_ns[0] / SECOND:g} to {time_ns[-1] / SECOND:g} s"
    raise SelectionError(f"no sample to play with {', '.join(asked)}: the test has samples from {there}")


def _ns(seconds: float) -> float:
    return float(round(seconds * SECOND)) if np.isfinite(seconds) else seconds


def select_channels(recording: Recording, wanted: Sequence[str] = (), excluded: Sequence[str] = ()) -> Recording:
    """The recording with the channels that `wanted` (none: all) names and `excluded` does not.

    Both hold names and patterns of the shell's kind, such as rib_*. Raises SelectionError where one fits no channel.
    """
    names = recording.test.channel_names
    kept = _fitting(names, wanted, "channels") if wanted else set(names)
    kept -= _fitting(names, excluded, "exclude")
    if not kept:
        raise SelectionError("no channel is left of channels and exclude: name fewer in exclude")
    if len(kept) == len(names):
        return recording
    columns = [k for k, name in enumerate(names) if name in kept]
    channels = tuple(recording.test.channels[k] for k in columns)
    values = np.ascontiguousarray(recording.values[:, columns])
    return replace(recording, test=replace(recording.test, channels=channels), values=values)


def _fitting(names: Sequence[str], patterns: Sequence[str], parameter: str) -> set[str]:
    found = set()
    for pattern in patterns:
        fitting = {name for name in names if fnmatchcase(name, pattern)}
        if not fitting:
            near = get_close_matches(pattern, names, n=1)
            hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(names)}"
            raise SelectionError(f"parameter {parameter}: the recording has no channel {pattern}: {hint}")
        found |= fitting
    return found
