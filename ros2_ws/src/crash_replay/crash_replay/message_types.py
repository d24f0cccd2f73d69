"""The ROS message definitions that bags are written and read with: no ROS installation is needed for it."""

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from . import limits
from .recording import Channel, Recording, RecordingError, Test


@cache
def typestore() -> Typestore:
    """ROS 2 Jazzy's standard types and crash_msgs, from its own .msg files."""
    store = get_typestore(Stores.ROS2_JAZZY)
    types = {}
    for path in sorted(_message_folder().glob("*.msg")):
        types.update(get_types_from_msg(path.read_text(encoding="utf-8"), f"crash_msgs/msg/{path.stem}"))
    store.register(types)
    return store


def _message_folder() -> Path:
    """The folder of crash_msgs' definitions: the installed package's, else the source tree's."""
    try:
        from ament_index_python.packages import get_package_share_directory

        return Path(get_package_share_directory("crash_msgs")) / "msg"
    except (ImportError, LookupError, OSError):  # without ROS, or before the build, bags are read all the same
        pass
    folder = Path(__file__).resolve().parents[2] / "crash_msgs" / "msg"
    if not folder.is_dir():
        raise RecordingError(
            f"crash_msgs' definitions are not in {folder}: build the workspace and use its environment"
        )
    return folder


def encode_test(recording: Recording, time_zero_ns: int) -> memoryview:
    """The test as crash_msgs/msg/TestInfo, serialized."""
    test, types = recording.test, typestore().types
    bodies = list(dict.fromkeys([*test.initial_velocity, *test.initial_displacement]))
    message = types["crash_msgs/msg/TestInfo"](
        id=test.id,
        title=test.title,
        source=test.source,
        time_zero=types["builtin_interfaces/msg/Time"](*divmod(time_zero_ns, 1_000_000_000)),
        sample_period=recording.sample_period,
        samples=len(recording),
        channels=[
            types["crash_msgs/msg/ChannelInfo"](c.name, c.quantity, c.unit, c.body, c.axis, c.source)
            for c in test.channels
        ],
        bodies=bodies,
        initial_velocity=np.array([test.initial_velocity.get(body, 0.0) for body in bodies]),
        initial_displacement=np.array([test.initial_displacement.get(body, 0.0) for body in bodies]),
        notes=list(test.notes),
    )
    return typestore().serialize_cdr(message, "crash_msgs/msg/TestInfo")


def decode_test(data: bytes) -> tuple[Test, int, int]:
    """The test, the stamp of its impact in ns, and how many samples it had."""
    if wrong := limits.count_wrong("has", len(data), limits.MESSAGE):
        raise RecordingError(wrong)
    try:
        message: Any = typestore().deserialize_cdr(data, "crash_msgs/msg/TestInfo")
    except Exception as error:  # whatever the bytes make the decoder stumble over
        raise RecordingError(f"does not decode as crash_msgs/msg/TestInfo of this version ({error})") from None
    return test_from_msg(message), message.time_zero.sec * 1_000_000_000 + message.time_zero.nanosec, message.samples


def test_from_msg(message: Any) -> Test:
    """The test that a TestInfo, rclpy's or one from a bag, tells of. Raises RecordingError where that cannot be."""
    if wrong := _what_is_wrong(message):
        raise RecordingError(f"test {limits.shown(message.id)}: {wrong}")
    bodies = message.bodies
    return Test(
        message.id,
        tuple(Channel(c.name, c.quantity, c.body, c.axis, c.source) for c in message.channels),
        message.title,
        message.source,
        dict(zip(bodies, map(float, message.initial_velocity), strict=False)),
        dict(zip(bodies, map(float, message.initial_displacement), strict=False)),
        tuple(message.notes),
        _impact_ns(message.time_zero),
    )


test_from_msg.__test__ = False  # type: ignore[attr-defined]  # not a pytest function


def _impact_ns(time_zero: Any) -> int:
    return time_zero.sec * 1_000_000_000 + time_zero.nanosec if time_zero.sec > limits.UNDATED.highest else 0


def _what_is_wrong(message: Any) -> str:
    """With what a TestInfo claims; "" for nothing."""
    bodies, velocities, displacements = map(
        len, (message.bodies, message.initial_velocity, message.initial_displacement)
    )
    if not bodies == velocities == displacements or len(set(message.bodies)) != bodies:
        return (
            "expected an initial velocity and displacement for each of different bodies, found "
            f"{bodies} bodies, {velocities} velocities, {displacements} displacements"
        )
    if wrong := limits.size_wrong(message.samples, len(message.channels)):
        return wrong
    single = message.samples == 1 and message.sample_period == 0.0
    if not single and (wrong := limits.PERIOD.wrong(message.sample_period)):
        return f"sample_period {wrong}"
    if wrong := limits.STAMP.wrong(message.time_zero.sec):
        return f"time_zero {wrong}"
    return ""
