"""One MCAP file as rosbag2 writes it, with checksums, and the metadata.yaml that makes a folder a rosbag2 bag.

rosbag2's storage format, version 9 (Jazzy): types as ros2msg schemas, quality of service and type hash in
each channel's metadata, zstd chunks.
"""

import json
from collections.abc import Iterable, Sequence
from io import StringIO
from pathlib import Path
from typing import IO, Any, NamedTuple

from mcap.writer import CompressionType, Writer
from ruamel.yaml import YAML

from .message_types import typestore

FOREVER = {"sec": 9223372036, "nsec": 854775807}  # ROS's infinite duration
STREAM = {
    "history": "keep_last", "depth": 5000, "reliability": "reliable", "durability": "volatile",
    "deadline": FOREVER, "lifespan": FOREVER, "liveliness": "automatic", "liveliness_lease_duration": FOREVER,
    "avoid_ros_namespace_conventions": False,
}  # fmt: skip
"""Quality of service that rosbag2's player offers for a stream: nothing may be lost."""
LATCHED = STREAM | {"depth": 1, "durability": "transient_local"}
"""Who joins late gets the last message."""


class TopicToWrite(NamedTuple):
    name: str
    type: str
    qos: dict[str, Any]


class BagWriter:
    """Writes messages into one MCAP file, topics as they come."""

    def __init__(self, stream: IO[bytes], data_crc: bool):
        """data_crc: a checksum over all as well as one for each chunk; the stream must then hold nothing else."""
        self.writer = Writer(stream, compression=CompressionType.ZSTD, enable_data_crcs=data_crc)
        self.writer.start(profile="ros2", library="crash_replay")
        self.schemas: dict[str, int] = {}  # ids by type
        self.topics: list[TopicToWrite] = []
        self.counts: list[int] = []
        self.first: int | None = None  # ns, log time of the first message
        self.last = 0  # and of the last

    def add_topic(self, topic: TopicToWrite) -> int:
        """Its index."""
        if topic.type not in self.schemas:
            definition, _ = typestore().generate_msgdef(topic.type, ros_version=2)
            self.schemas[topic.type] = self.writer.register_schema(topic.type, "ros2msg", definition.encode())
        # JSON is YAML, and looks the same whatever library writes it
        metadata = {
            "offered_qos_profiles": json.dumps([topic.qos]),
            "topic_type_hash": typestore().hash_rihs01(topic.type),
        }
        self.writer.register_channel(topic.name, "cdr", self.schemas[topic.type], metadata)  # ids count from 1
        self.topics.append(topic)
        self.counts.append(0)
        return len(self.topics) - 1

    def write(self, topic: int, log_time: int, data: bytes, publish_time: int) -> None:
        """Times in ns."""
        count = self.counts[topic]
        self.writer.add_message(topic + 1, log_time=log_time, data=data, publish_time=publish_time, sequence=count)
        self.first = log_time if self.first is None else min(self.first, log_time)
        self.last = max(self.last, log_time)
        self.counts[topic] += 1

    def finish(self, name: str) -> dict[str, Any]:
        """End the file -> rosbag2's description of the bag."""
        description = _description(name, self.topics, self.counts, self.first or 0, self.last)
        self.writer.add_metadata("rosbag2", {"serialized_metadata": _yaml(description)})
        self.writer.finish()
        return description


def write_mcap(
    file: Path, topics: Sequence[TopicToWrite], messages: Iterable[tuple[int, int, bytes]]
) -> dict[str, Any]:
    """Write messages (index of topic, stamp in ns, CDR) in their order; returns rosbag2's description of the bag."""
    with file.open("wb") as stream:
        writer = BagWriter(stream, data_crc=True)
        for topic in topics:
            writer.add_topic(topic)
        for index, stamp, data in messages:
            writer.write(index, stamp, data, stamp)
        return writer.finish(file.name)


def write_metadata(folder: Path, description: dict[str, Any]) -> None:
    (folder / "metadata.yaml").write_text(_yaml({"rosbag2_bagfile_information": description}), encoding="utf-8")


def _description(
    file: str, topics: Sequence[TopicToWrite], counts: Sequence[int], first: int, last: int
) -> dict[str, Any]:
    """rosbag2_bagfile_information of metadata.yaml."""
    span = {
        "starting_time": {"nanoseconds_since_epoch": first},
        "duration": {"nanoseconds": last - first},
        "message_count": sum(counts),
    }
    described = [
        {
            "topic_metadata": {
                "name": topic.name,
                "type": topic.type,
                "serialization_format": "cdr",
                "offered_qos_profiles": [topic.qos],
                "type_description_hash": typestore().hash_rihs01(topic.type),
            },
            "message_count": count,
        }
        for topic, count in zip(topics, counts)
    ]
    return {
        "version": 9,
        "storage_identifier": "mcap",
        **span,
        "topics_with_message_count": described,
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": [file],
        "files": [{"path": file, **span}],
        "custom_data": None,
        "ros_distro": "jazzy",
    }


def _yaml(data: dict[str, Any]) -> str:
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = False
    yaml.representer.ignore_aliases = lambda _: True  # rosbag2 reads no anchors
    text = StringIO()
    yaml.dump(data, text)
    return text.getvalue()
