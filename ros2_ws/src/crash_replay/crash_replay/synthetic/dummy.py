"""The dummy in a side impact, loaded by the motion of door and car (thesis figure 6.4b, equation 6.1); its masses.

Five stiffnesses stand against three equations: they can be told apart only because a stiffness changes
slowly with crush. So each curve here is smooth and varies by some tens of percent, and the rib meets the door
some milliseconds before the pelvis does. Rib, spine and pelvis are joined elastically and without
damping, as in equation 6.1, so they ring on longer than a real dummy does; the door's inside is
crushed for good and unloads along a known slope.

Padding fills 50 mm of the clearance: contact comes earlier and softer, and stiffens as the foam is compressed.
"""

from .curves import Curve
from .forces import Spring
from .scenario import Scenario
from .sensors import accelerometer
from .system import Body, Element, Motion, System

UNLOADING = 6.0e5  # N/m, of the door's inside

TIME = (0.0, 0.004, 0.009, 0.014, 0.020, 0.028, 0.038, 0.050, 0.065, 0.080, 0.090)  # s
DOOR_UPPER = (0.0, 1.5, 6.4, 9.6, 10.1, 8.4, 6.7, 6.1, 6.0, 6.0, 6.0)  # m/s
DOOR_LOWER = (0.0, 2.1, 7.5, 10.3, 10.0, 7.9, 6.4, 6.0, 6.0, 6.0, 6.0)
CAR = (0.0, 0.05, 0.25, 0.6, 1.2, 2.05, 3.15, 4.35, 5.35, 5.85, 5.9)


def side_dummy_padded() -> Scenario:
    return _scenario(
        "side_dummy_padded", "Simulated side impact: dummy against a padded door",
        rib_gap=0.05, door_rib=Curve((0.0, 0.06, 0.10, 0.14), (0.85e5, 0.95e5, 1.05e5, 1.2e5)),
        pelvis_gap=0.11, door_pelvis=Curve((0.0, 0.06, 0.10, 0.14), (1.6e5, 1.9e5, 2.15e5, 2.4e5)),
    )  # fmt: skip


def side_dummy_unpadded() -> Scenario:
    return _scenario(
        "side_dummy_unpadded", "Simulated side impact: dummy against a door without padding",
        rib_gap=0.10, door_rib=Curve((0.0, 0.03, 0.06, 0.10), (1.5e5, 1.7e5, 1.9e5, 1.75e5)),
        pelvis_gap=0.16, door_pelvis=Curve((0.0, 0.03, 0.06, 0.10), (2.9e5, 3.3e5, 3.6e5, 3.4e5)),
    )  # fmt: skip


def _scenario(
    name: str, title: str, rib_gap: float, door_rib: Curve, pelvis_gap: float, door_pelvis: Curve
) -> Scenario:
    """Gaps in m: the clearance between door and dummy at time zero."""
    system = System(
        (
            Body("rib", 16.8), Body("pelvis", 39.2), Body("spine", 28.0),
            Body("door_upper", displacement=-rib_gap, motion=Motion(TIME, DOOR_UPPER)),
            Body("door_lower", displacement=-pelvis_gap, motion=Motion(TIME, DOOR_LOWER)),
            Body("car", motion=Motion(TIME, CAR)),
        ),
        (
            Element("door_rib", ("door_upper", "rib"), Spring(door_rib, UNLOADING, tension=False)),
            Element("rib_spine", ("rib", "spine"), Spring(Curve((0.0, 0.02, 0.05), (1.9e5, 2.05e5, 2.3e5)))),
            Element("door_pelvis", ("door_lower", "pelvis"), Spring(door_pelvis, UNLOADING, tension=False)),
            Element("car_pelvis", ("car", "pelvis"), Spring(Curve((0.0, 0.03, 0.10), (5.0e4, 4.7e4, 4.3e4)))),
            Element("pelvis_spine", ("pelvis", "spine"), Spring(Curve((0.0, 0.03, 0.08), (1.15e5, 1.25e5, 1.4e5)))),
        ),
    )  # fmt: skip
    sensors = tuple(accelerometer(f"{body.name}_ay", body.name) for body in system.bodies)
    return Scenario(name, title, system, sensors, duration=0.07)
