"""What messages say, piece by piece: as they were heard, and as they stand in a recording."""

import hashlib
from array import array
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from crash_msgs.msg import ParametersBlock, Ranking, Samples
from mcap.reader import make_reader
from rclpy.serialization import deserialize_message

KINDS = {f"crash_msgs/msg/{kind.__name__}": kind for kind in (Samples, ParametersBlock, Ranking)}


def estimates_in(message: ParametersBlock) -> Iterator[tuple[int, str]]:
    """Number of each sample of the block, and a digest of what is estimated after it."""
    return _by_number(message, message.value, message.std, message.status)


def samples_in(message: Samples) -> Iterator[tuple[int, str]]:
    return _by_number(message, message.time_ns, message.values)


def answer_in(message: Ranking) -> str:
    return f"{message.model}: {message.text} ({', '.join(message.found) or 'nothing'})"


def recorded(file: Path) -> dict[str, str]:
    """The last that a recording has of each piece; raises whatever mcap's reader raises."""
    found: dict[str, str] = {}
    with file.open("rb") as stream:
        for schema, channel, message in make_reader(stream, validate_crcs=True).iter_messages(log_time_order=False):
            if schema is None or schema.name not in KINDS:
                continue
            said = deserialize_message(message.data, KINDS[schema.name])
            if isinstance(said, Ranking):
                if said.final:
                    found[f"{channel.topic} {said.revision}"] = answer_in(said)
                continue
            pieces = samples_in(said) if isinstance(said, Samples) else estimates_in(said)
            found |= {f"{channel.topic} {number}": digest for number, digest in pieces}
    return found


def says_incomplete(file: Path) -> bool:
    """Whether a recording says of itself that something is missing."""
    with file.open("rb") as stream:
        return any(record.metadata.get("complete") == "false" for record in make_reader(stream).iter_metadata())


def _by_number(message: Samples | ParametersBlock, *columns: array) -> Iterator[tuple[int, str]]:
    count = len(message.time_ns)
    rows = [np.asarray(column).reshape(count, -1) for column in columns]
    for k in range(count):
        data = b"".join(row[k].tobytes() for row in rows)
        yield message.number + k, hashlib.blake2b(data, digest_size=8).hexdigest()
