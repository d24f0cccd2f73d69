"""Branches outside the vocabulary of any diagnosis here: the right answer to them is that nobody knows."""

from dataclasses import dataclass
from math import sqrt

from .branches import Branch, Z


@dataclass(frozen=True)
class Maxwell(Branch):
    """A spring k in series with a damper c (J. C. Maxwell 1867): dF/dt = k v - F k / c. Its time is c / k."""

    k: float
    c: float
    size = 1

    def force(self, x: float, v: float, z: Z, mode: int) -> float:
        return z[0]

    def flow(self, x: float, v: float, z: Z, mode: int) -> Z:
        return (self.k * v - z[0] * self.k / self.c,)


@dataclass(frozen=True)
class VentedGas(Branch):
    """A bag of gas, l long, of area a, with a hole: F = (p - p0) a while it is pressed.

    Isentropic: p = p0 (m / (1 - x / l))^1.4, m the share of the gas that is left; it leaves by dm/dt = -w sqrt(p / p0
    - 1) while p > p0 (the orifice of R. Wagner and others' airbags, incompressible as below a third of the speed of
    sound).
    """

    force_unit: float  # p0 a, N
    length: float
    w: float  # 1/s
    size = 1  # 1 - m

    def over(self, x: float, z: Z) -> float:
        room = max(1.0 - max(x, 0.0) / self.length, 0.02)
        return max((max(1.0 - z[0], 1e-3) / room) ** 1.4 - 1.0, 0.0)

    def force(self, x: float, v: float, z: Z, mode: int) -> float:
        return self.force_unit * self.over(x, z) if x > 0.0 else 0.0

    def flow(self, x: float, v: float, z: Z, mode: int) -> Z:
        return (self.w * sqrt(self.over(x, z)) if x > 0.0 else 0.0,)


@dataclass(frozen=True)
class Fracture(Branch):
    """F = k x until its crush reaches `at`; then it has broken and never carries again. Modes 1 whole, 0 broken."""

    k: float
    at: float
    elastic = True

    def start(self, v: float) -> int:
        return 1

    def force(self, x: float, v: float, z: Z, mode: int) -> float:
        return self.k * x if mode else 0.0

    def guards(self, x: float, v: float, z: Z, mode: int) -> Z:
        return (self.at - x,) if mode else ()

    def switched(self, guard: int, x: float, v: float, z: Z, mode: int) -> int:
        return 0


@dataclass(frozen=True)
class Rattle(Branch):
    """A joint with play: F = +- k d^1.5 (1 + b d') with d the depth beyond +- play / 2, never pulling.

    K. Hunt and F. Crossley, J. Appl. Mech. 42 (1975): the restitution of a blow at v is 1 - 2/3 b v, by the depth's
    rate d'. Modes: 0 loose, 1 pressed, -1 pressed at the other end.
    """

    k: float
    b: float
    play: float
    elastic = True

    def start(self, v: float) -> int:
        return 0

    def force(self, x: float, v: float, z: Z, mode: int) -> float:
        deep = mode * x - 0.5 * self.play
        return mode * self.k * deep**1.5 * max(1.0 + self.b * mode * v, 0.0) if mode and deep > 0.0 else 0.0

    def guards(self, x: float, v: float, z: Z, mode: int) -> Z:
        half = 0.5 * self.play
        return (mode * x - half,) if mode else (half - x, half + x)

    def switched(self, guard: int, x: float, v: float, z: Z, mode: int) -> int:
        return 0 if mode else (1, -1)[guard]
