"""Recordings with every quantity, and bags of them as others write them."""

from dataclasses import replace

import numpy as np
from numpy.testing import assert_array_equal
from rosbags.rosbag2 import StoragePlugin, Writer

from crash_replay.bag import CHANNEL_TOPICS
from crash_replay.channel_messages import CARRIERS, encode
from crash_replay.message_types import encode_test, typestore
from crash_replay.recording import Channel, Recording, Test

SECOND = 1_000_000_000
CHANNELS = tuple(
    Channel(f"{quantity}_{axis or 'none'}", quantity, body, axis, f"column {axis}")
    for quantity in CARRIERS
    for axis, body in (("x", "car"), ("y", ""), ("z", "driver_head"), ("", "car"))
)


def some_recording(samples=300, channels=CHANNELS, first=-50, period_ns=100_000):
    rng = np.random.default_rng(7)
    values = rng.normal(scale=1e3, size=(samples, len(channels)))
    values[samples // 3 :, 2 % len(channels)] = np.nan
    test = Test(
        "T1",
        tuple(channels),
        "A title, größer",
        "a source",
        {"car": 15.8, "door": 0.0},
        {"car": 0.0, "door": -0.02},
        ("one", "two"),
    )
    return Recording(test, (np.arange(samples, dtype=np.int64) + first) * period_ns, values)


def assert_same(read, written):
    assert read.test == written.test
    assert_array_equal(read.time_ns, written.time_ns)
    assert_array_equal(read.values, written.values)


SMALL = some_recording(100, CHANNELS[:3], first=0)
SMALL = replace(SMALL, values=np.nan_to_num(SMALL.values))


def write_messages(path, recording, topics, zero=SECOND, test=True):
    """A bag with these (topic, type, stamps, messages) beside the recording's TestInfo."""
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        if test:
            connection = writer.add_connection("/test", "crash_msgs/msg/TestInfo", typestore=typestore())
            writer.write(connection, zero, encode_test(recording, zero))
        for name, type_name, stamps, messages in topics:
            connection = writer.add_connection(name, type_name, typestore=typestore())
            for stamp, message in zip(stamps, messages):
                writer.write(connection, int(stamp), message)
    return path


def topics_of(recording, keep=lambda k, i: True, shift=lambda k: 0, zero=SECOND):
    """The recording's own topics, with the samples i of channel k that `keep` keeps, at shifted stamps."""
    topics = []
    for k, channel in enumerate(recording.test.channels):
        chosen = [i for i in range(len(recording)) if keep(k, i)]
        stamps = recording.time_ns[chosen] + zero + shift(k)
        messages = encode(channel, stamps, recording.values[chosen, k])
        topics.append((CHANNEL_TOPICS + channel.name, CARRIERS[channel.quantity].type, stamps, messages))
    return topics
