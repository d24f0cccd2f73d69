"""How a node fares, once a second on `/diagnostics`, in the form that ROS's own tools show (rqt_robot_monitor)."""

from collections.abc import Callable, Mapping
from enum import IntEnum
from typing import NamedTuple

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

PERIOD = 1.0
"""s between two reports."""


class Level(IntEnum):
    """As in diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1  # it goes on, but look at it
    ERROR = 2  # no more is to be expected of it
    STALE = 3  # what it says is old: nothing has come for too long


class Health(NamedTuple):
    level: Level
    message: str  # one line
    values: Mapping[str, object]
    test: str = ""  # its id


class HealthReport:
    """Says a node's health while it is spun: one that is stuck falls silent, which the tools show as stale."""

    def __init__(self, node: Node, what: str, health: Callable[[], Health]):
        """what: of the node this is about, such as its queue."""
        self.node, self.health = node, health
        self.name = f"{node.get_fully_qualified_name().lstrip('/')}: {what}"
        self.out = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        # not by the node's own clock, which may be the replay's and stand still
        node.create_timer(PERIOD, self.tell, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def tell(self) -> None:
        health = self.health()
        status = DiagnosticStatus(
            level=bytes([health.level]),
            name=self.name,
            message=health.message,
            hardware_id=health.test,
            values=[KeyValue(key=key, value=_text(value)) for key, value in health.values.items()],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = self.node.get_clock().now().to_msg()
        self.out.publish(message)


def _text(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
