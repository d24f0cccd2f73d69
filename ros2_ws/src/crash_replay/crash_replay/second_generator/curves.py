"""Force over crush of what is crushed, N over m, for crush >= 0. Where a curve has a kink it says so in `breaks`."""

from dataclasses import dataclass
from math import exp, sin, tau
from typing import Protocol


class Curve(Protocol):
    @property
    def breaks(self) -> tuple[float, ...]: ...

    def force(self, u: float) -> float: ...


@dataclass(frozen=True)
class Straight:
    """F = k u."""

    k: float
    breaks: tuple[float, ...] = ()

    def force(self, u: float) -> float:
        return self.k * u


@dataclass(frozen=True)
class Bilinear:
    """F = k u to the knee, k knee + h (u - knee) beyond it: a rail before and after it buckles."""

    k: float
    knee: float
    h: float

    @property
    def breaks(self) -> tuple[float, ...]:
        return (self.knee,)

    def force(self, u: float) -> float:
        return self.k * u if u <= self.knee else self.k * self.knee + self.h * (u - self.knee)


@dataclass(frozen=True)
class Progressive:
    """F = k u (1 + h u / d): padding that densifies."""

    k: float
    h: float
    d: float
    breaks: tuple[float, ...] = ()

    def force(self, u: float) -> float:
        return self.k * u * (1.0 + self.h * u / self.d)


@dataclass(frozen=True)
class Plateau:
    """F = p (1 - exp(-k u / p)) + h u: foam or honeycomb that crushes at a plateau p from an initial stiffness k."""

    k: float
    p: float
    h: float
    breaks: tuple[float, ...] = ()

    def force(self, u: float) -> float:
        return self.p * (1.0 - exp(-self.k * u / self.p)) + self.h * u


@dataclass(frozen=True)
class Stop:
    """F = k (u - at)^power beyond `at`: a bump stop; power 1.5 is Hertz's contact of round bodies (1881)."""

    at: float
    k: float
    power: float = 1.0

    @property
    def breaks(self) -> tuple[float, ...]:
        return (self.at,)

    def force(self, u: float) -> float:
        return self.k * (u - self.at) ** self.power if u > self.at else 0.0


@dataclass(frozen=True)
class Cubic:
    """F = k3 u^3, Duffing's hardening spring (1918)."""

    k3: float
    breaks: tuple[float, ...] = ()

    def force(self, u: float) -> float:
        return self.k3 * u**3


@dataclass(frozen=True)
class Limited:
    """F = min(f(u), p): a belt's force limiter, a rail that folds at a constant force; f is monotonic, and reaches p at
    `at`."""

    under: Curve
    p: float
    at: float

    @property
    def breaks(self) -> tuple[float, ...]:
        return (*(b for b in self.under.breaks if b < self.at), self.at)

    def force(self, u: float) -> float:
        return self.under.force(u) if u <= self.at else self.p


@dataclass(frozen=True)
class Folding:
    """F = f(u) (1 + a sin(2 pi u / w)): each fold of a tube, w long, gives a peak and a valley (Alexander 1960)."""

    under: Curve
    a: float
    w: float

    @property
    def breaks(self) -> tuple[float, ...]:
        return self.under.breaks

    def force(self, u: float) -> float:
        return self.under.force(u) * (1.0 + self.a * sin(tau * u / self.w))


@dataclass(frozen=True)
class Sum:
    """Curves beside one another that are crushed, and unload, as one."""

    parts: tuple[Curve, ...]

    @property
    def breaks(self) -> tuple[float, ...]:
        return tuple(sorted(b for part in self.parts for b in part.breaks))

    def force(self, u: float) -> float:
        return sum(part.force(u) for part in self.parts)
