"""`estimator`: follows the replayed samples with one model and one method, and publishes what it finds.

Subscribes to `test` and `samples`; publishes `~/parameters`, `~/residuals`, `~/forces`, `~/events`.
Several run side by side under different names (`--ros-args -r __node:=mrls`).
"""

import sys
from typing import Any

import numpy as np
import rclpy
from crash_msgs.msg import Event, Forces, Parameters, Residuals, Samples, TestInfo
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.exceptions import ParameterException
from rclpy.executors import ExternalShutdownException
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import Trigger

from crash_replay.qos import EVERY_SAMPLE, LATCHED, STREAM
from crash_replay.recording import Channel, RecordingError, Sample, Test
from crash_replay.ros_messages import add_ns, samples_from_msg, test_from_msg
from crash_replay.ros_runtime import acknowledge_promptly, spin

from ..cli.common import parse_settings
from ..core.estimate import Estimate
from ..core.methods import METHODS, AnyEstimator, make_estimator
from ..core.structure import ModelError
from ..model_file import load_model, ready_models
from .estimate_messages import EstimateMessages


class EstimatorNode(Node):
    def __init__(self, **options) -> None:
        """options: of rclpy's Node, such as parameter_overrides. Raises ModelError with one line."""
        super().__init__("estimator", **options)
        self.method = self._declared("method", "constrained_kalman", f"one of {', '.join(METHODS)}")
        model = self._declared("model", "", f"a .yaml file, or one of {', '.join(ready_models())}")
        settings = self._declared("settings", [""], "settings of the method, such as forgetting=0.98")
        self.settings = parse_settings([pair for pair in settings if pair])
        if self._declared("effective_mass", False, "find the masses that go with the accelerometers first"):
            self.settings["effective_mass"] = True
        if not model:
            raise ModelError(f"parameter model is not set: give a .yaml file, or one of {', '.join(ready_models())}")
        self.structure = load_model(model)
        self._try_out()
        self.estimator: AnyEstimator | None = None
        self.messages: EstimateMessages | None = None
        self.channels = 0  # of the test
        self.state: Any = None  # of the estimator; None: a pass over the recording is to begin
        self.stopped = False  # by numbers that no filter can go on with, until the next pass
        self.run, self.next_number = 0, 0
        self.parameters_out = self.create_publisher(Parameters, "~/parameters", STREAM)
        self.residuals_out = self.create_publisher(Residuals, "~/residuals", STREAM)
        self.forces_out = self.create_publisher(Forces, "~/forces", STREAM)
        self.events_out = self.create_publisher(Event, "~/events", STREAM)
        self.create_service(Trigger, "~/reset", self._on_reset)
        self.create_subscription(TestInfo, "test", self._on_test, LATCHED)
        self.create_subscription(Samples, "samples", self._on_samples, EVERY_SAMPLE)

    def _declared(self, name: str, default, description: str):
        return self.declare_parameter(name, default, ParameterDescriptor(description=description)).value

    def _try_out(self) -> None:
        """One sample of a test that has just the model's channels: what is wrong with model or method shows now.

        It also gets the compiled code ready before the subscription that a replay waits for.
        """
        channels = {name: Channel(name, quantity) for _, name, quantity in self.structure.channels()}
        test = Test("try-out", tuple(channels.values()))
        estimator = make_estimator(self.structure, test, self.method, **self.settings)
        estimator.step(estimator.init(), Sample(0, 0, np.zeros(len(channels))))

    def _on_test(self, message: TestInfo) -> None:
        self.estimator = self.state = None
        try:
            test = test_from_msg(message)
            self.estimator = make_estimator(self.structure, test, self.method, **self.settings)
        except (ModelError, RecordingError) as error:
            self.get_logger().error(f"{error}; nothing is estimated on this test")
            return
        self.messages, self.channels = EstimateMessages(self.estimator.description), len(test.channels)
        self.get_logger().info(f"test {test.id}: model {self.structure.name}, method {self.method}")

    def _on_samples(self, message: Samples) -> None:
        if self.estimator is None:
            return
        estimates = self._estimates(self._new_samples(message))
        if not estimates:
            return
        stamp = add_ns(message.header.stamp, estimates[0].time_ns - message.time_ns[0])
        self.parameters_out.publish(self.messages.parameters(stamp, self.run, estimates))
        self.residuals_out.publish(self.messages.residuals(stamp, self.run, estimates))
        self.forces_out.publish(self.messages.forces(stamp, self.run, estimates))
        for estimate in estimates:
            if estimate.events:
                own = add_ns(stamp, estimate.time_ns - estimates[0].time_ns)
                for event in self.messages.events(own, self.run, estimate):
                    self.events_out.publish(event)

    def _new_samples(self, message: Samples) -> list[Sample]:
        """The message's samples that follow what has been seen; says so where some are missing or come again."""
        expected, found = len(message.time_ns) * self.channels, len(message.values)
        if not found or found != expected:
            self.get_logger().error(
                f"samples from number {message.number}: expected {expected} values ({self.channels} channels), "
                f"found {found}: left out; is there a second replay, of another test?"
            )
            return []
        samples = samples_from_msg(message)
        if self.state is None or message.run != self.run or message.number == 0:
            self.state, self.run, self.next_number, self.stopped = self.estimator.init(), message.run, 0, False
        missing = message.number - self.next_number
        if missing > 0:
            self._lost(message, missing)
        elif missing < 0:
            self.get_logger().warning(
                f"samples from number {message.number} come after number {self.next_number - 1}: what was seen before "
                "is left out; is there a second replay?"
            )
            samples = samples[-missing:]
        self.next_number = samples[-1].number + 1 if samples else self.next_number
        return samples

    def _estimates(self, samples: list[Sample]) -> list[Estimate]:
        estimates: list[Estimate] = []
        for sample in [] if self.stopped else samples:
            try:
                self.state, estimate = self.estimator.step(self.state, sample)
                if not np.isfinite(estimate.parameters).all():
                    raise np.linalg.LinAlgError("the parameters are no longer finite")
            except np.linalg.LinAlgError as error:
                self.stopped = True
                self.get_logger().error(
                    f"sample {sample.number} at {sample.time * 1e3:.2f} ms: {self.method} cannot go on ({error}); "
                    "it starts again with the next pass over the test, or with the service ~/reset"
                )
                break
            estimates.append(estimate)
        return estimates

    def _lost(self, message: Samples, count: int) -> None:
        text = f"{count} samples before number {message.number} were not seen"
        if self.next_number == 0:
            text += ": the pass was joined late, its motion up to here is unknown; seek to the start for a whole one"
        self.get_logger().warning(text)
        event = Event(
            run=message.run, number=message.number, kind="lost", target="samples", value=float(count), text=text
        )
        event.header.stamp = message.header.stamp
        event.time = message.time_ns[0] * 1e-9
        self.events_out.publish(event)

    def _on_reset(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self.state = None  # the samples that follow begin a pass that was joined late
        response.success, response.message = True, "the next sample starts from the model's initial values"
        return response


def main() -> int:
    acknowledge_promptly()
    rclpy.init()
    try:
        node = EstimatorNode()
    except (ModelError, RecordingError, ParameterException) as error:
        print(f"error: {' '.join(str(error).split())}", file=sys.stderr)
        rclpy.try_shutdown()
        return 1
    executor = EventsExecutor()
    executor.add_node(node)
    try:
        spin(executor, until=Future())  # never done: a signal ends it
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
