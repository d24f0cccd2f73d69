"""What `estimator` publishes."""

import time

from builtin_interfaces.msg import Time
from crash_msgs.msg import Answer, EstimatorState, Event, Forces, Parameters, Residuals
from rclpy.node import Node

from crash_replay.flow import Flow
from crash_replay.qos import LATCHED, STREAM
from crash_replay.ros_messages import stamp_ns

from ..core.estimate import Description
from ..following.columns import Columns
from .estimate_messages import EstimateMessages


class EstimatorTopics:
    def __init__(self, node: Node):
        self.name = node.get_fully_qualified_name()
        self.parameters = node.create_publisher(Parameters, "~/parameters", STREAM)
        self.residuals = node.create_publisher(Residuals, "~/residuals", STREAM)
        self.forces = node.create_publisher(Forces, "~/forces", STREAM)
        self.events = node.create_publisher(Event, "~/events", STREAM)
        self.state = node.create_publisher(EstimatorState, "~/state", LATCHED)
        self.answers = node.create_publisher(Answer, "answers", LATCHED)  # a replay that finds it late gets the last
        self.flow = Flow(lambda: (self.parameters, self.residuals, self.forces), node.get_logger().warning)
        self.messages: EstimateMessages | None = None
        self.time_zero = 0  # stamp of the impact, ns

    def begin(self, description: Description, revision: int, time_zero: Time) -> None:
        """What follows comes from this model on this test."""
        self.messages, self.time_zero = EstimateMessages(description, revision), stamp_ns(time_zero)

    def estimates(self, run: int, columns: Columns, stamp: Time) -> None:
        """stamp: of the first of the samples. Waits while those who keep all have not taken what was said before."""
        while not self.flow.has_room(time.perf_counter(), on_time=True):
            time.sleep(0.0005)
        self.parameters.publish(self.messages.parameters(stamp, run, columns))
        self.residuals.publish(self.messages.residuals(stamp, run, columns))
        if self.forces.get_subscription_count():
            self.forces.publish(self.messages.forces(stamp, run, columns))
        self.flow.sent(1, 0)
        for event in self.messages.events(stamp, run, columns):
            self.events.publish(event)

    def event(self, kind: str, target: str, value: float, text: str, run: int, number: int, stamp: Time) -> None:
        time = (stamp_ns(stamp) - self.time_zero) * 1e-9
        message = Event(run=run, number=number, time=time, kind=kind, target=target, value=value, text=text)
        message.header.stamp = stamp
        self.events.publish(message)

    def answer(self, run: int, number: int, missed: int) -> None:
        """All that there is to say on the samples up to this one is published."""
        self.answers.publish(Answer(node=self.name, run=run, number=number, missed=missed))
