"""How a crushed structure's force grows with the rate v of its crush, v > 0: factors on the static force."""

from dataclasses import dataclass
from math import log


@dataclass(frozen=True)
class CowperSymonds:
    """1 + (v / d)^(1 / q) (G. Cowper, P. Symonds, Brown University Report 28, 1957)."""

    d: float
    q: float

    def factor(self, v: float) -> float:
        return 1.0 + (v / self.d) ** (1.0 / self.q)


@dataclass(frozen=True)
class Power:
    """(1 + v / r)^n, the power law of crush tests (as of P. Prasad, A. Padgaonkar, SAE 810475) without its zero at
    rest."""

    r: float
    n: float

    def factor(self, v: float) -> float:
        return (1.0 + v / self.r) ** self.n


@dataclass(frozen=True)
class Logarithmic:
    """1 + c ln(v / v0) beyond v0 (G. Johnson, W. Cook 1983)."""

    c: float
    v0: float

    def factor(self, v: float) -> float:
        return 1.0 + self.c * log(v / self.v0) if v > self.v0 else 1.0
