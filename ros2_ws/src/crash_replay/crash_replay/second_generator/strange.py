"""Branches outside the vocabulary of any diagnosis here: the right answer to them is that nobody knows."""

from dataclasses import dataclass

from .branches import Branch, Z


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
