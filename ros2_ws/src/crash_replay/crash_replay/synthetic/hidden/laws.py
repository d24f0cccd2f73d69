"""What an element carries, with or without a hidden effect; crush X in m, rate V in m/s, compression positive.

    F = S(X - gap) (1 + (V / D)^(1/q)  while V > 0) + C V + sum of parallel forces,     0 while apart

S is the static force: its curve while it loads; from the peak crush down a line of slope `unloading`, where there
is one. An element is apart where it carries no tension and its static force has come down to nothing.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import sqrt, tanh
from typing import Any

from ..curves import Curve

Parallel = Callable[[float, float], float]
"""(crush, rate) -> N, beside the static force."""


@dataclass(frozen=True)
class Carrier:
    """One element's law."""

    curve: Curve  # static force N over crush m, from 0 on; odd below where tension is carried
    tension: bool = True
    unloading: float | None = None  # N/m; None: elastic
    damping: float = 0.0  # N s/m
    gap: float = 0.0  # m
    hardening: tuple[float, float] | None = None  # D in m/s, q
    parallel: tuple[Parallel, ...] = ()

    def static(self, crush: float, rate: float, peak: float) -> float:
        """N; the rate does not matter."""
        crush, peak = crush - self.gap, max(peak - self.gap, 0.0)
        if self.unloading is not None and crush < peak:
            return max(0.0, self.curve(peak) - self.unloading * (peak - crush))
        if crush < 0.0:
            return -self.curve(-crush) if self.tension else 0.0
        return self.curve(crush)

    def described(self) -> dict[str, Any]:
        """For the truth file; the parallel forces are in its list of what is hidden."""
        found: dict[str, Any] = {
            "force": {"crush": list(self.curve.x), "value": list(self.curve.y)},
            "tension": self.tension and self.unloading is None,
            "damping": self.damping,
        }
        if self.unloading is not None:
            found["unloading"] = self.unloading
        if self.gap:
            found["gap"] = self.gap
        if self.hardening:
            found["hardening"] = {"doubling_rate": self.hardening[0], "exponent": self.hardening[1]}
        return found

    def __call__(self, crush: float, rate: float, peak: float) -> float:
        force = self.static(crush, rate, peak)
        if force == 0.0 and (crush < peak or crush < self.gap):
            return 0.0
        if self.hardening and rate > 0.0:
            doubling, exponent = self.hardening
            force *= 1.0 + (rate / doubling) ** (1.0 / exponent)
        force += self.damping * rate
        for law in self.parallel:
            force += law(crush, rate)
        return force


Flow = Callable[[float, float, float], float]
"""Of what a slip remembers: s, crush m, rate m/s -> ds/dt."""


def bouc_wen(crush: float, sharpness: float) -> Flow:
    """ds/dt = V (1 - |s|^n) / X_y while it yields further, V / X_y on the way back (Wen 1976, A = 1, beta = gamma)."""
    return lambda s, _, rate: rate / crush * (1.0 - abs(s) ** sharpness if s * rate > 0.0 else 1.0)


def two_sliders(crush: float, share: float) -> Flow:
    """Two dry sliders behind springs, one that gives way early (Iwan 1966), as one curve of three straight parts:
    up to `share` of the force the spring of both, then that of the second alone."""
    early, late = 2.0 / crush, 2.0 * (1.0 - share) / (crush * (2.0 - share))
    return lambda s, _, rate: rate * (early if s * rate <= 0.0 or abs(s) < share else late if abs(s) < 1.0 else 0.0)


def maxwell(relaxes: float) -> Flow:
    """ds/dt = V - s / T: the crush of a spring whose other end a damper lets go (Maxwell 1867)."""
    return lambda s, _, rate: rate - s / relaxes


def vented_gas(length: float, leak: float) -> Flow:
    """ds/dt = 1.4 (1 + s) (V / (L - X) - w sqrt(s) / m) of the overpressure s, with m = (1 - X / L) (1 + s)^(5/7) of
    the gas left; what a step takes too much of it is let in again."""

    def flow(s: float, crush: float, rate: float) -> float:
        room = 1.0 - max(crush, 0.0) / length
        pressed = rate / (length * room) if crush > 0.0 else 0.0
        if s <= 0.0:
            return max(1.4 * pressed, 0.0) - 1000.0 * s
        return 1.4 * (1.0 + s) * (pressed - leak * sqrt(s) / (room * (1.0 + s) ** (5.0 / 7.0)))

    return flow


def quadratic_damping(c: float) -> Parallel:
    return lambda crush, rate: c * rate * abs(rate)


def coulomb_friction(c: float, speed: float) -> Parallel:
    return lambda crush, rate: c * tanh(rate / speed)


def cubic_stiffness(c: float) -> Parallel:
    return lambda crush, rate: c * crush**3


def yielding(c: float, yield_crush: float) -> Parallel:
    return lambda crush, rate: -c * (crush - yield_crush) if crush > yield_crush else 0.0


def bottoming_out(c: float, stop: float) -> Parallel:
    return lambda crush, rate: c * (crush - stop) if crush > stop else 0.0
