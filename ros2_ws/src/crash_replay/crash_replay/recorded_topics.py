"""Which topics `record` writes, and what it can tell of their messages without making objects of them."""

import re
import struct
from collections.abc import Iterable, Sequence
from fnmatch import fnmatchcase
from typing import NamedTuple

from .channel_messages import CARRIERS, SECOND

SAMPLES, PARAMETERS, RESIDUALS, FORCES = (
    f"crash_msgs/msg/{name}" for name in ("Samples", "ParametersBlock", "ResidualsBlock", "Forces")
)
DIAGNOSTICS = "diagnostic_msgs/msg/DiagnosticArray"
TEST, RANKING, REVISION = (f"crash_msgs/msg/{name}" for name in ("TestInfo", "Ranking", "Revision"))
NUMBERED = {SAMPLES, PARAMETERS, RESIDUALS, FORCES, REVISION}
"""Messages that say which samples they are about."""
NAMED = {"crash_msgs/msg/Parameters", "crash_msgs/msg/Residuals"}
"""Of one sample each, made only while somebody listens: the blocks hold the same."""
CHANNELS, CLOCK = {carrier.type for carrier in CARRIERS.values()}, "rosgraph_msgs/msg/Clock"
WITHOUT_STAMP = {TEST, "crash_msgs/msg/Answer", "crash_msgs/msg/Attendance"}
STAMPED = NUMBERED | NAMED | {
    *CHANNELS, CLOCK, RANKING, "crash_msgs/msg/Misfit", "crash_msgs/msg/Event", "crash_msgs/msg/EstimatorState",
    "crash_msgs/msg/ReplayState", DIAGNOSTICS,
}  # fmt: skip
"""Messages that begin with a stamp."""
SAID_BY_NODE = {"crash_msgs/msg/Answer", "crash_msgs/msg/Attendance"}
"""Messages of several nodes on one topic, that begin with the node's name."""

BEGINNING = 4
"""Bytes of a serialized message before its fields."""


class Choice(NamedTuple):
    """Names or patterns: /sled_a/kalman/* of the whole graph, kalman/* of the recorder's own namespace."""

    topics: Sequence[str] = ()  # none: all but those that hold what `samples` and the blocks hold as well
    exclude: Sequence[str] = ()
    namespace: str = "/"
    regex: str = ""  # regular expressions, searched for in a topic's full name
    exclude_regex: str = ""

    def wants(self, name: str, kind: str, own: bool = True) -> bool:
        """own: whether the topic is of the recorder's namespace; of another one it has to be asked for in full."""
        if kind not in STAMPED | WITHOUT_STAMP or (kind in CHANNELS and "/channels/" not in name):
            return False
        topics = [pattern for pattern in self.topics if own or pattern.startswith("/")]
        chosen = self.fits(name, topics) or (own and _found(self.regex, name))
        if own and not (self.topics or self.regex):
            chosen = kind not in CHANNELS | NAMED | {CLOCK}
        return chosen and not (self.fits(name, self.exclude) or _found(self.exclude_regex, name))

    def wants_channel(self, name: str) -> bool:
        """Of the recorder's own namespace, whatever type carries it."""
        return any(self.wants(name, kind) for kind in CHANNELS)

    def in_vain(self, names: Iterable[str]) -> list[str]:
        """Those of `topics` that no recorded topic fits."""
        names = list(names)
        return [pattern for pattern in self.topics if not any(self.fits(name, [pattern]) for name in names)]

    def fits(self, name: str, patterns: Sequence[str]) -> bool:
        relative = name.removeprefix(f"{self.namespace.rstrip('/')}/")
        return any(fnmatchcase(name, pattern) or fnmatchcase(relative, pattern) for pattern in patterns)


def _found(regex: str, name: str) -> bool:
    return bool(regex) and re.search(regex, name) is not None


def stamp_of(data: bytes) -> int:
    """ns of the stamp that a serialized message begins with."""
    seconds, rest = struct.unpack_from(f"{order(data)}iI", data, BEGINNING)
    return seconds * SECOND + rest


class About(NamedTuple):
    """Which samples a message is about: number, ..., number + count - 1 of a pass."""

    run: int
    number: int
    count: int  # type: ignore[assignment]  # hides the tuple's own method


def about(data: bytes) -> About:
    """Of a message of one of the types NUMBERED: stamp, frame, run, number, time_ns (plain CDR, see cdr.py)."""
    return _about(data)[0]


def instants_of(data: bytes) -> list[int]:
    """ns, as in the stamps of the channels' messages, of the samples that such a message is about."""
    (_, _, count), at = _about(data)
    times = struct.unpack_from(f"{order(data)}{count}q", data, at)
    return [stamp_of(data) + time - times[0] for time in times]


def _about(data: bytes) -> tuple[About, int]:
    """With where its time_ns begin."""
    (text,) = struct.unpack_from(f"{order(data)}I", data, BEGINNING + 8)
    at = _aligned(BEGINNING + 12 + text, 4)
    (run,) = struct.unpack_from(f"{order(data)}I", data, at)
    at = _aligned(at + 4, 8)
    number, count = struct.unpack_from(f"{order(data)}QI", data, at)
    at = _aligned(at + 12, 8)
    _expect(data, at + 8 * count)
    return About(run, number, count), at


def sayer_of(data: bytes) -> str:
    """The node's name that a message of one of the types SAID_BY_NODE begins with."""
    (length,) = struct.unpack_from(f"{order(data)}I", data, BEGINNING)
    _expect(data, BEGINNING + 4 + length)
    return data[BEGINNING + 4 : BEGINNING + 3 + length].decode()


def unreadable(kind: str, data: bytes) -> str:
    """Why nothing can be told of a message of one of these types, or ""."""
    try:
        if kind in STAMPED:
            stamp_of(data)
        if kind in NUMBERED:
            about(data)
        if kind in SAID_BY_NODE:
            sayer_of(data)
    except (struct.error, IndexError, UnicodeDecodeError) as error:
        return f"expected {kind}, found {len(data)} bytes that are none ({error})"
    return ""


def order(data: bytes) -> str:
    """The message's byte order, as struct writes it."""
    return "<" if data[1] & 1 else ">"


def _expect(data: bytes, end: int) -> None:
    if len(data) < end:
        raise struct.error(f"it says that it has {end} at least")


def _aligned(at: int, size: int) -> int:
    return at + (BEGINNING - at) % size
