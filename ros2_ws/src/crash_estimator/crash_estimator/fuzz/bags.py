"""Bags that are wrong on purpose: other messages, other compression, chunks that lie about themselves."""

import struct
from functools import cache
from io import BytesIO
from random import Random

import zstandard
from mcap.writer import CompressionType, IndexType, Writer

from .mutations import INTEGERS, spoilt_bytes, spoilt_message
from .valid import TEST_INFO, Files, bag

MAGIC = b"\x89MCAP0\r\n"
BOMBS = (20_000_000, 300_000_000, 3_000_000_000)


@cache
def valid() -> tuple[Files, list[tuple[str, str, int, bytes]]]:
    return bag()


@cache
def bomb(size: int) -> bytes:
    """Zeros, packed 30 000 times smaller."""
    packer, block = zstandard.ZstdCompressor().compressobj(size=size), bytes(1_000_000)
    return b"".join(packer.compress(block) for _ in range(size // len(block))) + packer.flush()


def spoilt_bag(rng: Random) -> Files:
    files, messages = valid()
    kind = rng.random()
    if kind < 0.3:
        return {"small.mcap": spoilt_bytes(rng, files["small.mcap"])}
    if kind < 0.35:
        return {
            "small.mcap": MAGIC + _record(1, _text("ros2") + _text("x")) + _chunk(rng) + _record(15, bytes(4)) + MAGIC
        }
    return {"small.mcap": _written(rng, _spoilt_messages(rng, messages))}


def _spoilt_messages(rng: Random, messages: list) -> list[tuple[str, str, int, bytes]]:
    spoilt = list(messages)
    if rng.random() < 0.5:
        spoilt[0] = (*messages[0][:3], spoilt_message(rng, TEST_INFO))
    for _ in range(rng.choice((0, 1, 1, 3, 30))):
        k = rng.randrange(len(spoilt))
        topic, kind, stamp, data = spoilt[k]
        match rng.randrange(6):
            case 0:
                del spoilt[k + rng.choice((0, 1)) :]
            case 1:
                spoilt[k] = rng.choice(spoilt)[0], kind, stamp, data
            case 2:
                spoilt[k] = topic, rng.choice(spoilt)[1], stamp, data
            case 3:
                spoilt.append(spoilt[k])
            case 4:
                at = 4 + 4 * rng.randrange(2)
                spoilt[k] = (
                    topic,
                    kind,
                    stamp,
                    data[:at] + struct.pack("<I", rng.choice(INTEGERS) % 2**32) + data[at + 4 :],
                )
            case _:
                spoilt[k] = topic, kind, stamp, spoilt_bytes(rng, data)
        if not spoilt:
            break
    return spoilt


def _written(rng: Random, messages: list[tuple[str, str, int, bytes]]) -> bytes:
    out = BytesIO()
    compression = rng.choice(list(CompressionType))
    writer = Writer(out, rng.choice((200, 2**20)), compression, IndexType.NONE, use_chunking=rng.random() < 0.8)
    writer.start(profile="ros2")
    ids: dict[tuple[str, str], int] = {}
    for topic, kind, stamp, data in messages:
        if (topic, kind) not in ids:
            schema = writer.register_schema(kind, "ros2msg", b"")
            ids[topic, kind] = writer.register_channel(topic, "cdr", schema)
        writer.add_message(ids[topic, kind], stamp, data, stamp)
    writer.finish()
    return out.getvalue()


def _chunk(rng: Random) -> bytes:
    """One that unpacks to something else than it says, or to more than there is memory for."""
    real = rng.choice(BOMBS)
    said = rng.choice((0, 10, real, 2**40, 2**63))
    data = bomb(real) if rng.random() < 0.7 else rng.randbytes(200)
    packed = rng.choice(("zstd", "lz4", "", "brotli"))
    return _record(6, struct.pack("<QQQI", 0, 0, said, 0) + _text(packed) + struct.pack("<Q", len(data)) + data)


def _record(opcode: int, content: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(content)) + content


def _text(text: str) -> bytes:
    return struct.pack("<I", len(text)) + text.encode()
