"""`air_bag_trigger`: while a car still crushes, says how far it will, and when it stands still; fires if that is far.

It hears only `parameters` of an estimator: stiffness and damping as they are now. Mass and speed before the impact are
what a car knows of itself. At the end it prints how far its predictions were off, and at what time.
"""

import math
import sys

import rclpy
from crash_msgs.msg import Parameters
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.task import Future
from std_msgs.msg import Bool, Float64

from crash_examples.mass_spring_damper import MassSpringDamper
from crash_examples.predictions import Prediction, told

EVERY_ONE = QoSProfile(history=HistoryPolicy.KEEP_ALL, reliability=ReliabilityPolicy.RELIABLE)
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)

CERTAIN = 0.1
"""Share of the stiffness that its standard deviation may be in a prediction that counts."""


class AirBagTrigger(Node):
    def __init__(self):
        super().__init__("air_bag_trigger")
        estimator = self.declare_parameter("estimator", "estimator").value
        self.element = self.declare_parameter("element", "car_barrier").value
        self.mass = self.declare_parameter("mass", 1719.0).value  # kg
        self.speed = self.declare_parameter("speed", 13.3).value  # m/s before the impact
        self.fire_above = self.declare_parameter("fire_above", 0.3).value  # m of crush
        self.measured = [self.declare_parameter(f"measured_{what}", 0.0).value for what in ("crush", "time")]
        self.run = -1
        self.done = Future()
        self.crush, self.still = (self.create_publisher(Float64, f"~/{n}", 10) for n in ("peak_crush", "stands_still"))
        self.fire = self.create_publisher(Bool, "~/fire", LATCHED)
        self.create_subscription(Parameters, f"{estimator}/parameters", self.on_parameters, EVERY_ONE)

    def begin(self, run: int) -> None:
        """A crash from its impact on."""
        self.run, self.time, self.x, self.v = run, 0.0, 0.0, self.speed
        self.predictions: list[Prediction] = []
        self.fired: Prediction | None = None

    def on_parameters(self, message: Parameters) -> None:
        if message.run != self.run:  # the replay went back, or began again
            self.begin(message.run)
        if message.time <= 0.0 or self.v <= 0.0:  # before the impact, or after it
            return
        now = {p.name: p for p in message.parameters}
        stiffness, damping = (now.get(f"{self.element}.{which}") for which in ("stiffness", "damping"))
        if stiffness is None:
            raise SystemExit(f"error: no {self.element}.stiffness among {', '.join(now)}: -p element:=NAME")
        car = MassSpringDamper(self.mass, stiffness.value, damping.value if damping else 0.0)
        self.x, self.v = car.after(self.x, self.v, message.time - self.time)
        self.time = message.time
        if self.v <= 0.0:
            self.done.set_result(None)
        elif stiffness.std < CERTAIN * stiffness.value:
            left = car.still_to_go(self.x, self.v)
            self.predict(Prediction(self.time, car.after(self.x, self.v, left)[0], self.time + left))

    def predict(self, prediction: Prediction) -> None:
        if not math.isfinite(prediction.stands_still):
            return
        self.predictions.append(prediction)
        self.crush.publish(Float64(data=prediction.crush))
        self.still.publish(Float64(data=prediction.stands_still))
        if not self.fired and prediction.crush > self.fire_above:
            self.fired = prediction
            self.fire.publish(Bool(data=True))

    def report(self) -> str:
        """What was predicted beside what was measured or, where that is not given, what it came to."""
        crush, time = self.measured
        return told(self.predictions, crush or self.x, time or self.time, self.fired)


def main() -> int:
    rclpy.init()
    node = AirBagTrigger()
    try:
        rclpy.spin_until_future_complete(node, node.done)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    if not node.done.done():
        print("ended before the car stood still")
        return 1
    print(node.report())
    return 0


if __name__ == "__main__":
    sys.exit(main())
