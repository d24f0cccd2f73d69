"""`estimator`: follows the replayed samples with one model and one method, and publishes what it finds.

Subscribes to `test` and `samples`; publishes `~/parameters`, `~/residuals`, `~/forces`, `~/events`.
Several run side by side under different names (`--ros-args -r __node:=mrls`).
"""

import sys

import rclpy
from crash_msgs.msg import Event, Forces, Parameters, Residuals, Samples, TestInfo
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.executors import ExternalShutdownException
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from std_srvs.srv import Trigger

from crash_replay.qos import LATCHED, STREAM
from crash_replay.recording import RecordingError
from crash_replay.ros_messages import add_ns, samples_from_msg, test_from_msg

from ..cli.common import parse_settings
from ..core.estimator import Estimator, State
from ..core.methods import METHODS, make_estimator
from ..core.structure import ModelError
from ..model_file import load_model, ready_models
from .estimate_messages import EstimateMessages


class EstimatorNode(Node):
    def __init__(self) -> None:
        super().__init__("estimator")
        self.method = self._declared("method", "constrained_kalman", f"one of {', '.join(METHODS)}")
        model = self._declared("model", "", f"a .yaml file, or one of {', '.join(ready_models())}")
        settings = self._declared("settings", [""], "settings of the method, such as forgetting=0.98")
        self.settings = parse_settings([pair for pair in settings if pair])
        if not model:
            raise ModelError(f"parameter model is not set: give a .yaml file, or one of {', '.join(ready_models())}")
        self.structure = load_model(model)
        self.estimator: Estimator | None = None
        self.messages: EstimateMessages | None = None
        self.state: State | None = None
        self.run, self.next_number = 0, 0
        self.lost = 0
        self.parameters_out = self.create_publisher(Parameters, "~/parameters", STREAM)
        self.residuals_out = self.create_publisher(Residuals, "~/residuals", STREAM)
        self.forces_out = self.create_publisher(Forces, "~/forces", STREAM)
        self.events_out = self.create_publisher(Event, "~/events", STREAM)
        self.create_service(Trigger, "~/reset", self._on_reset)
        self.create_subscription(TestInfo, "test", self._on_test, LATCHED)
        self.create_subscription(Samples, "samples", self._on_samples, STREAM)

    def _declared(self, name: str, default, description: str):
        return self.declare_parameter(name, default, ParameterDescriptor(description=description)).value

    def _on_test(self, message: TestInfo) -> None:
        test = test_from_msg(message)
        try:
            self.estimator = make_estimator(self.structure, test, self.method, **self.settings)
        except (ModelError, RecordingError) as error:
            self.estimator = None
            self.get_logger().error(str(error))
            return
        self.messages = EstimateMessages(self.estimator.description)
        self.state = None
        self.get_logger().info(f"test {test.id}: model {self.structure.name}, method {self.method}")

    def _on_samples(self, message: Samples) -> None:
        if self.estimator is None:
            return
        if self.state is None or message.run != self.run:
            self._begin(message)
        elif message.number != self.next_number:
            self._lost(message, message.number - self.next_number)
        estimates = []
        for sample in samples_from_msg(message):
            self.state, estimate = self.estimator.step(self.state, sample)
            estimates.append(estimate)
        if not estimates:
            return
        self.next_number = estimates[-1].number + 1
        stamp, run = message.header.stamp, message.run
        self.parameters_out.publish(self.messages.parameters(stamp, run, estimates))
        self.residuals_out.publish(self.messages.residuals(stamp, run, estimates))
        self.forces_out.publish(self.messages.forces(stamp, run, estimates))
        for estimate in estimates:
            if estimate.events:
                own = add_ns(stamp, estimate.time_ns - estimates[0].time_ns)
                for event in self.messages.events(own, run, estimate):
                    self.events_out.publish(event)

    def _begin(self, message: Samples) -> None:
        """A new pass over the recording starts from nothing; so does one that is joined on the way."""
        self.state, self.run = self.estimator.init(), message.run
        if message.number:
            self._lost(message, message.number, "joined late: ")

    def _lost(self, message: Samples, count: int, why: str = "") -> None:
        text = f"{why}{count} samples before number {message.number} were not seen"
        self.lost += max(count, 0)
        self.get_logger().warning(text)
        event = Event(run=message.run, number=message.number, kind="lost", target="samples", value=float(count), text=text)
        event.header.stamp = message.header.stamp
        event.time = message.time_ns[0] * 1e-9 if message.time_ns else 0.0
        self.events_out.publish(event)

    def _on_reset(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self.state = None
        response.success, response.message = True, "the next sample starts from the model's initial values"
        return response


def main() -> None:
    rclpy.init()
    try:
        node = EstimatorNode()
    except (ModelError, RecordingError) as error:
        print(f"error: {error}", file=sys.stderr)
        rclpy.shutdown()
        sys.exit(1)
    executor = EventsExecutor()
    executor.add_node(node)
    try:
        executor.spin()
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
