"""What a layout's parameters belong to: terms (an addition with its parameters) and links, which carry a force."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...effects.effect import Addition, Effect, ElementMotion
from ...effects.kinds.element_force import OF_THE_CURVE, PLASTIC
from ...structure_parts import NOTHING, outlasts
from .free_curve import Curve

LOG_STEP = 1e-5
"""Of the logarithm of a shape constant: a difference to one side errs by about as large a share of the derivative. With
1e-4 one bag's fits ended elsewhere than with central differences, with this they do not."""


class Term(NamedTuple):
    """An addition, and where its parameters are."""

    addition: Addition
    coefficient: int
    shapes: dict[str, int]

    def shapes_at(self, theta: np.ndarray, longer: str = "") -> dict[str, float]:
        """Its shape constants, the logarithm of one of them longer by a step."""
        return {name: float(np.exp(theta[p] + LOG_STEP * (name == longer))) for name, p in self.shapes.items()}

    def along(self, motion: ElementMotion, theta: np.ndarray) -> np.ndarray:
        """(g,) what its effect's function gives along a motion."""
        return self.addition.effect.along(motion, **self.shapes_at(theta))

    def by_shapes(self, theta: np.ndarray, value: np.ndarray, function: Callable[..., np.ndarray]) -> list[np.ndarray]:
        """Derivatives of function(**shapes), whose value is known, by the logarithm of each."""
        return [(function(**self.shapes_at(theta, name)) - value) / LOG_STEP for name in self.shapes]


@dataclass(frozen=True)
class Link:
    """Something that carries a force: an element, or a load path. Numbers are parameters', None where there is none."""

    name: str
    ends: tuple[int, int]
    crush_ends: tuple[int, int]  # -1, -1: measured
    tension: bool
    damper_pulls: bool = True  # without tension: a force beside the spring's may be negative while that one is positive
    acts_when_spent: str = NOTHING  # beside a spring whose unloading line has come down to zero
    curve: Curve | None = None
    constant: int | None = None
    gap: int | None = None  # logarithm of m, before it carries
    known_stiffness: float = 0.0
    damping: int | None = None
    known_damping: float = 0.0
    unloading: float | None = None  # known slope
    origin: tuple[float, ...] = ()  # crush at time zero in each recording, where it counts from there
    displacement: str | None = None
    velocity: str | None = None
    terms: tuple[Term, ...] = ()  # of effects that act on it

    def outlasts(self, effect: Effect) -> bool:
        """Whether its force acts on where the spring is spent."""
        return outlasts(self.acts_when_spent, effect.of_crush_only)

    @cached_property
    def parallel(self) -> tuple[Term, ...]:
        """Forces beside the spring."""
        return tuple(t for t in self.terms if t.addition.effect.in_parallel and t.addition.variant not in OF_THE_CURVE)

    @cached_property
    def in_curve(self) -> tuple[Term, ...]:
        """Functions of the crush that belong to the spring's own curve."""
        return tuple(t for t in self.terms if t.addition.effect.in_parallel and t.addition.variant in OF_THE_CURVE)

    @cached_property
    def plastic(self) -> bool:
        """From its peak it unloads as stiff as it is before any of those."""
        return any(term.addition.variant == PLASTIC for term in self.in_curve)

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
