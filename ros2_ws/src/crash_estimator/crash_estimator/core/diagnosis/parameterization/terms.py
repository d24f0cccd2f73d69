"""What a layout's parameters belong to: terms (an addition with its parameters) and links, which carry a force."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from ...effects.effect import Addition
from .free_curve import Curve


class Term(NamedTuple):
    """An addition, and where its parameters are."""

    addition: Addition
    coefficient: int
    shapes: dict[str, int]


@dataclass(frozen=True)
class Link:
    """Something that carries a force: an element, or a load path. Numbers are parameters', None where there is none."""

    name: str
    ends: tuple[int, int]
    crush_ends: tuple[int, int]  # -1, -1: measured
    tension: bool
    damper_pulls: bool = True  # without tension: a force beside the spring's may be negative while that one is positive
    curve: Curve | None = None
    constant: int | None = None
    known_stiffness: float = 0.0
    damping: int | None = None
    known_damping: float = 0.0
    unloading: float | None = None  # known slope
    origin: tuple[float, ...] = ()  # crush at time zero in each recording, where it counts from there
    displacement: str | None = None
    velocity: str | None = None
    terms: tuple[Term, ...] = ()  # of effects that act on it

    @cached_property
    def parallel(self) -> tuple[Term, ...]:
        """Forces beside the spring."""
        return tuple(term for term in self.terms if term.addition.effect.in_parallel)

    @cached_property
    def remembering(self) -> tuple[Term, ...]:
        """Forces beside the spring that hang on the way its crush has gone."""
        return tuple(term for term in self.terms if term.addition.effect.remembers)

    @cached_property
    def factors(self) -> tuple[Term, ...]:
        """Factors on the spring's force."""
        return tuple(term for term in self.terms if term.addition.effect.scales_static)

    @cached_property
    def in_law(self) -> tuple[Term, ...]:
        """Constants of the spring's law itself."""
        return tuple(term for term in self.terms if term.addition.effect.changes_law)
