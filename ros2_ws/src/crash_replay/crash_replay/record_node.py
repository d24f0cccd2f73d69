"""`record`: writes what estimators and diagnosis publish beside the recording, as MCAP, the same on every run.

    ros2 run crash_replay record --ros-args -p to:=estimates.mcap -p wait_for:=2

Start it before the replay, and let the replay wait for it as for the estimators (its own wait_for): it listens to
`samples` as soon as it hears `wait_for` estimators. It ends when the replay is gone and nothing more comes, or with
Ctrl-C, and writes the file then; till then it holds all messages.
"""

import signal
import sys
import time
from pathlib import Path

import crash_msgs.msg
import rclpy
from rcl_interfaces.msg import IntegerRange, ParameterDescriptor
from rclpy.exceptions import ParameterException
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future

from .middleware import prepare_middleware
from .qos import EVERY_SAMPLE, EVERY_SAMPLE_SAID
from .recorder import Heard, Recorder
from .ros_runtime import spin

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
"""s without a message, once the replay is gone, that end the recording."""


class RecordError(Exception):
    """Nothing can be recorded; the message is one readable line."""


class RecordNode(Node):
    """Finds the topics by their types and hands what comes to a `Recorder`."""

    def __init__(self) -> None:
        super().__init__("record")
        several = IntegerRange(from_value=0, to_value=1000, step=1)
        meaning = ParameterDescriptor(description="estimators to hear before the samples", integer_range=[several])
        self.wait_for = self.declare_parameter("wait_for", 1, meaning).value
        meaning = ParameterDescriptor(description="the file to write, which must not exist: *.mcap")
        self.file = reserved(self.declare_parameter("to", "", meaning).value)
        self.recorder, self.heard = Recorder(), dict[str, str]()  # type by name
        self.newest = 0.0  # when a topic was found
        self.replayed = False  # a replay is or was there
        self.last = time.monotonic()  # when a message came
        self.done = Future()
        self.create_timer(LOOK, self._look)

    def _look(self) -> None:
        """The samples come last: a replay that waits for this node then starts when all else is heard."""
        for name, types in self.get_topic_names_and_types():
            if name in self.heard or types[0] not in RECORDED or not self.count_publishers(name):
                continue
            if types[0] != SAMPLES or self._settled():
                self.heard[name] = types[0]
                self.newest = time.monotonic()
                topic = Heard(name, types[0], RECORDED[types[0]])
                kind = getattr(crash_msgs.msg, topic.type.rpartition("/")[2])
                self.create_subscription(kind, name, self._hearing(topic), self._qos(name), raw=True)
                self.get_logger().info(f"recording {name}")
        if replays := self.count_publishers("replay_state"):
            self.replayed, self.last = True, time.monotonic()
        if self.replayed and not replays and time.monotonic() - self.last > QUIET:
            self.done.set_result(None)

    def _qos(self, topic: str) -> QoSProfile:
        """What was said before this node came is heard where it is kept."""
        offered = [info.qos_profile.durability for info in self.get_publishers_info_by_topic(topic)]
        return EVERY_SAMPLE_SAID if set(offered) == {DurabilityPolicy.TRANSIENT_LOCAL} else EVERY_SAMPLE

    def _settled(self) -> bool:
        estimators = list(self.heard.values()).count(ESTIMATES)
        return estimators >= self.wait_for and time.monotonic() - self.newest > SETTLED

    def _hearing(self, topic: Heard):
        def hear(data: bytes) -> None:
            self.last = time.monotonic()
            self.recorder.hear(topic, data)

        return hear


def reserved(name: str) -> Path:
    """The file of that name, made empty now so that it can be written at the end; raises RecordError."""
    file = Path(name)
    if file.suffix != ".mcap":
        raise RecordError(f"parameter to must be a file that ends in .mcap, got {name!r}: -p to:=estimates.mcap")
    try:
        file.touch(exist_ok=False)
    except FileExistsError:
        raise RecordError(f"parameter to: {file} exists already: take another name, nothing is overwritten") from None
    except OSError as error:
        hint = f"there is no folder {file.parent}: make it first" if not file.parent.is_dir() else error.strerror
        raise RecordError(f"parameter to: {file} cannot be written: {hint}") from None
    return file


def write(recorder: Recorder, file: Path) -> str:
    """Write what came; one line on it. Raises RecordError, and leaves no file, where nothing came."""
    if not recorder.count:
        file.unlink()
        raise RecordError("nothing came to be recorded: do replay and estimators run, with this ROS_DOMAIN_ID?")
    try:
        recorder.write(file)
    except OSError as error:
        raise RecordError(f"{file} cannot be written: {error.strerror}") from error
    return f"{file}: {recorder.count} messages on {len(recorder.messages)} topics"


def main() -> int:
    prepare_middleware()
    # Ctrl-C must end the recording between two messages, not take the context away under it.
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    try:
        return record(RecordNode())
    except (RecordError, ParameterException) as error:
        print(f"error: {' '.join(str(error).split())}", file=sys.stderr)
        return 1
    finally:
        rclpy.shutdown()


def record(node: RecordNode) -> int:
    """Hear and write -> exit status."""
    executor = EventsExecutor()
    executor.add_node(node)

    def stop(*_) -> None:
        node.done.set_result(None)
        executor.wake()

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, stop)
    try:
        spin(executor, until=node.done)
        print(write(node.recorder, node.file), flush=True)
        return 0
    finally:
        executor.shutdown()
        node.destroy_node()


if __name__ == "__main__":
    sys.exit(main())
