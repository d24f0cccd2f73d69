"""crash_msgs/Samples -> arrays."""

import struct
from typing import NamedTuple

import numpy as np
from crash_msgs.msg import Samples
from rclpy.serialization import deserialize_message

from crash_replay.cdr import PLAIN, aligned
from crash_replay.ros_messages import stamp_ns

from ..kept import Rows

MOST = 10_000_000
"""Samples in a test that does not say how many it has: to keep more would take all memory."""


class Received(NamedTuple):
    """What a message of samples holds; arrays of its own."""

    run: int
    number: int
    stamp_ns: int  # of the first of them
    time_ns: np.ndarray  # (k,) int64 ns since the impact
    values: np.ndarray  # (k * channels,) SI


HEADER, RUN, NUMBER, LENGTH = struct.Struct("<iII"), struct.Struct("<I"), struct.Struct("<Q"), struct.Struct("<I")


def received(raw: bytes) -> Received:
    """A message as the middleware has it: to have rclpy make an object of it would take longer than to estimate."""
    if raw[: len(PLAIN)] != PLAIN:  # from a machine of the other byte order
        message = deserialize_message(raw, Samples)
        return Received(message.run, message.number, stamp_ns(message.header.stamp), *_arrays_of(message))
    at = len(PLAIN)
    sec, nanosec, text = HEADER.unpack_from(raw, at)
    at = aligned(at + HEADER.size + text, 4)
    (run,) = RUN.unpack_from(raw, at)
    at = aligned(at + 4, 8)
    (number,) = NUMBER.unpack_from(raw, at)
    time_ns, at = _sequence(raw, at + 8, np.int64)
    values, _ = _sequence(raw, at, np.float64)
    return Received(run, number, sec * 1_000_000_000 + nanosec, time_ns, values)


def _sequence(raw: bytes, at: int, kind: type) -> tuple[np.ndarray, int]:
    """Numbers of 8 bytes whose length is at the next multiple of 4, and where they end.

    Copied, to lie where such numbers should: the compiled recursion is compiled for these.
    """
    at = aligned(at, 4)
    (length,) = LENGTH.unpack_from(raw, at)
    at = aligned(at + 4, 8) if length else at + 4
    return np.frombuffer(raw, kind, length, at).copy(), at + 8 * length


def _arrays_of(message: Samples) -> tuple[np.ndarray, np.ndarray]:
    return np.array(message.time_ns, dtype=np.int64), np.array(message.values, dtype=np.float64)


def rows_of(message: Samples | Received) -> Rows:
    """The samples of a message, at least one; views into it."""
    time_ns = np.frombuffer(message.time_ns, dtype=np.int64)
    return Rows(message.number, time_ns, np.frombuffer(message.values).reshape(len(time_ns), -1))


def what_is_wrong(message: Samples | Received, channels: int, total: int) -> str:
    """With a message on a test of so many channels and samples (0: not stated); "" for nothing."""
    count, found = len(message.time_ns), len(message.values)
    if not found or found != count * channels:
        return f"expected {count * channels} values ({channels} channels), found {found}"
    return f"the test has {total or MOST} samples" if message.number + count > (total or MOST) else ""
