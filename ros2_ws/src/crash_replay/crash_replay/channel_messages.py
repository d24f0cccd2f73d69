"""Which standard ROS message carries a channel, and its bytes (CDR, little-endian) in a bag.

All four types are a header (stamp, frame) followed by float64 only, so whole columns are written
and read as arrays: the stamp stands behind the four bytes of encapsulation, the value at a fixed
distance from the end.
"""

from typing import Any, NamedTuple

import numpy as np

from . import limits
from .message_types import typestore
from .recording import Channel, RecordingError
from .time_unit import SECOND


class Carrier(NamedTuple):
    """The message type of a quantity and the vector in it that holds the value."""

    type: str
    vector: tuple[str, ...]  # path of fields to the vector with x, y, z
    from_end: int  # float64 from this vector's x to the end of the message


CARRIERS = {
    "acceleration": Carrier("geometry_msgs/msg/AccelStamped", ("accel", "linear"), 6),
    "velocity": Carrier("geometry_msgs/msg/TwistStamped", ("twist", "linear"), 6),
    "angular_velocity": Carrier("geometry_msgs/msg/TwistStamped", ("twist", "angular"), 3),
    "displacement": Carrier("geometry_msgs/msg/PointStamped", ("point",), 3),
    "force": Carrier("geometry_msgs/msg/WrenchStamped", ("wrench", "force"), 6),
    "moment": Carrier("geometry_msgs/msg/WrenchStamped", ("wrench", "torque"), 3),
}
"""By quantity; the channel's axis (x where it has none) is the component that is used."""

AXES = ("", "x", "y", "z")
FRONT = 4 + 8 + 4
"""Bytes in front of the frame's name: encapsulation, stamp, length of the name."""


def component(channel: Channel) -> str:
    """x, y or z: where in its message the channel's value stands."""
    return channel.axis or "x"


def frame_id(channel: Channel) -> str:
    return channel.body or channel.name


def _tail_offset(channel: Channel) -> int:
    """Bytes from the end of the message at which the channel's value starts."""
    if channel.axis not in AXES:
        raise RecordingError(f"channel {channel.name}: axis must be x, y, z or empty, found {channel.axis!r}")
    return 8 * (CARRIERS[channel.quantity].from_end - "xyz".index(component(channel)))


def encode(channel: Channel, stamps_ns: np.ndarray, values: np.ndarray) -> list[bytes]:
    """One message for each stamp (n,) int64 ns and value (n,) SI; all other components are 0."""
    blank = bytes(typestore().serialize_cdr(_blank(channel), CARRIERS[channel.quantity].type))
    rows = np.tile(np.frombuffer(blank, np.uint8), (len(stamps_ns), 1))
    stamps = np.stack([stamps_ns // SECOND, stamps_ns % SECOND], axis=1).astype("<u4")
    rows[:, 4:12] = stamps.view(np.uint8)
    start = len(blank) - _tail_offset(channel)
    rows[:, start : start + 8] = values.astype("<f8")[:, None].view(np.uint8)
    return [row.tobytes() for row in rows]


def decode(channel: Channel, messages: list[bytes]) -> tuple[np.ndarray, np.ndarray]:
    """Stamps (n,) int64 ns and values (n,) SI of a topic's messages, in their order; NaN for what is no valid value."""
    offset = _tail_offset(channel)
    if any(not FRONT + offset <= len(message) <= limits.MESSAGE.highest or message[1] != 1 for message in messages):
        raise RecordingError(f"expected {CARRIERS[channel.quantity].type} as little-endian CDR, found other bytes")
    layout = np.dtype([("sec", "<i4"), ("nanosec", "<u4"), ("value", "<f8")])
    # from the front and from the end: a frame_id of any length may stand between
    packed = b"".join(m[4:12] + m[len(m) - offset : len(m) - offset + 8] for m in messages)
    fields = np.frombuffer(packed, layout)
    stamps = fields["sec"].astype(np.int64) * SECOND + fields["nanosec"]
    return stamps, limits.valid_values(fields["value"].astype(float))


def _blank(channel: Channel) -> Any:
    """The channel's message with time and values 0."""
    types = typestore().types
    vector = types["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0)
    header = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](0, 0), frame_id(channel))
    carrier = CARRIERS[channel.quantity]
    if carrier.type == "geometry_msgs/msg/PointStamped":
        return types[carrier.type](header, types["geometry_msgs/msg/Point"](0.0, 0.0, 0.0))
    body = types[carrier.type.removesuffix("Stamped")](vector, vector)
    return types[carrier.type](header, body)
