"""Recordings as ROS messages and back: where rclpy's types and ours meet."""

from array import array
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from crash_msgs.msg import ChannelInfo, Samples, TestInfo
from geometry_msgs.msg import AccelStamped, PointStamped, TwistStamped, WrenchStamped
from rclpy.serialization import deserialize_message

from . import limits
from .bag import time_zero_ns
from .channel_messages import CARRIERS, component, frame_id
from .message_types import test_from_msg as test_from_msg  # also of a bag
from .recording import Channel, Recording, RecordingError, Sample
from .time_unit import SECOND

ChannelMessage = AccelStamped | PointStamped | TwistStamped | WrenchStamped
CHANNEL_TYPES = {
    "geometry_msgs/msg/AccelStamped": AccelStamped,
    "geometry_msgs/msg/PointStamped": PointStamped,
    "geometry_msgs/msg/TwistStamped": TwistStamped,
    "geometry_msgs/msg/WrenchStamped": WrenchStamped,
}


def stamp(time_ns: int) -> Time:
    """The stamp of a time in ns."""
    sec, nanosec = divmod(time_ns, SECOND)
    return Time(sec=sec, nanosec=nanosec)


def stamp_ns(time: Time) -> int:
    return time.sec * SECOND + time.nanosec


def add_ns(time: Time, ns: int) -> Time:
    """The stamp `ns` later."""
    return stamp(stamp_ns(time) + ns)


def test_to_msg(recording: Recording) -> TestInfo:
    test = recording.test
    bodies = list(dict.fromkeys([*test.initial_velocity, *test.initial_displacement]))
    return TestInfo(
        id=test.id,
        title=test.title,
        source=test.source,
        time_zero=stamp(time_zero_ns(recording)),
        sample_period=recording.sample_period,
        samples=len(recording),
        channels=[
            ChannelInfo(name=c.name, quantity=c.quantity, unit=c.unit, body=c.body, axis=c.axis, source=c.source)
            for c in test.channels
        ],
        bodies=bodies,
        initial_velocity=array("d", [test.initial_velocity.get(body, 0.0) for body in bodies]),
        initial_displacement=array("d", [test.initial_displacement.get(body, 0.0) for body in bodies]),
        notes=list(test.notes),
    )


def decoded(data: bytes, kind: type) -> Any:
    """The message in the bytes that came for it; raises RecordingError where they are something else."""
    wrong = limits.count_wrong("has", len(data), limits.MESSAGE)
    try:
        if not wrong:
            return deserialize_message(data, kind)
    except Exception as error:  # whatever the bytes make the decoder stumble over
        wrong = f"{type(error).__name__} in its {len(data)} bytes"
    raise RecordingError(f"does not decode as {kind.__name__}: {wrong}")


test_to_msg.__test__ = False  # type: ignore[attr-defined]  # not a pytest function


def samples_to_msg(recording: Recording, start: int, stop: int, run: int, time_zero: int) -> Samples:
    """Samples start, ..., stop - 1 in one message; `time_zero` is the stamp of the impact in ns."""
    time_ns = recording.time_ns[start:stop]
    message = Samples(run=run, number=start)
    message.header.stamp = stamp(time_zero + time_ns.item(0))
    # arrays of the field's own type are taken without a look at each element
    message.time_ns = array("q", time_ns.tobytes())
    message.values = array("d", recording.values[start:stop].tobytes())
    return message


def samples_from_msg(message: Samples) -> list[Sample]:
    """The samples of a message; their values are views into it."""
    times = message.time_ns.tolist()
    if not times or len(message.values) % len(times):
        raise RecordingError(
            f"samples from number {message.number}: {len(message.values)} values cannot be shared out to "
            f"{len(times)} instants"
        )
    rows = np.frombuffer(message.values).reshape(len(times), -1)
    return [Sample(message.number + k, time_ns, row) for k, (time_ns, row) in enumerate(zip(times, rows))]


def channel_type(channel: Channel) -> type:
    """The message type that carries the channel."""
    return CHANNEL_TYPES[CARRIERS[channel.quantity].type]


def channel_to_msg(channel: Channel, time: Time, value: float) -> ChannelMessage:
    """One value of a channel in the message of its quantity; all other components are 0."""
    message = channel_type(channel)()
    message.header.stamp = time
    message.header.frame_id = frame_id(channel)
    setattr(_vector(channel, message), component(channel), value)
    return message


def channel_from_msg(channel: Channel, message: ChannelMessage) -> float:
    """The channel's value, SI."""
    return getattr(_vector(channel, message), component(channel))


def _vector(channel: Channel, message):
    for name in CARRIERS[channel.quantity].vector:
        message = getattr(message, name)
    return message
