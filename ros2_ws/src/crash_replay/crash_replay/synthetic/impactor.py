"""A small impactor dropped into water: a body on a spring and damper behind a nose, their relative motion measured.

Size, spring and damper are those of a real one, the CyberDiver (arXiv:2503.20702) at 4 m/s; its
nose is slowed by the water for some milliseconds, which is given here as a forced motion.
"""

from .curves import constant
from .forces import Spring
from .scenario import Scenario
from .sensors import accelerometer, crush_rate_sensor, crush_sensor
from .system import Body, Element, Motion, System

TIME = (0.0, 0.001, 0.002, 0.004, 0.006, 0.010, 0.020, 0.035, 0.060)  # s
NOSE = (4.0, 3.84, 3.80, 3.84, 3.88, 3.89, 3.87, 3.84, 3.80)  # m/s


def impactor_single() -> Scenario:
    system = System(
        (Body("body", 0.639, 4.0), Body("nose", velocity=4.0, motion=Motion(TIME, NOSE))),
        (Element("spring", ("body", "nose"), Spring(constant(1.5e4)), damping=23.4),),
    )
    sensors = (
        accelerometer("body_ax", "body", noise=0.01, offset=0.1, step=0.0005),
        crush_sensor("rel_displacement", "spring"),
        crush_rate_sensor("rel_velocity", "spring"),
    )
    title = "Simulated impactor: a body behind a nose that meets water at 4 m/s"
    return Scenario("impactor_single", title, system, sensors, duration=0.05)
