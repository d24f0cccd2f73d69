"""Force laws of elements: what an element carries at a crush, a rate and a largest crush so far.

Crush X in m and rate V in m/s, compression positive; force F in N, compression positive. A law is any
callable of that kind, so an effect to be added is one small function, for instance

    def coulomb_friction(force, speed):
        return lambda crush, rate, peak: force * tanh(rate / speed) if crush > 0.0 else 0.0
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf

from .curves import Curve

Law = Callable[[float, float, float], float]
"""(crush X, rate V, largest crush so far, never below 0) -> force F."""


@dataclass(frozen=True)
class Slip:
    """A force beside the spring with a memory s of its own, force times s, that follows ds/dt = flow(s, X, V)."""

    force: float  # N; N/m where s is a crush
    flow: Callable[[float, float, float], float]  # (s, crush m, rate m/s) -> ds/dt
    largest: float = inf  # |s| at which it yields, of which no step goes beyond
    both_ways: bool = True  # False: it lets go where the element is apart, and stays as it was


@dataclass(frozen=True)
class Spring:
    """A spring given by its secant stiffness K:  F = K(|X|) X  while it loads.

    An elastic one comes back on the same curve. One with an unloading slope Ku has been crushed for
    good: from its largest crush Xp it comes down, and goes up again, on the line

        F = K(Xp) Xp - Ku (Xp - X),   F >= 0,

    and carries nothing beyond; nor does it pull. Ku below a secant stiffness would leave a force at no
    crush, and is refused.
    """

    stiffness: Curve  # N/m over m
    unloading: float | None = None  # N/m
    tension: bool = True  # False: carries compression only

    def __post_init__(self):
        if self.unloading is not None and self.unloading < max(self.stiffness.y):
            raise ValueError(
                f"the unloading slope must be at least the largest stiffness {max(self.stiffness.y):g} N/m, "
                f"got {self.unloading:g}"
            )

    def __call__(self, crush: float, rate: float, peak: float) -> float:
        if self.unloading is not None and crush < peak:
            return max(0.0, self.stiffness(peak) * peak - self.unloading * (peak - crush))
        if crush <= 0.0 and not (self.tension and self.unloading is None):
            return 0.0
        return self.stiffness(abs(crush)) * crush
