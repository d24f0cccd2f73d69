"""Orders of magnitude, from the measured motion: what priors, knots and starting points are scaled by.

They are the same for a structure and for every candidate that is added to it, so that evidences compare.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...effects.effect import Addition, ElementMotion, Shape
from ...structure import Element, Structure
from ..observation.record import ObservedRecord
from ..observation.trajectory import Trajectory, element_motion, integrate, measured_trajectory
from .free_curve import make_knots
from .largest_forces import largest_in_elements, largest_on_bodies

CELLS = 36
"""Of a free curve over its crush scale: 1 cm of a crush of 0.4 m, the length of a fold of a longitudinal."""

SHORTEST_CRUSH = 0.03
SHORTEST_SHARE = 0.15
"""An element that is hardly crushed gets this crush scale (m, or share of the largest crush in the structure, if that
is less), or its scale of stiffness becomes absurd. Ours: halved and doubled they changed nothing of 36 looked-at
cases."""

SLOWEST = 1e-3
"""m/s: of an element that hardly moves. Only forces are divided by it: it has to be above 0, not right."""

FAST = 5.0
"""m/s: a rate of crush for which an effect's limits hold as they stand. Where the largest one is less, so are they: a
friction that comes to its force near the largest rate of all is a damper. Of five carts that were let go by hand it
took the damper's place in four (at 0.42 to 0.68 m/s); with 5 all four are told right, with 2 three."""


class Magnitudes(NamedTuple):
    structure: Structure
    records: Sequence[ObservedRecord]
    measured: tuple[Trajectory, ...]
    body_force: np.ndarray  # (b,) N, largest; inf for a driven body
    crush_range: np.ndarray  # (e, 2) m, lowest and highest
    rate: np.ndarray  # (e,) m/s, largest while it may carry
    crush: np.ndarray  # (e,) m, scale of its crush
    force: np.ndarray  # (e,) N, largest
    stiffness: np.ndarray  # (e,) N/m
    cells: int  # of a curve over its crush scale
    shortest_crush: float  # m

    def element(self, name: str) -> int:
        return [e.name for e in self.structure.elements].index(name)

    def largest_crush(self, element: str, both_ways: bool = False) -> float:
        """m; both_ways: or extension, of an element with tension."""
        k = self.element(element)
        low, high = self.crush_range[k]
        return max(float(high), float(-low) if both_ways and self.structure.elements[k].tension else 0.0, 1e-4)

    def largest_rate(self, target: str) -> float:
        """m/s: of an element, while it may carry, or of a body."""
        body = self.structure.body_index.get(target)
        if body is None or target in (element.name for element in self.structure.elements):
            return float(self.rate[self.element(target)])
        return max(float(np.abs(motion.v[:, body]).max()) for motion in self.measured)

    def change_of_distance(self, a: int, b: int) -> float:
        """m, of two bodies: without what a zero's error adds, a parabola, where no sensor shows one of them. Its motion
        by the momentum has all other channels' errors, by as much larger as it is lighter: of three looked-at springs
        of 8000 N/m behind a nose of 70 g 0.6 to 1.1 kN/m were expected so, which cost them more than what a hysteresis
        that hardly yields, with two constants more, gains by chance."""
        moved = [motion.x[:, a] - motion.x[:, b] for motion in self.measured]
        bodies = (self.structure.bodies[k] for k in (a, b))
        if any(body.free and not body.is_measured for body in bodies):
            pairs = zip(self.records, moved, strict=True)
            moved = [x - np.polyval(np.polyfit(record.time, x, 2), record.time) for record, x in pairs]
        return max(float(np.ptp(x)) for x in moved)

    def shape_unit(self, shape: Shape, target: str) -> float:
        """What a shape constant's limits and starts are shares of."""
        if shape.of_crush:
            return self.largest_crush(target, shape.both_ways)
        return min(self.largest_rate(target) / FAST, 1.0) if shape.of_rate else 1.0

    def crushed_elements(self) -> list[Element]:
        """Elements that are crushed at all: of the others no law of crush can be told."""
        return [e for k, e in enumerate(self.structure.elements) if self.crush_range[k, 1] > 0.0]

    def strained_elements(self) -> list[Element]:
        """Those, and what is only stretched, and pulls, as the lashing of a load."""
        low, high = self.crush_range.T
        return [e for k, e in enumerate(self.structure.elements) if high[k] > 0.0 or (e.tension and low[k] < 0.0)]

    def coefficient(self, addition: Addition) -> float:
        """Prior standard deviation of an addition's coefficient."""
        size = addition.effect.size
        return addition.effect.prior_std(self, addition) if size is None else size

    def motion(self, record: int, element: int) -> ElementMotion:
        """Measured motion of an element while it may carry."""
        motion = element_motion(self.structure, self.records[record], self.measured[record], element)
        if not self.structure.elements[element].tension:
            apart = motion.crush <= 0.0
            motion = motion._replace(rate=np.where(apart, 0.0, motion.rate), crush=np.where(apart, 0.0, motion.crush))
        return motion

    def touching(self, addition) -> tuple[np.ndarray, float]:
        """Knots and crush scale of the curve between an attached body and the one that it pushes."""
        body = self.structure.body_index[addition.touches]
        low, high = 0.0, 0.0
        for record, measured in zip(self.records, self.measured):
            x = measured.x[:, body] - attached_motion(self.structure, record, addition)[2]
            low, high = min(low, float(x.min())), max(high, float(x.max()))
        crush = max(high - low, self.shortest_crush)
        return make_knots(low, high, crush, self.cells, True), crush

    def touching_damping(self, addition) -> float:
        """Scale of a damper beside that curve, N s/m."""
        body, rate = self.structure.body_index[addition.touches], SLOWEST
        for record, measured in zip(self.records, self.measured):
            v = measured.v[:, body] - attached_motion(self.structure, record, addition)[1]
            rate = max(rate, float(np.abs(v).max()))
        return self.host_force(addition) / rate

    def host_force(self, addition) -> float:
        index = self.structure.body_index
        return min(self.body_force[index[addition.host]], self.body_force[index[addition.touches]])


