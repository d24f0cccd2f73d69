"""`relay`: takes samples and says as much as an estimator would, but computes nothing: the price of the messages alone.

The same topics, types, qualities of service and executor; three messages out for each one in, of the sizes given.
"""

import sys
from array import array
from functools import lru_cache

import rclpy
from crash_msgs.msg import Forces, ParametersBlock, ResidualsBlock, Samples
from rclpy.executors import ExternalShutdownException
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.task import Future

from crash_replay.middleware import prepare_middleware
from crash_replay.qos import EVERY_SAMPLE, STREAM
from crash_replay.ros_runtime import spin

from ..core.estimate import ROW
from ..nodes.estimate_messages import FIELDS

TOPICS = {ParametersBlock: "block/parameters", ResidualsBlock: "block/residuals", Forces: "forces"}


class Relay(Node):
    def __init__(self) -> None:
        super().__init__("relay")
        width = {kind: self.declare_parameter(topic.rpartition("/")[2], 1).value for kind, topic in TOPICS.items()}
        self.width, self.bodies = width, self.declare_parameter("bodies", 1).value
        self.out = {kind: self.create_publisher(kind, f"~/{topic}", STREAM) for kind, topic in TOPICS.items()}
        self.create_subscription(Samples, "samples", self._on_samples, EVERY_SAMPLE)

    @lru_cache(maxsize=16)  # noqa: B019 - the one node lives as long as its process
    def _empty(self, samples: int) -> list:
        """Messages for so many samples; they are filled once."""
        messages = []
        for kind in TOPICS:
            n, message = self.width[kind], kind(model="none", method="relay")
            names = [f"b{k}.stiffness" for k in range(n)]
            if kind is Forces:
                message.element, message.between = names, ["a-b"] * n
                message.body = [f"b{k}" for k in range(self.bodies)]
                message.mass = array("d", bytes(8 * self.bodies))
            else:
                message.name, message.unit = names, ["N/m"] * n
            for field, name in FIELDS[kind].items():
                count = samples * (self.bodies if ROW[name].of == "bodies" else n)
                setattr(message, field, array("B", bytes(count)) if ROW[name].code else array("d", bytes(8 * count)))
            messages.append(message)
        return messages

    def _on_samples(self, samples: Samples) -> None:
        for message in self._empty(len(samples.time_ns)):
            message.header, message.run, message.number = samples.header, samples.run, samples.number
            message.time_ns = samples.time_ns
            self.out[type(message)].publish(message)


def main() -> int:
    prepare_middleware()
    rclpy.init()
    executor = EventsExecutor()
    executor.add_node(Relay())
    try:
        spin(executor, until=Future())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        executor.shutdown()
        rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
