"""Samples from `channels/<name>`, where nobody publishes `samples`: rosbag2's player on one of our bags."""

import time
from collections.abc import Callable
from functools import partial

from crash_msgs.msg import TestInfo
from rclpy.node import Node
from rclpy.subscription import Subscription

from crash_replay.channel_messages import CARRIERS, decode
from crash_replay.limits import TIME
from crash_replay.qos import EVERY_SAMPLE
from crash_replay.recording import RecordingError
from crash_replay.ros_messages import CHANNEL_TYPES, stamp_ns, test_from_msg
from crash_replay.subscribers import process_of

from ..following.alignment import Alignment
from ..kept import Rows

QUIET = 0.5
"""s of wall clock without a message after which the last samples are taken as they are."""
MOST, LONGEST = 100_000, 1000
"""Messages to keep while the test they belong to is not known, and bytes of one."""


class ChannelFeed:
    def __init__(self, node: Node, samples_topic: str, begin: Callable[[bool], None], take: Callable[[Rows], None]):
        """begin, take: as of Alignment."""
        self.node, self.begin, self.take = node, begin, take
        self.samples_topic = node.resolve_topic_name(samples_topic)
        self.prefix = node.resolve_topic_name("channels") + "/"
        self.inputs: dict[str, Subscription] = {}
        self.replays: set[bytes] = set()  # processes that publish samples, or have done so
        self.early: list[tuple[str, bytes]] = []
        self.complained: set[str] = set()
        self.alignment: Alignment | None = None
        self.last_put = 0.0
        node.create_timer(0.1, self._look)

    @property
    def active(self) -> bool:
        return bool(self.inputs)

    def set_test(self, message: TestInfo) -> None:
        test = test_from_msg(message)
        self.channels = {channel.name: (k, channel) for k, channel in enumerate(test.channels)}
        self.time_zero = stamp_ns(message.time_zero)
        self.alignment = Alignment(test, message.sample_period, self.begin, self.take)
        self.complained.clear()
        early, self.early = self.early, []
        for name, data in early:
            self._put(name, data)

    def _look(self) -> None:
        """Listen to the channels while there are no samples: before the test comes, or the first would be lost.

        Never to those of a replay, which has both: when it ends, its topics go one by one, the channels last.
        """
        if replays := self._publishers(self.samples_topic):
            self.replays |= replays
            for subscription in self.inputs.values():
                self.node.destroy_subscription(subscription)
            self.inputs.clear()
            return
        for topic, types in self.node.get_topic_names_and_types():
            name = topic.removeprefix(self.prefix)
            if name != topic and name not in self.inputs and types[0] in CHANNEL_TYPES:
                # One that has just come may be found between two looks: its samples are then found before its channels.
                if self._publishers(topic) - self.replays and not self._publishers(self.samples_topic):
                    put = partial(self._put, name)
                    self.inputs[name] = self.node.create_subscription(
                        CHANNEL_TYPES[types[0]], topic, put, EVERY_SAMPLE, raw=True
                    )
        if self.alignment and self.alignment.rows and time.monotonic() - self.last_put > QUIET:
            self.alignment.flush()

    def _publishers(self, topic: str) -> set[bytes]:
        """The processes that publish it."""
        return {process_of(info) for info in self.node.get_publishers_info_by_topic(topic)}

    def _put(self, name: str, data: bytes) -> None:
        if self.alignment is None:
            if len(self.early) < MOST and len(data) < LONGEST:
                self.early.append((name, data))
            return
        if name not in self.channels:
            self._complain(name, "the test does not list it")
            return
        k, channel = self.channels[name]
        subscription = self.inputs.get(name)
        expected = CARRIERS[channel.quantity].type
        if subscription and subscription.msg_type is not CHANNEL_TYPES[expected]:
            self._complain(name, f"{channel.quantity} travels as {expected}")
            return
        try:
            (stamp,), (value,) = decode(channel, [bytes(data)])
            time_ns = int(stamp) - self.time_zero
            if wrong := TIME.wrong(time_ns * 1e-9):
                raise RecordingError(f"time since the impact {wrong}")
        except RecordingError as error:
            self._complain(name, str(error))
            return
        self.last_put = time.monotonic()
        self.alignment.put(k, time_ns, float(value))

    def _complain(self, name: str, why: str) -> None:
        if name not in self.complained:
            self.complained.add(name)
            self.node.get_logger().error(f"topic {self.prefix}{name} is left out: {why}")
