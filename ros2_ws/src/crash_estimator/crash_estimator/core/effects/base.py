"""What a physical effect is: a name, a coefficient with its unit and limits, shape constants, and its physics.

Each kind below says where an effect acts and what its one function gets. An element's force is

    F = static (1 + c h(V)) + C V + sum of c_i f_i        where the element carries, 0 where it is apart

with the static force from its curve, `h` of a `StaticFactor` and `f` of an `ElementForce`. All functions take
whole records (arrays) and read the history, which is made once, causally, elsewhere.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np


class ElementMotion(NamedTuple):
    """One element's motion over g instants."""

    time: np.ndarray  # (g,) s since the impact
    crush: np.ndarray  # (g,) m, compression positive
    rate: np.ndarray  # (g,) m/s
    peak: np.ndarray  # (g,) m, largest crush so far, never below 0
    static: np.ndarray  # (g,) N, the force of the element's own curve


@dataclass(frozen=True)
class Shape:
    """A shape constant, found in the fit between two limits; it is searched from each of the starts."""

    unit: str
    low: float
    high: float
    starts: tuple[float, ...]
    of_crush: bool = False  # limits and starts are shares of the element's largest crush


@dataclass(frozen=True)
class Effect:
    """Common to all; `low` and `high` bound the coefficient physically."""

    name: str
    unit: str  # of the coefficient
    shapes: Mapping[str, Shape] = field(default_factory=dict)
    low: float = 0.0
    high: float = np.inf
    size: float | None = None  # order of magnitude of the coefficient; None: what carries half of the target's force


@dataclass(frozen=True)
class ElementForce(Effect):
    """A force in parallel to an element's own: c f, compression positive.

    force(motion: ElementMotion, **shape constants) -> (g,) N per unit of the coefficient
    """

    force: Callable[..., np.ndarray] | None = None
    of_crush_only: bool = False  # a function of the crush alone: a free curve of an elastic element contains it


@dataclass(frozen=True)
class StaticFactor(Effect):
    """A factor 1 + c h(V) on the static force.

    factor(rate (g,) m/s, **shape constants) -> (g,) h per unit of c;
    stated(c, **shape constants) -> the coefficient as the literature states it, and `unstated` back.
    """

    factor: Callable[..., np.ndarray] | None = None
    stated: Callable[..., float] = lambda c: c
    unstated: Callable[..., float] = lambda value: value


@dataclass(frozen=True)
class Gap(Effect):
    """The coefficient is a crush that passes before the element carries anything; no tension."""


@dataclass(frozen=True)
class UnloadingSlope(Effect):
    """The coefficient is the slope of the line on which the element unloads from its peak; no tension."""


@dataclass(frozen=True)
class PairSpring(Effect):
    """An element of its own between two bodies that are not joined: F = c X."""


@dataclass(frozen=True)
class BodyInertia(Effect):
    """The coefficient adds to a free body's mass."""


@dataclass(frozen=True)
class BodyForce(Effect):
    """An external force on a free body, positive in the travel direction.

    force(time (g,) s) -> (g,) N per unit of the coefficient
    """

    force: Callable[..., np.ndarray] | None = None


@dataclass(frozen=True)
class AttachedBody(Effect):
    """A body that the model has not got, moving as an unused acceleration channel shows; the coefficient: its mass."""


@dataclass(frozen=True)
class ChannelError(Effect):
    """How a channel differs from the true signal: recorded(t) = (1 + gain) true(t - delay) + offset."""

    role: str = ""  # delay, gain or offset
