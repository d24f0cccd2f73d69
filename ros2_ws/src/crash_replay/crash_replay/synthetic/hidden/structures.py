"""The five structures, each drawn at random: masses, element characteristics, clearances and driven motions.

An element's characteristic is one constant stiffness (the model file then says so) or a curve, and crushed
structures unload elastically or along a line whose slope the model knows.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from .. import dummy as doors
from ..scenario import Scenario
from ..sensors import Sensor, accelerometer, crush_rate_sensor, crush_sensor, load_cell_barrier
from ..system import Body, Element, Motion, System
from .curves import random_curve, steepest, straight
from .laws import Carrier
from .specimen import STEP, Specimen, model_element

PLASTIC = 0.7
"""Share of the crushed structures that unload along a line of their own."""


FACE = (0.0, 0.4, 1.2, 2.2, 2.5, 2.3)
"""m/s: the face of what the impactor hits gives way."""


class Part(NamedTuple):
    """What an element is drawn from."""

    name: str
    between: tuple[str, str]
    stiffness: float  # N/m, typical; also the model file's initial value
    crush: float  # m, typical
    crushed: bool = False  # a structure that is crushed for good, as against a mount or a joint
    tension: bool = True
    damping: float = 0.0  # N s/m, known
    known: bool = False  # constant, and the model knows it


def side(rng: np.random.Generator) -> Specimen:
    """Moving deformable barrier, door and car."""
    bodies = (Body("mdb", _about(rng, 1000.0), 13.0), Body("door", _about(rng, 80.0)), Body("car", _about(rng, 1500.0)))
    parts = (
        Part("mdb_door", ("mdb", "door"), 8e5, 0.35, crushed=True, damping=2000.0),
        Part("door_car", ("door", "car"), 8e5, 0.35, damping=2000.0),
    )
    return _specimen(rng, "side", bodies, parts, "y", 0.10, host="car", pairs=(("mdb", "car"),))


def frontal(rng: np.random.Generator) -> Specimen:
    """Cab and engine on a barrier with load cells."""
    bodies = (Body("cab", _about(rng, 1319.0), 13.0), Body("engine", _about(rng, 400.0), 13.0), Body("barrier"))
    parts = (
        Part("cab_barrier", ("cab", "barrier"), 5e5, 0.6, crushed=True, tension=False, damping=1000.0),
        Part("engine_barrier", ("engine", "barrier"), 4e5, 0.5, crushed=True, tension=False, damping=200.0),
        Part("cab_engine", ("cab", "engine"), 2e6, 0.2, damping=1000.0, known=True),
    )
    return _specimen(rng, "frontal", bodies, parts, "x", 0.11, host="cab")


def single(rng: np.random.Generator) -> Specimen:
    """One mass on a barrier with load cells."""
    bodies = (Body("car", _about(rng, 1719.0), 13.0), Body("barrier"))
    parts = (Part("car_barrier", ("car", "barrier"), 5e5, 0.7, crushed=True, tension=False),)
    stop = ("barrier", float(rng.uniform(0.2, 0.4)))
    return _specimen(rng, "single", bodies, parts, "x", 0.11, host="car", stop=stop)


def dummy(rng: np.random.Generator) -> Specimen:
    """Rib, spine and pelvis between door and car, with clearances that close at different times."""

    def driven(name: str, velocity: tuple[float, ...], gap: float = 0.0) -> Body:
        faster = [rng.uniform(0.85, 1.15) * v for v in velocity]
        return Body(name, displacement=-gap, motion=Motion(doors.TIME, faster))

    upper, lower = rng.uniform(0.02, 0.10, 2).tolist()
    bodies = (
        Body("rib", _about(rng, 16.8)), Body("pelvis", _about(rng, 39.2)), Body("spine", _about(rng, 28.0)),
        driven("door_upper", doors.DOOR_UPPER, upper), driven("door_lower", doors.DOOR_LOWER, lower),
        driven("car", doors.CAR),
    )  # fmt: skip
    parts = (
        Part("door_rib", ("door_upper", "rib"), 8e4, 0.10, crushed=True, tension=False),
        Part("rib_spine", ("rib", "spine"), 1.2e5, 0.05),
        Part("door_pelvis", ("door_lower", "pelvis"), 1.5e5, 0.10, crushed=True, tension=False),
        Part("car_pelvis", ("car", "pelvis"), 4e4, 0.10),
        Part("pelvis_spine", ("pelvis", "spine"), 1.1e5, 0.05),
    )
    pairs = (("door_upper", "spine"), ("rib", "pelvis"), ("car", "spine"))
    return _specimen(rng, "dummy", bodies, parts, "y", 0.09, host="spine", pairs=pairs)


def impactor(rng: np.random.Generator) -> Specimen:
    """A pendulum impactor with a padded face, as for a thorax; the padding's crush and its rate are measured."""
    motion = Motion((0.0, 0.005, 0.010, 0.020, 0.035, 0.060), rng.uniform(0.5, 1.5) * np.array(FACE))
    bodies = (Body("impactor", _about(rng, 23.4), 6.0), Body("face", motion=motion))
    parts = (Part("padding", ("impactor", "face"), 1e5, 0.06, crushed=True, tension=False),)
    measured = (crush_sensor("padding_dx", "padding"), crush_rate_sensor("padding_vx", "padding"))
    return _specimen(rng, "impactor", bodies, parts, "x", 0.06, host="impactor", measured=measured)


