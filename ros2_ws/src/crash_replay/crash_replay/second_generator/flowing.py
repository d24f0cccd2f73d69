"""Branches that flow: their force relaxes while the crush is held."""

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

    p = p0 (m / (1 - x / l))^n, m the share of the gas that is left, n 1.4 where no heat leaves it and 1 where it stays
    as warm as it was; it leaves by dm/dt = -w sqrt(p / p0 - 1) while p > p0 (the orifice of R. Wagner and others'
    airbags, incompressible as below a third of the speed of sound).
    """

    force_unit: float  # p0 a, N
    length: float
    w: float  # 1/s
    n: float = 1.4
    size = 1  # 1 - m

    def over(self, x: float, z: Z) -> float:
        room = max(1.0 - max(x, 0.0) / self.length, 0.02)
        return max((max(1.0 - z[0], 1e-3) / room) ** self.n - 1.0, 0.0)

    def force(self, x: float, v: float, z: Z, mode: int) -> float:
        return self.force_unit * self.over(x, z) if x > 0.0 else 0.0

    def flow(self, x: float, v: float, z: Z, mode: int) -> Z:
        return (self.w * sqrt(self.over(x, z)) if x > 0.0 else 0.0,)
