"""Side impact of a moving deformable barrier into a car (thesis figures 4.1 and 5.6).

Masses, speed and damping are the thesis's. K1 is the barrier's face with the door's outside, K2 the
structure between the door's inside and the far side of the car. Both change abruptly: the face bottoms on the
door, the door meets the seat and the tunnel. The dampers act both ways.
"""

from dataclasses import replace

from .curves import stepped
from .forces import Spring
from .scenario import Scenario
from .sensors import Sensor, accelerometer
from .system import Body, Element, System

UNLOADING = 1.0e7  # N/m


def side_mdb_door_car() -> Scenario:
    system = System(
        (Body("mdb", 1000.0, 14.0), Body("door", 80.0), Body("car", 1500.0)),
        (
            Element(
                "mdb_door",
                ("mdb", "door"),
                Spring(stepped((0.0, 9.0e5), (0.10, 5.5e5), (0.20, 7.5e5), width=0.01), UNLOADING),
                damping=2000.0,
            ),
            Element(
                "door_car",
                ("door", "car"),
                Spring(stepped((0.0, 5.0e5), (0.12, 3.5e5), (0.24, 4.6e5), width=0.01), UNLOADING),
                damping=2000.0,
            ),
        ),
    )
    sensors = tuple(accelerometer(f"{body}_ay", body) for body in ("mdb", "door", "car"))
    title = "Simulated side impact: deformable barrier, door and car at 14 m/s"
    return Scenario("side_mdb_door_car", title, system, sensors, 0.10)


def side_abrupt() -> Scenario:
    """The thesis's problem of 5.6.1: 1 ms sampling, noise of 0.37 of each output's standard deviation."""
    base = side_mdb_door_car()
    sensors = tuple(Sensor(sensor.channel, sensor.of, noise_share=0.37) for sensor in base.sensors)
    title = "Simulated side impact: abrupt stiffness changes, 1 kHz, noise as in the thesis"
    return replace(base, name="side_abrupt", title=title, sensors=sensors, before=0.0, rate=1000.0)
