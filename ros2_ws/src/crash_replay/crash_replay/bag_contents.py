"""What is in the MCAP files of a bag: its topics with their messages, in the order in which they were written."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from mcap.records import Channel, Message, Schema
from mcap.stream_reader import StreamReader

from .recording import RecordingError

MAGIC = b"\x89MCAP0\r\n"
IMPORT = "`import SOURCE --to NEW.mcap` makes a bag of a CSV with its YAML, an EV5 or an ISO-MME folder"


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


def read_topics(files: Sequence[Path]) -> tuple[dict[str, Topic], str]:
    """Topics by name, and what is wrong with the files ("" for nothing) where they could not be read to the end.

    Raises RecordingError where a file is no MCAP at all.
    """
    topics: dict[str, Topic] = {}
    for file in files:
        try:
            with file.open("rb") as stream:
                if not MAGIC.startswith(stream.read(len(MAGIC))):
                    raise RecordingError(f"{file}: not an MCAP file; {IMPORT}")
                stream.seek(0)
                _read_file(stream, topics)
        except OSError as error:
            raise RecordingError(f"{file}: cannot be read: {error.strerror or error}") from None
        except RecordingError:
            raise
        except Exception as error:  # wherever a cut or damaged file makes the decoder stumble: struct, zstd, CRC, text
            count = sum(len(topic.messages) for topic in topics.values())
            return topics, f"cut off or damaged after {count} messages ({type(error).__name__} in {file.name})"
    return topics, ""


def _read_file(stream: BinaryIO, topics: dict[str, Topic]) -> None:
    schemas: dict[int, Schema] = {}
    channels: dict[int, Topic] = {}
    for record in StreamReader(stream, validate_crcs=True).records:
        if isinstance(record, Message):
            channels[record.channel_id].messages.append(record.data)
        elif isinstance(record, Schema):
            schemas[record.id] = record
        elif isinstance(record, Channel):
            schema = schemas.get(record.schema_id)
            channels[record.id] = topics.setdefault(record.topic, Topic(schema.name if schema else "unknown"))
