"""One MCAP file as rosbag2 writes it, with checksums, and the metadata.yaml that makes a folder a rosbag2 bag.

rosbag2's storage format, version 9 (Jazzy): types as ros2msg schemas, quality of service and type hash in
each channel's metadata, zstd chunks.
"""

import json
from collections.abc import Iterable, Sequence
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple

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


def write_mcap(
    file: Path, topics: Sequence[TopicToWrite], messages: Iterable[tuple[int, int, bytes]]
) -> dict[str, Any]:
    """Write messages (index of topic, stamp in ns, CDR) in their order; returns rosbag2's description of the bag."""
    counts = [0] * len(topics)
    first = last = None
    with file.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.ZSTD, enable_data_crcs=True)
        writer.start(profile="ros2", library="crash_replay")
        ids = _register(writer, topics)
        for topic, stamp, data in messages:
            writer.add_message(ids[topic], log_time=stamp, data=data, publish_time=stamp, sequence=counts[topic])
            counts[topic] += 1
            first = stamp if first is None else min(first, stamp)
            last = stamp if last is None else max(last, stamp)
        description = _description(file.name, topics, counts, first or 0, last or 0)
        writer.add_metadata("rosbag2", {"serialized_metadata": _yaml(description)})
        writer.finish()
    return description


def write_metadata(folder: Path, description: dict[str, Any]) -> None:
    (folder / "metadata.yaml").write_text(_yaml({"rosbag2_bagfile_information": description}), encoding="utf-8")


def _register(writer: Writer, topics: Sequence[TopicToWrite]) -> list[int]:
    """Channel ids of the topics."""
    schemas: dict[str, int] = {}
    ids = []
    for topic in topics:
        if topic.type not in schemas:
            definition, _ = typestore().generate_msgdef(topic.type, ros_version=2)
            schemas[topic.type] = writer.register_schema(topic.type, "ros2msg", definition.encode())
        # JSON is YAML, and looks the same whatever library writes it
        metadata = {
            "offered_qos_profiles": json.dumps([topic.qos]),
            "topic_type_hash": typestore().hash_rihs01(topic.type),
        }
        ids.append(writer.register_channel(topic.name, "cdr", schemas[topic.type], metadata))
    return ids


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