STRUCTURES: Mapping[str, Callable[[np.random.Generator], Specimen]] = {
    build.__name__: build for build in (frontal, single, side, dummy, impactor)
}


def _about(rng: np.random.Generator, mass: float) -> float:
    return _short(mass * rng.uniform(0.8, 1.25))


def _short(value: float) -> float:
    """To four figures, as a model file states it."""
    return float(f"{value:.4g}")


def _specimen(  # noqa: PLR0913 - the parts that a structure is told by
    rng: np.random.Generator, name: str, bodies: tuple[Body, ...], parts: tuple[Part, ...], axis: str, duration: float,
    host: str, pairs: tuple[tuple[str, str], ...] = (), stop: tuple[str, float] | None = None,
    measured: tuple[Sensor, ...] = (),
) -> Specimen:  # fmt: skip
    """`measured`: sensors of the only element's crush and rate, where the model takes them instead of integrating."""
    moving = [b for b in bodies if b.mass or (b.motion and not measured)]
    barrier = [b.name for b in bodies if b.name == "barrier"]
    sensors = [accelerometer(f"{b.name}_a{axis}", b.name) for b in moving]
    sensors += [load_cell_barrier(f"{b}_f{axis}", b) for b in barrier]
    elements, told = zip(*(_element(rng, part) for part in parts))
    scenario = Scenario(
        name, f"Simulated: {STRUCTURES[name].__doc__.rstrip('.')}", System(bodies, tuple(elements)),
        (*sensors, *measured), duration, max_step=STEP,
    )  # fmt: skip
    model: dict[str, Any] = {
        "name": name,
        "bodies": {b.name: _model_body(b, axis, bool(measured)) for b in bodies},
        "elements": {e.name: model_element(e, t, part.stiffness) for e, t, part in zip(elements, told, parts)},
    }
    if measured:
        displacement, velocity = (sensor.channel.name for sensor in measured)
        model["elements"][parts[0].name] |= {"displacement": displacement, "velocity": velocity}
    return Specimen(scenario, model, host, pairs, stop)


def _element(rng: np.random.Generator, part: Part) -> tuple[Element, str]:
    """-> the element, and what its model tells of its stiffness."""
    stiffness = _short(part.stiffness * np.exp(rng.normal(0.0, 0.25)))
    told = "known" if part.known else str(rng.choice(["constant", "curve"]))
    curve = random_curve(rng, stiffness, part.crush) if told == "curve" else straight(stiffness)
    plastic = part.crushed and rng.random() < PLASTIC
    slope = _short(steepest(curve, 2.0 * part.crush) * rng.uniform(1.3, 3.0))
    law = Carrier(curve, part.tension and not plastic, slope if plastic else None, part.damping)
    return Element(part.name, part.between, law), told


def _model_body(body: Body, axis: str, crush_is_measured: bool) -> dict:
    channel = f"{body.name}_a{axis}"
    if body.mass:
        return {"mass": body.mass, "acceleration": channel}
    if body.motion and not crush_is_measured:
        return {"motion": channel}
    return {"fixed": True} | ({"force": f"{body.name}_f{axis}"} if body.name == "barrier" else {})
