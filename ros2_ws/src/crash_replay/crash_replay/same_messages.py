"""What two recordings of a replay in lock-step have in common to the last bit: on each topic that is about samples, the
messages in their order. When they came, and what a node says of itself meanwhile, differs from run to run."""

from pathlib import Path

from mcap.reader import make_reader

from .message_types import typestore
from .recorded_topics import NUMBERED, RANKING

SAME = NUMBERED | {RANKING, "crash_msgs/msg/Event", "crash_msgs/msg/Misfit"}


def messages_by_topic(file: Path) -> dict[str, list[tuple[int, bytes]]]:
    """Stamps in ns and messages of these topics."""
    found: dict[str, list[tuple[int, bytes]]] = {}
    with file.open("rb") as stream:
        for schema, channel, message in make_reader(stream).iter_messages(log_time_order=False):
            if schema is not None and schema.name in SAME:
                told = message.publish_time, tidy(message.data, schema.name)
                found.setdefault(channel.topic, []).append(told)
    return found


def tidy(data: bytes, kind: str) -> bytes:
    """The same message; the middleware leaves whatever was in memory in the gaps between fields."""
    return bytes(typestore().serialize_cdr(typestore().deserialize_cdr(data, kind), kind))
