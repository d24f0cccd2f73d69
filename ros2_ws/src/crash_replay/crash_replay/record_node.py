"""`record`: writes what estimators and diagnosis publish beside the recording, as MCAP, the same on every run.

    ros2 run crash_replay record --ros-args -p to:=estimates.mcap -p wait_for:=2

Start it before the replay, and let the replay wait for it as for the estimators (its own wait_for): it listens to
`samples` as soon as it hears `wait_for` estimators. It ends with the replay (or with Ctrl-C), once nothing more comes, and writes the file then.
"""

import signal
import sys
import time
from pathlib import Path

import crash_msgs.msg
import rclpy
from crash_msgs.msg import ReplayState
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

from .qos import EVERY_SAMPLE, LATCHED
from .recorder import Heard, Recorder
from .ros_runtime import acknowledge_promptly, spin

STAMPED = {
    f"crash_msgs/msg/{name}": False
    for name in ("Samples", "Parameters", "Residuals", "Forces", "Event", "Ranking", "Misfit")
}
RECORDED = STAMPED | {"crash_msgs/msg/TestInfo": True}
"""Types of the topics that are recorded, and whether they are latched."""

SAMPLES, ESTIMATES = "crash_msgs/msg/Samples", "crash_msgs/msg/Parameters"

LOOK = 0.1
"""s between two looks for new topics, and for the end."""

SETTLED = 0.3
"""s without a new topic after which those that are heard reach this node."""

QUIET = 1.0
"""s without a message after the replay's last sample that end the recording."""


class RecordNode(Node):
    """Finds the topics by their types and hands what comes to a `Recorder`."""

    def __init__(self) -> None:
        super().__init__("record")
        self.file = Path(self.declare_parameter("to", "").value)
        self.wait_for = self.declare_parameter("wait_for", 1).value
        self.recorder, self.heard = Recorder(), dict[str, str]()  # type by name
        self.newest = 0.0  # when a topic was found
        self.finished = False  # the replay's last sample is sent
        self.last = time.monotonic()  # when a message came
        self.done = Future()
        self.create_subscription(ReplayState, "replay_state", self._on_state, LATCHED)
        self.create_timer(LOOK, self._look)

    def _look(self) -> None:
        """The samples come last: a replay that waits for this node then starts when all else is heard."""
        for name, types in self.get_topic_names_and_types():
            if name not in self.heard and types[0] in RECORDED and (types[0] != SAMPLES or self._settled()):
                self.heard[name] = types[0]
                self.newest = time.monotonic()
                topic = Heard(name, types[0], RECORDED[types[0]])
                qos = LATCHED if topic.latched else EVERY_SAMPLE
                kind = getattr(crash_msgs.msg, topic.type.rpartition("/")[2])
                self.create_subscription(kind, name, self._hearing(topic), qos, raw=True)
                self.get_logger().info(f"recording {name}")
        if self.finished and time.monotonic() - self.last > QUIET:
            self.done.set_result(None)

    def _settled(self) -> bool:
        estimators = list(self.heard.values()).count(ESTIMATES)
        return estimators >= self.wait_for and time.monotonic() - self.newest > SETTLED

    def _hearing(self, topic: Heard):
        def hear(data: bytes) -> None:
            self.last = time.monotonic()
            self.recorder.hear(topic, data)

        return hear

    def _on_state(self, message: ReplayState) -> None:
        self.finished, self.last = message.state == ReplayState.FINISHED, time.monotonic()


def wrong_with(file: Path) -> str:
    """Why nothing can be written there, or nothing."""
    if file.suffix != ".mcap":
        return f"parameter to must be a file that ends in .mcap, got {str(file)!r}: --ros-args -p to:=estimates.mcap"
    if file.exists():
        return f"parameter to: {file} exists already: take another name, nothing is overwritten"
    if not file.parent.is_dir():
        return f"parameter to: there is no folder {file.parent}: make it first"
    return ""


def main() -> int:
    acknowledge_promptly()
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = RecordNode()
    wrong = wrong_with(node.file)
    if wrong:
        print(f"error: {wrong}", file=sys.stderr)
        node.destroy_node()
        rclpy.shutdown()
        return 1
    executor = EventsExecutor()
    executor.add_node(node)

    def stop(*_) -> None:
        node.done.set_result(None)
        executor.wake()

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, stop)
    try:
        spin(executor, until=node.done)
        node.recorder.write(node.file)
        print(f"{node.file}: {node.recorder.count} messages on {len(node.recorder.messages)} topics", flush=True)
        return 0
    finally:
        node.destroy_node()
        rclpy.shutdown()


if __name__ == "__main__":
    sys.exit(main())
