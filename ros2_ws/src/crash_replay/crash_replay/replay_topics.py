"""What `replay` publishes."""

from crash_msgs.msg import ReplayState, Samples, TestInfo
from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from .flow import NOT_WAITING, Flow
from .player import SECOND, Batch, Player, Tally
from .qos import LATCHED, STREAM
from .recording import Recording
from .ros_messages import channel_to_msg, channel_type, samples_to_msg, stamp, test_to_msg, time_zero_ns


class ReplayTopics:
    def __init__(self, node: Node, recording: Recording, with_clock: bool):
        self.node, self.recording = node, recording
        self.time_zero = time_zero_ns(recording)
        self.test = node.create_publisher(TestInfo, "test", LATCHED)
        self.samples = node.create_publisher(Samples, "samples", STREAM)
        self.state = node.create_publisher(ReplayState, "replay_state", LATCHED)
        self.clock = node.create_publisher(Clock, "/clock", STREAM) if with_clock else None
        self.channels = [
            node.create_publisher(channel_type(c), f"channels/{c.name}", STREAM) for c in recording.test.channels
        ]
        self.flow = Flow(self._flowing, node.get_logger().warning)
        self.has_room, self.look = self.flow.has_room, self.flow.look
        self.last_time_ns = int(recording.time_ns[0])  # of the last sample sent
        self.find_subscribers()
        self.test.publish(test_to_msg(recording))

    def test_has_arrived(self) -> bool:
        return self.test.wait_for_all_acked(NOT_WAITING)

    def all_have_arrived(self) -> bool:
        """Whether reliable subscribers have got all samples and the last state."""
        return self.flow.acknowledged() and self.state.wait_for_all_acked(NOT_WAITING)

    def subscribers(self) -> int:
        return self.samples.get_subscription_count()

    def subscriber_names(self) -> list[str]:
        """Nodes that listen to `samples`."""
        return [info.node_name for info in self.node.get_subscriptions_info_by_topic(self.samples.topic_name)]

    def find_subscribers(self) -> None:
        """Look who listens: what nobody listens to is not made."""
        self.clock_heard = self.clock is not None and self.clock.get_subscription_count() > 0
        self.heard = [k for k, publisher in enumerate(self.channels) if publisher.get_subscription_count()]

    def _flowing(self) -> list:
        return [self.samples, *(self.channels[k] for k in self.heard), *([self.clock] if self.clock_heard else [])]

    def send(self, batch: Batch) -> None:
        """The samples of a batch, the clock at the last of them, and each heard channel's values."""
        message = samples_to_msg(self.recording, batch.start, batch.stop, batch.run, self.time_zero)
        self.samples.publish(message)
        self.last_time_ns = self.recording.time_ns.item(batch.stop - 1)
        if self.clock_heard:
            self.clock.publish(Clock(clock=stamp(self.time_zero + self.last_time_ns)))
        if self.heard:
            self._send_channels(batch)
        count = batch.stop - batch.start
        self.flow.sent(count if self.heard else 1, 8 * len(message.values) + (200 * count * len(self.heard)))

    def _send_channels(self, batch: Batch) -> None:
        channels = self.recording.test.channels
        for number in range(batch.start, batch.stop):
            time = stamp(self.time_zero + self.recording.time_ns.item(number))
            for k in self.heard:
                value = self.recording.values.item(number, k)
                self.channels[k].publish(channel_to_msg(channels[k], time, value))

    def send_state(self, player: Player, tally: Tally, block: int) -> None:
        self.find_subscribers()
        message = ReplayState(
            state=int(player.mode),
            run=player.run,
            number=player.next,
            total=len(self.recording),
            sent=tally.samples,
            subscribers=self.subscribers(),
            time=self.last_time_ns / SECOND,
            rate_asked=player.rate,
            rate_actual=tally.rate,
            worst_lateness=tally.worst_lateness,
            block=block,
        )
        message.header.stamp = stamp(self.time_zero + self.last_time_ns)
        self.state.publish(message)
