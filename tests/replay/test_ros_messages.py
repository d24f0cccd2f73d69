"""Recordings as ROS messages: the same bytes as in a bag, and back to the last bit."""

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from crash_msgs.msg import Samples
from helpers_replay import some_recording
from numpy.testing import assert_array_equal
from rclpy.serialization import deserialize_message, serialize_message

from crash_replay.bag import time_zero_ns
from crash_replay.channel_messages import encode
from crash_replay.message_types import encode_test
from crash_replay.recording import RecordingError
from crash_replay.ros_messages import (
    add_ns,
    channel_from_msg,
    channel_to_msg,
    channel_type,
    samples_from_msg,
    samples_to_msg,
    stamp,
    stamp_ns,
    test_from_msg,
    test_to_msg,
)

RECORDING = some_recording()
ZERO = time_zero_ns(RECORDING)


def test_stamps_hold_nanoseconds():
    assert stamp(1_999_999_999) == Time(sec=1, nanosec=999_999_999)
    assert stamp_ns(stamp(12_345_678_901)) == 12_345_678_901
    assert add_ns(Time(sec=2, nanosec=5), -10) == Time(sec=1, nanosec=999_999_995)


def test_a_test_is_the_same_after_the_journey_and_as_in_a_bag():
    message = test_to_msg(RECORDING)
    assert test_from_msg(message).initial_velocity == {"rib": 1.5, "door": 0.0}
    assert test_from_msg(message).channels == RECORDING.test.channels
    assert test_from_msg(message).notes == RECORDING.test.notes
    assert (message.samples, message.sample_period, stamp_ns(message.time_zero)) == (40, 1e-3, ZERO)
    assert deserialize_message(bytes(encode_test(RECORDING, ZERO)), type(message)) == message


@pytest.mark.parametrize("start, stop", [(0, 1), (3, 4), (0, 40), (35, 40)])
def test_samples_are_the_same_to_the_last_bit_after_the_journey(start, stop):
    sent = samples_to_msg(RECORDING, start, stop, run=2, time_zero=ZERO)
    got = deserialize_message(serialize_message(sent), Samples)
    assert (got.run, got.number) == (2, start)
    assert stamp_ns(got.header.stamp) == ZERO + RECORDING.time_ns[start]
    samples = samples_from_msg(got)
    assert [sample.number for sample in samples] == list(range(start, stop))
    assert [sample.time_ns for sample in samples] == RECORDING.time_ns[start:stop].tolist()
    assert_array_equal(np.array([sample.values for sample in samples]), RECORDING.values[start:stop])


@pytest.mark.parametrize("times, values", [([], []), ([], [1.0]), ([1, 2], [1.0, 2.0, 3.0])])
def test_samples_that_do_not_fit_their_instants_are_refused(times, values):
    with pytest.raises(RecordingError, match=f"number 7: {len(values)} values cannot be shared out to {len(times)}"):
        samples_from_msg(Samples(number=7, time_ns=times, values=values))


@pytest.mark.parametrize("column", range(6))
def test_a_channels_message_is_the_same_as_in_a_bag(column):
    channel = RECORDING.test.channels[column]
    in_bag = encode(channel, RECORDING.time_ns + ZERO, RECORDING.values[:, column])
    for k in (0, 3, 39):
        message = channel_to_msg(channel, stamp(ZERO + RECORDING.time_ns.item(k)), RECORDING.values.item(k, column))
        read = deserialize_message(in_bag[k], channel_type(channel))
        if not np.isnan(RECORDING.values[k, column]):  # which equals nothing
            assert read == message
        assert_array_equal(channel_from_msg(channel, read), RECORDING.values[k, column])
