"""What is in the MCAP files of a bag: its topics with their messages, in the order in which they were written.

Chunks are unpacked one by one, no further than a recording can need: a small file may claim to be a huge one.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import BinaryIO

import lz4.frame
import zstandard
from mcap.records import Channel, Chunk, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader, breakup_chunk

from . import limits
from .recording import RecordingError

MAGIC = b"\x89MCAP0\r\n"
IMPORT = "`import SOURCE --to NEW.mcap` makes a bag of a CSV with its YAML, an EV5, UDS or ISO-MME folder"


@dataclass
class Topic:
    """A topic's type and its serialized messages."""

    type: str
    messages: list[bytes] = field(default_factory=list)


def bag_files(path: Path) -> list[Path]:
    """The MCAP files of a bag (a folder or one file), in the order of recording."""
    if path.is_file():
        return [path]
    if not path.is_dir():
        raise RecordingError(f"{path}: there is no such bag; give a rosbag2 folder or an .mcap file")
    files = sorted(path.glob("*.mcap"), key=lambda file: (len(file.name), file.name))  # ..._9.mcap before ..._10.mcap
    if not files:
        hint = f"expected a rosbag2 folder with an .mcap file; {IMPORT}"
        if any(path.glob("*.db3")):
            hint = f"it is an SQLite bag: `rosbags-convert --src {path} --dst NEW --dst-storage mcap` makes it MCAP"
        raise RecordingError(f"{path}: no .mcap file in it; {hint}")
    return files


def read_topics(
    files: Sequence[Path], wanted: Callable[[str], bool] = lambda topic: True
) -> tuple[dict[str, Topic], str]:
    """Topics by name, and what is wrong with the files ("" for nothing) where they could not be read to the end.

    wanted: of which topics the messages are kept. Raises RecordingError where a file is no MCAP at all, or would
    unpack to more than a recording can need.
    """
    topics: dict[str, Topic] = {}
    for file in files:
        try:
            if wrong := limits.file_wrong(file, limits.UNPACKED):
                raise RecordingError(f"{file}: {wrong}; {IMPORT}")
            with file.open("rb") as stream:
                if not MAGIC.startswith(stream.read(len(MAGIC))):
                    raise RecordingError(f"{file}: not an MCAP file; {IMPORT}")
                stream.seek(0)
                _read_file(file, stream, topics, wanted)
        except OSError as error:
            raise RecordingError(f"{file}: cannot be read: {error.strerror or error}") from None
        except RecordingError:
            raise
        except Exception as error:  # wherever a cut or damaged file makes the decoder stumble: struct, zstd, CRC, text
            count = sum(len(topic.messages) for topic in topics.values())
            return topics, f"cut off or damaged after {count} messages ({type(error).__name__} in {file.name})"
    return topics, ""


def _read_file(file: Path, stream: BinaryIO, topics: dict[str, Topic], wanted: Callable[[str], bool]) -> None:
    schemas: dict[int, Schema] = {}
    channels: dict[int, Topic | None] = {}
    for record in _records(file, stream):
        if isinstance(record, Message):
            if topic := channels[record.channel_id]:
                topic.messages.append(record.data)
        elif isinstance(record, Schema):
            schemas[record.id] = record
        elif isinstance(record, Channel):
            schema = schemas.get(record.schema_id)
            topic = topics.setdefault(record.topic, Topic(schema.name if schema else "unknown"))
            channels[record.id] = topic if wanted(record.topic) else None


def _records(file: Path, stream: BinaryIO) -> Iterator[McapRecord]:
    """Those of a file and of its chunks."""
    size = file.stat().st_size
    left = min(limits.UNPACKED.highest, max(limits.UNPACKED_SMALL, limits.UNPACKED_RATIO * size))
    reader = StreamReader(stream, emit_chunks=True, validate_crcs=True, record_size_limit=size)
    for record in reader.records:
        if not isinstance(record, Chunk):
            yield record
            continue
        data = _unpacked(record, left) if record.uncompressed_size <= left else None
        if data is None:
            raise RecordingError(
                f"{file}: its {size} bytes would unpack to more than {left} further ones, as no recording's do: not "
                "read"
            )
        left -= len(data)
        yield from breakup_chunk(replace(record, compression="", data=data), validate_crc=True)


def _unpacked(chunk: Chunk, most: float) -> bytes | None:
    """The chunk's records, None where they are more than `most` bytes, whatever it says of itself."""
    if chunk.compression == "zstd":
        # as a stream: all at once it would make room for what the frame claims
        with zstandard.ZstdDecompressor().stream_reader(chunk.data) as packed:
            data = packed.read(chunk.uncompressed_size + 1)
    elif chunk.compression == "lz4":
        data = lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, max_length=chunk.uncompressed_size + 1)
    elif chunk.compression == "":
        data = chunk.data
    else:
        raise ValueError(f"compression {chunk.compression!r}")
    if len(data) > most:
        return None
    if len(data) != chunk.uncompressed_size:
        raise ValueError(f"a chunk of {chunk.uncompressed_size} bytes has {len(data)}")
    return data
