"""Which part of a recording is replayed: its channels by name, its samples by time."""

import re
from collections.abc import Sequence
from dataclasses import replace
from difflib import get_close_matches
from fnmatch import fnmatchcase
from typing import NamedTuple

import numpy as np

from .fault import Fault
from .recording import Recording
from .time_unit import SECOND


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
    asked = [f"{name} {value:g} s" for name, value, none in zip(PARAMETERS, window, Window()) if value != none]
    there = f"{time_ns[0] / SECOND:g} to {time_ns[-1] / SECOND:g} s"
    raise SelectionError(f"no sample to play with {', '.join(asked)}: the test has samples from {there}")


def _ns(seconds: float) -> float:
    return float(round(seconds * SECOND)) if np.isfinite(seconds) else seconds


def select_channels(
    recording: Recording,
    wanted: Sequence[str] = (),
    excluded: Sequence[str] = (),
    regex: str = "",
    exclude_regex: str = "",
) -> Recording:
    """The recording with the channels that `wanted` or `regex` choose (neither: all), less the excluded ones.

    The lists hold names and patterns of the shell's kind, such as rib_*; regular expressions are searched for in names.
    Raises SelectionError where one fits no channel, where an expression is none, and where nothing is left.
    """
    names = recording.test.channel_names
    chosen = _fitting(names, wanted, "channels") | _found(names, regex, "regex")
    kept = chosen if wanted or regex else set(names)
    kept -= _fitting(names, excluded, "exclude") | _found(names, exclude_regex, "exclude_regex")
    if not kept:
        raise SelectionError("no channel is left of what is chosen: exclude fewer")
    if len(kept) == len(names):
        return recording
    columns = [k for k, name in enumerate(names) if name in kept]
    channels = tuple(recording.test.channels[k] for k in columns)
    values = np.ascontiguousarray(recording.values[:, columns])
    return replace(recording, test=replace(recording.test, channels=channels), values=values)


def regular_expression(text: str, parameter: str) -> re.Pattern:
    """Raises SelectionError where it is none."""
    try:
        return re.compile(text)
    except re.error as error:
        raise SelectionError(f"parameter {parameter} must be a regular expression, got {text!r}: {error}") from None


def _found(names: Sequence[str], text: str, parameter: str) -> set[str]:
    pattern = regular_expression(text, parameter)
    found = {name for name in names if text and pattern.search(name)}
    if text and not found:
        there = ", ".join(names)
        raise SelectionError(f"parameter {parameter}: {text!r} is found in no channel's name: there are {there}")
    return found


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
