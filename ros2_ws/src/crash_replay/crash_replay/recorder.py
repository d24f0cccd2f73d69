"""What a replay's listeners publish, as one MCAP file that is the same for the same messages. No graph here.

Messages are kept until the end and written in the order of their stamps, those of one instant by topic and in the
order in which they came: when they happened to arrive does not show.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from .bag_writer import LATCHED, STREAM, TopicToWrite, write_mcap
from .message_types import typestore

ENCAPSULATION = 4
"""Bytes of a serialized message before its fields; the first of these are its stamp."""

SECOND = 1_000_000_000


class Heard(NamedTuple):
    """A topic that is recorded."""

    name: str
    type: str
    latched: bool  # without a header: written at the first stamp


def stamp_of(data: bytes) -> int:
    """ns of the header that a serialized message begins with."""
    order = "little" if data[1] & 1 else "big"
    seconds, rest = (data[ENCAPSULATION + k : ENCAPSULATION + k + 4] for k in (0, 4))
    return int.from_bytes(seconds, order, signed=True) * SECOND + int.from_bytes(rest, order)


def tidy(data: bytes, kind: str) -> bytes:
    """The same message; the middleware leaves whatever was in memory in the gaps between fields."""
    return bytes(typestore().serialize_cdr(typestore().deserialize_cdr(data, kind), kind))


@dataclass
class Recorder:
    """Topics and what came on them; `hear` and `write` may be called from different threads one after the other."""

    messages: dict[Heard, list[bytes]] = field(default_factory=dict)

    def hear(self, topic: Heard, data: bytes) -> None:
        self.messages.setdefault(topic, []).append(data)

    @property
    def count(self) -> int:
        return sum(map(len, self.messages.values()))

    def write(self, file: Path) -> None:
        """Write all that came; what has no stamp first, with the first stamp."""
        topics = sorted(self.messages)
        stamped = sorted(self._stamped(topics))
        first = stamped[0][0] if stamped else 0
        counts = [(k, len(self.messages[topic])) for k, topic in enumerate(topics) if topic.latched]
        latched = [(k, first, n) for k, count in counts for n in range(count)]
        ordered = [*latched, *((k, stamp, n) for stamp, k, n in stamped)]
        write_mcap(
            file,
            [TopicToWrite(topic.name, topic.type, LATCHED if topic.latched else STREAM) for topic in topics],
            ((k, stamp, tidy(self.messages[topics[k]][n], topics[k].type)) for k, stamp, n in ordered),
        )

    def _stamped(self, topics: list[Heard]) -> Iterable[tuple[int, int, int]]:
        for k, topic in enumerate(topics):
            if not topic.latched:
                yield from ((stamp_of(data), k, n) for n, data in enumerate(self.messages[topic]))
