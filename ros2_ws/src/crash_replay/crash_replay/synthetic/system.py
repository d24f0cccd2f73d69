"""Bodies along one axis and the elements between them: the truth that a recording is made of.

x is positive in the direction the striking body travels; an element between a and b has the crush
X = x_a - x_b, and its force F pushes a back and b forward.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from .forces import Law, Slip


class Motion:
    """Forced motion of a driven body: its velocity as a cubic spline through knots at s, m/s, steady at both ends."""

    def __init__(self, time: Sequence[float] | np.ndarray, velocity: Sequence[float] | np.ndarray):
        from scipy.interpolate import CubicSpline  # late, as in curves.py

        self.time, self.velocity = tuple(map(float, time)), tuple(map(float, velocity))
        self._acceleration = CubicSpline(self.time, self.velocity, bc_type="clamped").derivative()

    def acceleration(self, time: np.ndarray) -> np.ndarray:
        """(n,) m/s^2 at times (n,) s; 0 beyond the knots."""
        within = (time >= self.time[0]) & (time <= self.time[-1])
        return np.where(within, self._acceleration(time), 0.0)


@dataclass(frozen=True)
class Body:
    """A free body has a mass; a driven one has a motion; a fixed one has neither."""

    name: str
    mass: float | None = None  # kg
    velocity: float = 0.0  # m/s at time zero, and before
    displacement: float = 0.0  # m at time zero
    motion: Motion | None = None
    push: Callable[[np.ndarray], np.ndarray] | None = None  # force on it from outside, N at times in s
    growth: Callable[[np.ndarray], np.ndarray] | None = None  # its mass at times in s, as a multiple of `mass`

    def __post_init__(self):
        if self.mass is not None and not self.mass > 0.0:
            raise ValueError(f"body {self.name}: the mass must be > 0 kg, got {self.mass}")
        if self.motion is not None and (self.mass is not None or self.velocity != self.motion.velocity[0]):
            raise ValueError(f"body {self.name}: a driven body has no mass, and its motion's first velocity")


@dataclass(frozen=True)
class Element:
    """Spring, damper C V and any other laws between two bodies; their forces add up."""

    name: str
    between: tuple[str, str]
    spring: Law
    damping: float = 0.0  # C, N s/m, both ways
    others: tuple[Law, ...] = ()
    slip: Slip | None = None

    def force(self, crush: float, rate: float, peak: float, slipped: float = 0.0) -> float:
        """N, compression positive; slipped: what the slip remembers."""
        force = self.spring(crush, rate, peak) + self.damping * rate
        for law in self.others:
            force += law(crush, rate, peak)
        if self.slip and (self.slip.both_ways or crush > 0.0):
            force += self.slip.force * slipped
        return force

    def slips(self, crush: float, rate: float, slipped: float) -> float:
        """ds/dt, at which what the slip remembers changes; nothing while the element is apart."""
        if self.slip is None or not (self.slip.both_ways or crush > 0.0):
            return 0.0
        return self.slip.flow(slipped, crush, rate)


@dataclass(frozen=True)
class System:
    bodies: tuple[Body, ...]
    elements: tuple[Element, ...]

    def ends(self) -> list[tuple[int, int]]:
        """Indices of each element's bodies a and b."""
        index = {body.name: k for k, body in enumerate(self.bodies)}
        return [(index[a], index[b]) for a, b in (element.between for element in self.elements)]

    def at_speed(self, factor: float) -> "System":
        """The same test at `factor` times its speed."""

        def faster(body: Body) -> Body:
            motion = body.motion and Motion(body.motion.time, [factor * v for v in body.motion.velocity])
            return replace(body, velocity=motion.velocity[0] if motion else factor * body.velocity, motion=motion)

        return replace(self, bodies=tuple(map(faster, self.bodies)))
