"""crash_msgs/Samples -> arrays, and whether they can be what they say."""

import struct
from typing import NamedTuple

import numpy as np
from crash_msgs.msg import Samples

from crash_replay.cdr import PLAIN, aligned
from crash_replay.limits import MESSAGE, SAMPLES, TIME, VALUE, count_wrong, most_samples
from crash_replay.recording import RecordingError
from crash_replay.ros_messages import decoded, stamp_ns

from ..kept import Kept, Rows


class Received(NamedTuple):
    """What a message of samples holds; arrays of its own."""

    run: int
    number: int
    stamp_ns: int  # of the first of them
    time_ns: np.ndarray  # (k,) int64 ns since the impact
    values: np.ndarray  # (k * channels,) SI


HEADER, RUN, NUMBER, LENGTH = struct.Struct("<iII"), struct.Struct("<I"), struct.Struct("<Q"), struct.Struct("<I")


def received(raw: bytes) -> Received:
    """A message as the middleware has it: to have rclpy make an object of it would take longer than to estimate.

    Raises RecordingError where the bytes are no such message.
    """
    if wrong := count_wrong("has", len(raw), MESSAGE):
        raise RecordingError(f"does not decode as Samples: {wrong}")
    try:
        message = _received(raw) if raw[: len(PLAIN)] == PLAIN else _of_the_other_byte_order(raw)
    except (struct.error, ValueError) as error:  # lengths beyond the end
        raise RecordingError(f"does not decode as Samples: {len(raw)} bytes, {error}") from None
    if wrong := SAMPLES.wrong(message.number):  # not even an answer could be sent to that
        raise RecordingError(f"the number of the first sample {wrong}")
    return message


def _received(raw: bytes) -> Received:
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


def _of_the_other_byte_order(raw: bytes) -> Received:
    message = decoded(raw, Samples)
    time_ns, values = np.array(message.time_ns, dtype=np.int64), np.array(message.values, dtype=np.float64)
    return Received(message.run, message.number, stamp_ns(message.header.stamp), time_ns, values)


def rows_of(message: Samples | Received) -> Rows:
    """The samples of a message, at least one; views into it."""
    time_ns = np.frombuffer(message.time_ns, dtype=np.int64)
    return Rows(message.number, time_ns, np.frombuffer(message.values).reshape(len(time_ns), -1))


TIME_NS = int(TIME.highest * 1e9)


def what_is_wrong(message: Samples | Received, kept: Kept, total: int) -> str:
    """With a message on a test of which these samples are kept, and which has so many (0: not stated); "": nothing."""
    count, found, channels = len(message.time_ns), len(message.values), len(kept.test.channels)
    if not found or found != count * channels:
        return f"expected {count * channels} values ({channels} channels), found {found}"
    total = total or most_samples(channels)
    if message.number + count > total:
        return f"the test has {total} samples"
    time_ns = np.asarray(message.time_ns)
    if count > 1 and not (time_ns[1:] > time_ns[:-1]).all():
        return "their times do not increase"
    first, last = time_ns.item(0), time_ns.item(-1)
    if not -TIME_NS <= first <= last <= TIME_NS:
        return (
            f"their times go from {first * 1e-9:g} to {last * 1e-9:g} s, to be within {TIME.highest:g} s of the impact"
        )
    if np.count_nonzero(np.abs(message.values) > VALUE.highest):  # NaN, a missing one, is not
        return f"a value is beyond {VALUE.highest:g}"
    if not kept.agrees(message.number, time_ns):
        return "their times are not those of the samples before, beside or after them"
    return ""


def fitting(samples: Samples, kept: Kept, total: int) -> Rows:
    """The samples of a message that was asked for; raises RecordingError where they cannot be of the test."""
    if wrong := what_is_wrong(samples, kept, total):
        raise RecordingError(f"samples from number {samples.number}: {wrong}")
    return rows_of(samples)
