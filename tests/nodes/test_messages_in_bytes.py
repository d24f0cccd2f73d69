"""Messages read from their bytes are those that rclpy makes of them, wherever the lengths before put each field."""

import struct

import numpy as np
import pytest
from crash_msgs.msg import Forces, ParametersBlock, ResidualsBlock, Samples
from numpy.testing import assert_array_equal
from rclpy.serialization import serialize_message
from std_msgs.msg import Header

from crash_estimator.following.in_order import About
from crash_estimator.nodes.samples import received, rows_of
from crash_estimator.nodes.whole_estimates import about_of, revision_of
from crash_replay.recording import RecordingError

FRAMES = ["", "a", "ab", "abc", "abcd", "abcde", "abcdefg", "a_frame_of_the_test"]
"""Each puts what follows at another place."""


def header(frame: str) -> Header:
    found = Header(frame_id=frame)
    found.stamp.sec, found.stamp.nanosec = 7, 250
    return found


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("samples", [0, 1, 3])
def test_samples(frame, samples):
    time_ns, values = np.arange(samples) * 100_000 - 50, np.arange(2.0 * samples) / 3.0
    message = Samples(header=header(frame), run=3, number=1234, time_ns=time_ns.tolist(), values=values.tolist())
    found = received(serialize_message(message))
    assert (found.run, found.number, found.stamp_ns) == (3, 1234, 7_000_000_250)
    assert_array_equal(found.time_ns, time_ns)
    assert_array_equal(found.values, values)
    if samples:
        rows = rows_of(found)
        assert rows.number == 1234 and rows.values.shape == (samples, 2)


def test_samples_from_a_machine_of_the_other_byte_order():
    """As CDR has them there: the same fields at the same places, most significant byte first."""
    body = struct.pack(">iI", 7, 250) + struct.pack(">I", 2) + b"a\0\0\0" + struct.pack(">I", 3)
    body += b"\0" * (-len(body) % 8) + struct.pack(">Q", 1234)
    for code, values in (("q", (5, 6)), ("d", (1.5, -2.5))):
        body += struct.pack(">I", 2)
        body += b"\0" * (-len(body) % 8) + struct.pack(f">2{code}", *values)
    found = received(b"\0\0\0\0" + body)
    assert (found.run, found.number, found.stamp_ns) == (3, 1234, 7_000_000_250)
    assert found.time_ns.tolist() == [5, 6] and found.values.tolist() == [1.5, -2.5]


def test_bytes_that_end_too_early_are_no_samples():
    raw = serialize_message(Samples(header=header("a"), run=1, number=2, time_ns=[1, 2], values=[3.0, 4.0]))
    for end in (4, 12, 20, len(raw) - 8):
        with pytest.raises(RecordingError, match="does not decode as Samples"):
            received(raw[:end])


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("kind", [ParametersBlock, ResidualsBlock, Forces])
@pytest.mark.parametrize("samples", [0, 1, 2])
def test_what_an_estimate_is_about_and_which_revision_says_it(frame, kind, samples):
    for model, method in (("", "rls"), ("side", "mrls"), ("a_model", "constrained_kalman")):
        message = kind(header=header(frame), run=2, number=77, model=model, method=method, revision=5)
        message.time_ns = list(range(samples))
        raw = serialize_message(message)
        assert about_of(raw, kind) == About(2, 77, samples)
        assert revision_of(raw, kind) == 5


def test_an_estimate_from_a_machine_of_the_other_byte_order_is_deserialised():
    """The head as CDR has it there; what comes after it is left to the middleware."""
    body = struct.pack(">iI", 7, 250) + struct.pack(">I", 2) + b"a\0\0\0" + struct.pack(">I", 3)
    body += b"\0" * (-len(body) % 8) + struct.pack(">Q", 1234) + struct.pack(">I", 2)
    body += b"\0" * (-len(body) % 8) + struct.pack(">2q", 5, 6) + b"\0" * 80
    assert about_of(b"\0\0\0\0" + body, ParametersBlock) == About(3, 1234, 2)