def attached_motion(
    structure: Structure, record: ObservedRecord, addition
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(g,) acceleration, velocity and displacement of the body behind an unused channel."""
    a = record.signals[addition.target].on_grid
    x0, v0 = attached_start(structure, record, addition)
    v, x = integrate(record.dt, a[:, None], np.array([v0]), np.array([x0]))
    return a, v[:, 0], x[:, 0]


def attached_start(structure: Structure, record: ObservedRecord, addition) -> tuple[float, float]:
    """Initial displacement and velocity: stated for the channel's body, else those of the body that it sits on."""
    carrier = record.test.channels[record.test.index(addition.target)].body
    host = structure.body_index[addition.taken_from or addition.host]
    if structure.bodies[host].fixed:
        host = next((k for k, body in enumerate(structure.bodies) if body.free), host)
    x0 = record.test.initial_displacement.get(carrier, record.initial_displacement[host])
    v0 = record.test.initial_velocity.get(carrier, record.initial_velocity[host])
    return float(x0), float(v0)


def measure_magnitudes(structure: Structure, records: Sequence[ObservedRecord], cells: int = CELLS) -> Magnitudes:
    """Along the measured motion; cells: of a curve."""
    measured = tuple(measured_trajectory(structure, record) for record in records)
    body_force = largest_on_bodies(structure, records, measured)
    elements = range(len(structure.elements))
    crush_range, rate = np.zeros((len(elements), 2)), np.full(len(elements), SLOWEST)
    for k in elements:
        for record, trajectory in zip(records, measured):
            motion = element_motion(structure, record, trajectory, k)
            crush_range[k, 0] = min(crush_range[k, 0], motion.crush.min())
            crush_range[k, 1] = max(crush_range[k, 1], motion.crush.max())
            touches = structure.elements[k].tension | (motion.crush > 0.0)
            rate[k] = max(rate[k], np.abs(motion.rate[touches]).max(initial=0.0))
    force = largest_in_elements(structure, records, measured, body_force)
    low, high = crush_range.T
    # how far a body has flown away from what cannot pull it says nothing of that: no farther than it was crushed
    reach = high - np.where([element.tension for element in structure.elements], low, np.maximum(low, -high))
    shortest = min(SHORTEST_CRUSH, SHORTEST_SHARE * float(reach.max(initial=0.0))) or SHORTEST_CRUSH
    crush = np.maximum(reach, shortest)
    return Magnitudes(
        structure, records, measured, body_force, crush_range, rate, crush, force, force / crush, cells, shortest
    )
