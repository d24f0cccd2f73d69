"""A structure as drawn at random: the test that it makes, and the model file that tells of it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np

from ..integrate import simulate
from ..scenario import Scenario
from ..sensors import Sensor
from ..system import Body, Element
from .laws import Carrier

SPEEDS = (0.75, 1.1)
"""Of the nominal one; what an effect's size is measured by, whatever the speeds recorded."""

STEP = 2.5e-5
"""s, of the integration: halving it changes nothing that a sensor could resolve (tested)."""

COARSE_STEP, COARSE_RATE = 1e-4, 2000.0
"""s, Hz: enough for peak values."""


@dataclass(frozen=True)
class Specimen:
    scenario: Scenario  # at nominal speed, with all effects hidden so far
    model: Mapping[str, Any]  # the model file's content, without them
    host: str  # the body that something unmodelled would be mounted on
    pairs: tuple[tuple[str, str], ...] = ()  # bodies that nothing joins, yet something could
    stop: tuple[str, float] | None = None  # the body, and the distance m, where what is mounted on the host hits

    @property
    def name(self) -> str:
        return self.model["name"]

    def element(self, name: str) -> Element:
        return next(e for e in self.scenario.system.elements if e.name == name)

    def body(self, name: str) -> Body:
        return next(b for b in self.scenario.system.bodies if b.name == name)

    def told(self, element: str) -> str:
        """What the model knows of an element's stiffness: "known", "constant" or "curve"."""
        stiffness = self.model["elements"][element]["stiffness"]
        return stiffness["shape"] if isinstance(stiffness, Mapping) else "known"

    def with_law(self, name: str, **changes: Any) -> "Specimen":
        law = replace(carrier_of(self.element(name)), **changes)
        return self.with_parts(elements=[
            replace(e, spring=law) if e.name == name else e for e in self.scenario.system.elements
        ])  # fmt: skip

    def with_body(self, name: str, **changes: Any) -> "Specimen":
        bodies = [replace(b, **changes) if b.name == name else b for b in self.scenario.system.bodies]
        return self.with_parts(bodies=bodies)

    def with_sensor(self, channel: str, **changes: Any) -> "Specimen":
        sensors = [replace(s, **changes) if s.channel.name == channel else s for s in self.scenario.sensors]
        return self.with_parts(sensors=sensors)

    def with_parts(
        self,
        bodies: list[Body] | None = None,
        elements: list[Element] | None = None,
        sensors: list[Sensor] | None = None,
    ) -> "Specimen":
        old = self.scenario
        system = replace(
            old.system, bodies=tuple(bodies or old.system.bodies), elements=tuple(elements or old.system.elements)
        )
        return replace(self, scenario=replace(old, system=system, sensors=tuple(sensors or old.sensors)))


def carrier_of(element: Element) -> Carrier:
    """What an element of a specimen carries by: never another law."""
    return cast(Carrier, element.spring)


@dataclass(frozen=True)
class Peaks:
    """Largest values over both speeds, by element or body."""

    force: Mapping[str, float]  # N
    crush: Mapping[str, float]  # m, in compression
    travel: Mapping[str, float]  # m, of the crush either way while the element carries
    rate: Mapping[str, float]  # m/s, while the element carries
    drop: Mapping[str, float]  # of the force after its peak, as a share of it: 1 is unloaded
    acceleration: Mapping[str, float]  # m/s^2


def peaks_of(specimen: Specimen) -> Peaks:
    system, duration = specimen.scenario.system, specimen.scenario.duration
    time = np.arange(0.0, duration, 1.0 / COARSE_RATE)
    runs = [simulate(system.at_speed(speed), time, COARSE_STEP) for speed in SPEEDS]
    names, bodies = [e.name for e in system.elements], [b.name for b in system.bodies]
    force = np.max([np.abs(run.force).max(0) for run in runs], axis=0)
    drop = np.max([1.0 - run.force[-20:].min(0) / np.maximum(run.force.max(0), 1.0) for run in runs], axis=0)
    travel = np.max([np.abs(run.crush * (run.force != 0.0)).max(0) for run in runs], axis=0)
    return Peaks(
        force=dict(zip(names, force.tolist())),
        crush=dict(zip(names, np.max([run.crush.max(0) for run in runs], axis=0).tolist())),
        travel=dict(zip(names, travel.tolist())),
        rate=dict(
            zip(
                names,
                np.max([np.abs(run.rate * (run.force != 0.0)).max(0) for run in runs], axis=0).tolist(),
            )
        ),
        drop=dict(zip(names, drop.tolist())),
        acceleration=dict(zip(bodies, np.max([np.abs(run.acceleration).max(0) for run in runs], axis=0).tolist())),
    )


def model_element(element: Element, told: str, initial: float) -> dict[str, Any]:
    """An element's entry of the model file; what is told of its stiffness is "known", "constant" or "curve"."""
    law = carrier_of(element)
    known = float(law.curve(1.0)) if told == "known" else None
    entry: dict[str, Any] = {
        "between": list(element.between),
        "stiffness": known or {"estimate": True, "shape": told, "initial": initial, "min": 0.0},
    }
    if law.damping:
        entry["damping"] = law.damping
    if not law.tension:
        entry["tension"] = "none"
    if law.unloading is not None:
        entry["unloading"] = law.unloading
    return entry
