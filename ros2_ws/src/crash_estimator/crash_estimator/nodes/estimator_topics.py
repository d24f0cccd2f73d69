"""What `estimator` publishes."""

import time
from collections.abc import Sequence
from functools import partial

from builtin_interfaces.msg import Time
from crash_msgs.msg import Answer, EstimatorState, Event, Forces, ParametersBlock, ResidualsBlock
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from crash_replay.cdr import Serialized
from crash_replay.flow import NOT_WAITING, Flow
from crash_replay.qos import EVENTS, LATCHED, STREAM
from crash_replay.ros_messages import stamp, stamp_ns
from crash_replay.subscribers import waited_for

from ..core.estimate import Description
from ..following.columns import Columns
from .effect_requests import model_effect
from .estimate_messages import FIELDS, EstimateMessages
from .estimator_model import EstimatorModel
from .later import LOOK, Later
from .named_estimates import NamedTopics


class EstimatorTopics:
    def __init__(self, node: Node, value_topics: Sequence[str] = ()):
        """value_topics: parameters that get a topic of their own, names or patterns."""
        self.parameters = node.create_publisher(ParametersBlock, "~/block/parameters", STREAM)
        self.residuals = node.create_publisher(ResidualsBlock, "~/block/residuals", STREAM)
        self.named = NamedTopics(node, value_topics)
        self.forces = node.create_publisher(Forces, "~/forces", STREAM)
        self.events = node.create_publisher(Event, "~/events", EVENTS)
        self.state = node.create_publisher(EstimatorState, "~/state", LATCHED)
        self.answers = node.create_publisher(Answer, "answers", LATCHED)  # a replay that finds it late gets the last
        self.answered = Serialized(Answer(node=node.get_fully_qualified_name()))
        streams = (self.parameters, self.residuals, self.forces, *self.named.streams)
        self.flow = Flow(lambda: streams, node.get_logger().warning, partial(waited_for, node, streams))
        self.later = Later(self.forces.publish, lambda: self.forces.wait_for_all_acked(NOT_WAITING))
        self.looking = node.create_timer(LOOK, self._look_later, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self.looking.cancel()  # till something waits
        self.messages: EstimateMessages | None = None
        self.time_zero = 0  # stamp of the impact, ns

    def begin(self, description: Description, revision: int, time_zero: Time) -> None:
        """What follows comes from this model on this test."""
        self.messages, self.time_zero = EstimateMessages(description, revision), stamp_ns(time_zero)
        self.named.begin(description, revision)

    def estimates(self, run: int, columns: Columns, stamp_ns: int) -> None:
        """stamp_ns: of the first of the samples. Waits while those who keep all have not taken what was said before."""
        self._wait_for_room()
        self.parameters.publish(self.messages.parameters(stamp_ns, run, columns))
        self.residuals.publish(self.messages.residuals(stamp_ns, run, columns))
        if self.forces.get_subscription_count():
            self._tell_forces(run, columns, stamp_ns)
        self.flow.sent(1, 0)
        self.named.publish(run, columns, stamp_ns, self._sent_named)
        for event in self.messages.events(stamp_ns, run, columns):
            self.events.publish(event)

    def _wait_for_room(self) -> None:
        while not self.flow.has_room(time.perf_counter(), on_time=True):
            time.sleep(0.0005)

    def _sent_named(self, size: int) -> None:
        """Of a block there may be more of them than a publisher keeps."""
        self.flow.sent(1, size)
        self._wait_for_room()

    def _tell_forces(self, run: int, columns: Columns, stamp_ns: int) -> None:
        """They are for who looks on, and nearly half of all that is said: in a rush the estimates go first.

        Where a replay in lock-step listens to the answers, all that there is to say is said before.
        """
        waits = self.later.count(len(columns)) and not self.answers.get_subscription_count()
        give, size = columns.later(FIELDS[Forces]) if waits else (lambda: columns, 0)
        messages = self.messages  # of this model, though there may be another one by then
        self.later.put(lambda: messages.forces(stamp_ns, run, give()), size, waits)
        if self.later.waiting and self.looking.is_canceled():
            self.looking.reset()

    def _look_later(self) -> None:
        self.later.look()
        if not self.later.waiting:
            self.looking.cancel()

    def event(self, kind: str, target: str, value: float, text: str, run: int, number: int, stamp_ns: int) -> None:
        time = (stamp_ns - self.time_zero) * 1e-9
        message = Event(run=run, number=number, time=time, kind=kind, target=target, value=value, text=text)
        message.header.stamp, message.header.frame_id = stamp(stamp_ns), self.messages.description.model
        self.events.publish(message)

    def tell_state(self, model: EstimatorModel, run: int, number: int, stamp_ns: int, **counts: int) -> None:
        """counts: the other numbers of an EstimatorState, by their fields."""
        names = {"model": model.structure.name, "method": model.method, "effects": model.effects()}
        names["model_effects"] = [model_effect(spec) for spec in model.structure.effects]
        message = EstimatorState(run=run, number=number, revision=model.revision, **names, **counts)
        message.header.stamp, message.header.frame_id = stamp(stamp_ns), message.model
        self.state.publish(message)

    def answer(self, run: int, number: int, missed: int) -> None:
        """All that there is to say on the samples up to this one is published."""
        fields = self.answered.numbers
        fields["run"][0], fields["number"][0], fields["missed"][0] = run, number, missed
        self.answers.publish(bytes(self.answered))
