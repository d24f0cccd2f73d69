"""What `replay` publishes."""

import time
from functools import partial
from typing import Any

from crash_msgs.msg import Answer, ReplayState, Samples, TestInfo
from rclpy.node import Node
from rclpy.qos_overriding_options import QoSOverridingOptions

from .attending import Progress
from .audience import Audience
from .flow import NOT_WAITING, Flow
from .lockstep import Answered, Listeners, Lockstep
from .player import SECOND, Batch, Mode, Player, Tally
from .qos import LATCHED, SAID, STREAM
from .recording import Recording
from .replay_clock import ReplayClock
from .ros_messages import channel_to_msg, channel_type, samples_to_msg, stamp, test_to_msg, time_zero_ns
from .subscribers import UNNAMED, node_name, process_of, waited_for

OVERRIDABLE = QoSOverridingOptions.with_default_policies()


class ReplayTopics:
    def __init__(self, node: Node, recording: Recording, clock: str, answer_timeout: float | None = None):
        """clock: as of ReplayClock; answer_timeout: s after which lock-step goes on without a silent listener; None: no
        lock-step."""
        self.node, self.recording = node, recording
        self.time_zero = time_zero_ns(recording)
        self.test = node.create_publisher(TestInfo, "test", LATCHED)
        self.samples = node.create_publisher(Samples, "samples", STREAM, qos_overriding_options=OVERRIDABLE)
        self.state = node.create_publisher(ReplayState, "replay_state", LATCHED)
        self.clock = ReplayClock(node, clock)
        self.channels = [
            node.create_publisher(channel_type(c), f"channels/{c.name}", STREAM, qos_overriding_options=OVERRIDABLE)
            for c in recording.test.channels
        ]
        overrides: dict[str, Any] = node.get_parameters_by_prefix("qos_overrides")
        depths = [parameter.value for name, parameter in overrides.items() if name.endswith(".depth")]
        who = partial(waited_for, node, [self.samples, *self.channels])
        self.flow = Flow(self._flowing, node.get_logger().warning, who, min([STREAM.depth, *filter(None, depths)]))
        self.look = self.flow.look
        self.acknowledged = 0  # samples
        self.lockstep = None
        if answer_timeout is not None:
            self.lockstep = Lockstep(self._answering, node.get_logger().warning, answer_timeout)
            self.answers = node.create_subscription(Answer, "answers", self._on_answer, SAID)
        self.run, self.first = -1, 0  # the pass that is being sent, and its first sample
        self.audience = Audience(node, self.samples)
        self.find_subscribers()
        self.test.publish(test_to_msg(recording))

    def test_has_arrived(self) -> bool:
        return self.test.wait_for_all_acked(NOT_WAITING)

    def all_have_arrived(self) -> bool:
        """Whether reliable subscribers have got all samples and the last state, and in lock-step have answered."""
        answered = self.lockstep is None or self.lockstep.has_room(time.perf_counter())
        return answered and self.flow.all_taken(time.perf_counter()) and self.state.wait_for_all_acked(NOT_WAITING)

    def has_room(self, now: float, on_time: bool) -> bool:
        """Whether more may be sent at the wall time `now`."""
        if self.lockstep and not self.lockstep.has_room(now):
            return False
        return self.flow.has_room(now, on_time)

    def wait_for_room(self) -> None:
        """A moment, at most 0.5 ms; in lock-step less where the last answer comes."""
        if self.lockstep and self.lockstep.owing:
            self.lockstep.wait(0.0005)
        else:
            time.sleep(0.0005)

    def _answering(self) -> Listeners:
        """Full names of the nodes that publish answers, but of those just found whose names are still to come.

        Only those whose subscription to the samples is found, too: else what is sent next would not reach them.
        """
        hearing = {process_of(info) for info in self.node.get_subscriptions_info_by_topic(self.samples.topic_name)}
        found: dict[str, set[bytes]] = {}
        for info in self.node.get_publishers_info_by_topic(self.answers.topic_name):
            if info.node_name != UNNAMED and process_of(info) in hearing:
                found.setdefault(node_name(info), set()).add(process_of(info))
        return found

    def _on_answer(self, message: Answer) -> None:
        self.lockstep.answer(message.node, Answered(message.run, message.number, message.missed))

    def find_subscribers(self) -> None:
        """Look who listens: what nobody listens to is not made."""
        self.clock.look()
        self.heard = [k for k, publisher in enumerate(self.channels) if publisher.get_subscription_count()]
        if self.lockstep:
            self.lockstep.find_listeners()

    def _flowing(self) -> list:
        return [self.samples, *(self.channels[k] for k in self.heard), *self.clock.heard]

    def send(self, batch: Batch) -> None:
        """The clock at the last sample of a batch, its samples, and each heard channel's values."""
        if batch.run != self.run:
            self.run, self.first = batch.run, batch.start
        if self.lockstep:
            self.lockstep.expect(batch.run, batch.stop - 1)
        message = samples_to_msg(self.recording, batch.start, batch.stop, batch.run, self.time_zero)
        self.clock.tell(self.time_zero + self.recording.time_ns.item(batch.stop - 1))
        self.samples.publish(message)
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

    def send_state(self, player: Player, tally: Tally, block: int, rate: float) -> None:
        """rate: kept now, times real time."""
        self.find_subscribers()
        position_ns = player.position_ns(time.perf_counter())
        if self.flow.acknowledged():
            self.acknowledged = tally.samples
        reached = Progress(player.run, len(self.recording), player.next, done=player.mode == Mode.FINISHED)
        message = ReplayState(
            state=int(player.mode),
            run=player.run,
            number=player.next,
            total=len(self.recording),
            sent=tally.samples,
            acknowledged=self.acknowledged,
            # who was killed is looked for only where there is time for it
            subscribers=self.audience.ready() if player.mode == Mode.WAITING else self.samples.get_subscription_count(),
            time=position_ns / SECOND,
            rate_asked=player.rate,
            rate_actual=rate,
            worst_lateness=tally.worst_lateness,
            block=block,
            first=self.first if player.run == self.run else player.next,
            listeners=self.audience.look(reached),
        )
        self.clock.tell(self.time_zero + position_ns)  # it ticks while nothing is sent, too
        message.header.stamp = stamp(self.time_zero + position_ns)
        self.state.publish(message)
