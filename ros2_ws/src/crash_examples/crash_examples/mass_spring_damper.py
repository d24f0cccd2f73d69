"""One mass on a spring and a damper: m a = -K x - C v; x is the crush in m, v its rate in m/s; SI units throughout."""

import math
from typing import NamedTuple


class MassSpringDamper(NamedTuple):
    mass: float  # kg
    stiffness: float  # N/m
    damping: float  # N s/m

    def after(self, x: float, v: float, t: float) -> tuple[float, float]:
        """Crush and rate t seconds after they were x and v."""
        a, w, swings = self._roots()
        cosine, sine = (math.cos(w * t), math.sin(w * t)) if swings else (math.cosh(w * t), math.sinh(w * t))
        sine = sine / w if w else t  # what it comes to as w goes to 0
        decay = math.exp(-a * t)
        acceleration = -2 * a * v - self.stiffness / self.mass * x
        return decay * (x * cosine + (v + a * x) * sine), decay * (v * cosine + (acceleration + a * v) * sine)

    def still_to_go(self, x: float, v: float) -> float:
        """s until the rate is zero; infinite where it only creeps towards it."""
        a, w, swings = self._roots()
        slowing = a * v + self.stiffness / self.mass * x
        if swings:
            return math.atan2(v * w, slowing) / w
        if not w:
            return v / slowing if slowing > 0 else math.inf
        return math.atanh(v * w / slowing) / w if slowing > v * w else math.inf

    def _roots(self) -> tuple[float, float, bool]:
        """Decay and circular frequency in 1/s, and whether it swings (or is damped so much that it does not)."""
        a = self.damping / (2 * self.mass)
        square = self.stiffness / self.mass - a * a
        return a, math.sqrt(abs(square)), square > 0
