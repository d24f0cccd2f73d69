"""Messages filled in and read as bytes: what rclpy makes of them is what was meant, whatever their lengths."""

from array import array

import numpy as np
import pytest
from crash_msgs.msg import Answer, Forces, Samples
from numpy.testing import assert_array_equal
from rclpy.serialization import deserialize_message, serialize_message

from crash_estimator.nodes.samples import received
from crash_replay.cdr import PLAIN, Serialized

TEXTS = ("", "a", "abc", "émile")
"""Of lengths after which different gaps come."""


@pytest.mark.parametrize("samples", [0, 1, 2, 5])
@pytest.mark.parametrize("width", [0, 1, 3])
def test_numbers_written_in_their_places_are_read_as_fields(samples, width):
    """Texts, and numbers that are not written, stay; an empty sequence has no gap before its elements."""
    for text in TEXTS:
        message = Forces(model=text, method="rls", element=[text * k for k in range(width)], body=[text] * width)
        message.header.frame_id, message.mass = text, array("d", range(width))
        message.time_ns, message.state = array("q", range(samples)), array("B", bytes(samples * width))
        message.crush = message.acceleration = array("d", bytes(8 * samples * width))
        serialized = Serialized(message)
        assert deserialize_message(bytes(serialized), Forces) == message
        serialized.set_stamp(3_500_000_001)
        numbers = serialized.numbers
        numbers["number"][0], numbers["run"][0] = 2**23, 7
        for field, values in (("crush", 0.5), ("acceleration", -1.5), ("state", 2)):
            numbers[field][:] = values + np.arange(samples * width)
        got = deserialize_message(bytes(serialized), Forces)
        assert (got.header.stamp.sec, got.header.stamp.nanosec) == (3, 500_000_001)
        assert (got.number, got.run, got.model, list(got.body)) == (2**23, 7, text, [text] * width)
        assert_array_equal(got.crush, 0.5 + np.arange(samples * width))
        assert_array_equal(got.acceleration, -1.5 + np.arange(samples * width))
        assert_array_equal(got.state, 2 + np.arange(samples * width))
        assert_array_equal(got.mass, np.arange(width))


def test_one_without_a_header_too():
    serialized = Serialized(Answer(node="/mrls"))
    serialized.numbers["missed"][0] = 3
    assert deserialize_message(bytes(serialized), Answer) == Answer(node="/mrls", missed=3)


@pytest.mark.parametrize("samples, channels", [(0, 0), (1, 4), (3, 1), (25, 16)])
def test_samples_are_read_as_rclpy_reads_them(samples, channels):
    """Into arrays that lie where the compiled code expects them, as those of a message do."""
    for frame in TEXTS:
        message = Samples(run=3, number=2**23, time_ns=array("q", range(-1, samples - 1)))
        message.values = array("d", np.random.default_rng(samples).standard_normal(samples * channels))
        message.header.frame_id, message.header.stamp.sec, message.header.stamp.nanosec = frame, -2, 999_999_999
        got = received(serialize_message(message))
        assert (got.run, got.number, got.stamp_ns) == (3, 2**23, -1_000_000_001)
        assert_array_equal(got.time_ns, message.time_ns)
        assert_array_equal(got.values, message.values)
        assert got.time_ns.flags.aligned and got.values.flags.aligned and got.values.flags.writeable


def test_samples_of_the_other_byte_order_are_read_too():
    """A recording of bytes as a machine that begins with the large end writes them."""
    ints = lambda value, size: value.to_bytes(size, "big", signed=True)  # noqa: E731
    raw = bytes([0, 0, 0, 0]) + ints(5, 4) + ints(7, 4) + ints(1, 4) + bytes(4) + ints(2, 4) + bytes(4) + ints(9, 8)
    raw += ints(1, 4) + bytes(4) + ints(-100, 8) + ints(2, 4) + bytes(4) + np.array([1.5, -2.5], ">f8").tobytes()
    assert raw[: len(PLAIN)] != PLAIN
    got = received(raw)
    assert (got.run, got.number, got.stamp_ns) == (2, 9, 5_000_000_007)
    assert_array_equal(got.time_ns, [-100])
    assert_array_equal(got.values, [1.5, -2.5])
