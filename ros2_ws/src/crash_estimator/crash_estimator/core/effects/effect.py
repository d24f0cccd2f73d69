"""What a physical effect is, and what each kind of effect says of itself; the kinds are in `kinds`, a file each.

An effect has a name, a coefficient with its unit and limits, and shape constants. Its kind says what it acts on, what
it adds to the equations of motion, how an estimator and a free run take it, and how a diagnosis searches for it.
Nothing outside a kind's own file asks which kind an effect is of: what differs is a method or a constant below.

An element's force is

    F = static (1 + c h(V)) + C V + sum of c_i f_i        where the element carries, 0 where it is apart

with the static force from its curve, `h` of a `StaticFactor` and `f` of an `ElementForce`. All functions take
whole records (arrays) and read the history, which is made once, causally, elsewhere.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, ClassVar, NamedTuple, Protocol

import numpy as np

from crash_replay.recording import Test

from ..structure import EffectSpec, ModelError, Structure

if TYPE_CHECKING:  # of the diagnosis, which is built upon the effects
    from ..diagnosis.mechanics.spring import Law
    from ..diagnosis.parameterization.magnitudes import Magnitudes


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
    both_ways: bool = False  # or of its largest extension, if that is larger and it has tension
    no_usual: bool = False  # nothing is usual for it: an estimator has to be given it
    of_rate: bool = False  # where its largest rate of crush is below 5 m/s, less in proportion


class OwnLink(NamedTuple):
    """Of an effect's own, between two bodies: a spring, F = c X, or else a force as beside an element's."""

    ends: tuple[int, int]
    tension: bool
    origin: tuple[float, ...]  # m, crush at time zero in each recording where it counts from there; else empty
    spring: bool = True


@dataclass(frozen=True)
class Effect:
    """Common to all; `low` and `high` bound the coefficient physically."""

    name: str
    unit: str  # of the coefficient
    shapes: Mapping[str, Shape] = field(default_factory=dict)
    low: float = 0.0
    high: float = np.inf
    size: float | None = None  # order of magnitude of the coefficient; None: what carries half of the target's force
    of_crush_only: bool = False  # its force is a function of the crush alone
    of_rate_only: bool = False  # or of the rate
    rare: bool = False  # looked for only where the others leave more than noise, or take several to leave it
    forms: Mapping[str, Sequence[str]] = field(default_factory=dict)
    """Name of a form of its law -> names of its shape constants, where it has several; all but the first are rare."""

    # What it acts on
    acts_on: ClassVar[str] = "element"  # the key of a model file: element, body, channel or between
    function: ClassVar[str] = ""  # the field that holds its physics, where a user may write an effect of the kind

    # Its place in an element's force
    in_parallel: ClassVar[bool] = False  # c f(motion) beside the spring
    scales_static: ClassVar[bool] = False  # 1 + c h(V) times the spring
    remembers: ClassVar[bool] = False  # c z beside the spring, z hangs on the way that the crush has gone
    changes_law: ClassVar[bool] = False  # a constant of the spring's law itself, in which the force is not linear

    # Its place in the rest of the model
    balances_momentum: ClassVar[bool] = False  # it changes what masses and forces must add up to
    on_ground: ClassVar[bool] = False  # its link's other end
    changes_start: ClassVar[bool] = False  # bodies start faster than the test says

    # How a diagnosis searches for it
    profiled: ClassVar[bool] = False  # its coefficient says when a force jumps to zero: the cost has a V over it
    restated: ClassVar[bool] = False  # the literature states the coefficient otherwise than it is fitted

    @property
    def distorts(self) -> str:
        """What it makes wrong of a channel: delay, gain or offset."""
        return ""

    def channels(self, structure: Structure, target: str) -> Sequence[str]:
        """Those that it makes wrong, where it makes any."""
        return (target,)

    def target_key(self, variant: str) -> str:
        """What it acts on in one of its variants, as a model file says it."""
        return self.acts_on

    def replaces(self, variant: str) -> str:
        """The element's key in a model file that it takes the place of, where it takes any."""
        return ""

    def attaches_body(self, variant: str) -> bool:
        """Whether it brings a further body, driven by the channel that is the target."""
        return False

    @property
    def only_distorts(self) -> bool:
        """With the channels mended nothing is left of it."""
        return bool(self.distorts) and self.acts_on == "channel"

    @property
    def variants(self) -> tuple[str, ...]:
        """Ways in which it may act on one target."""
        return tuple(self.forms) or ("",)

    def possible_targets(self, structure: Structure, test: Test | None) -> list[str] | None:
        """All that it can act on; None: any channel that the model does not use, of a test that is not known."""
        return [element.name for element in structure.elements]

    def refuse(self, structure: Structure, spec: EffectSpec) -> None:
        """Raises ModelError, one line, where a model's entry cannot be meant as it is written."""

    def stated_limits(self) -> tuple[float, float]:
        """Of the coefficient as a model file states it."""
        return self.low, self.high

    def shapes_of(self, variant: str) -> Mapping[str, Shape]:
        """The shape constants that it has in one of its variants."""
        return {name: self.shapes[name] for name in self.forms[variant]} if self.forms else self.shapes

    def along(self, motion: ElementMotion, **shapes: float) -> np.ndarray:
        """(g,) What its function gives along a motion."""
        return getattr(self, self.function)(motion, **shapes)

    def common(self) -> "Effect | None":
        """What of it is looked for first: all of it, or None of a rare one; of several forms it may be some."""
        if self.rare or len(self.forms) < 2:
            return None if self.rare else self
        return replace(self, forms=dict(list(self.forms.items())[:1]))

    def without(self, common: "Effect | None") -> "Effect | None":
        """What of it is looked for last: it in the forms that `common`, what is looked for first, has not; or None."""
        if common is None or not self.forms:
            return None if common else self
        forms = {name: shapes for name, shapes in self.forms.items() if name not in common.forms}
        return replace(self, forms=forms, rare=True) if forms else None

    def as_common(self, variant: str) -> "Effect":
        """The same, with what acts in this variant looked for first."""
        forms = {variant: self.forms[variant]} | dict(self.forms) if self.forms else self.forms
        return replace(self, rare=False, forms=forms)

    def put_to_work(self, structure: Structure, test: Test, spec: EffectSpec) -> Structure:
        """The structure as estimators and free runs take it: with this effect in its elements, masses or actions.

        Raises ModelError where a constant is not given that no estimator can follow.
        """
        raise ModelError(f"effect {self.name} is of a kind that estimators cannot take: {type(self).__name__}")

    # --- the motion of a diagnosis: `law` and its like are of `core.diagnosis.mechanics`

    def takes_tension_away(self, variant: str) -> bool:
        """Whether an element that has it carries compression only."""
        return False

    def changed_law(self, law: "Law", c: float, variant: str) -> "Law":
        """The spring's law with the coefficient c in it."""
        return law

    def law_derivative(
        self, side: np.ndarray | float, on_line: np.ndarray, lag: np.ndarray, kx: np.ndarray, kp: np.ndarray
    ) -> np.ndarray | None:
        """(g,) of the spring's force by the coefficient in its law; None where it has none there.

        side (g,): -1 at the far side of a play, else 1; on_line (g,): on the unloading line; lag (g,) m: crush less its
        peak, times what scales the spring's force, 0 where apart; kx, kp (g,) N/m: slopes by crush and peak.
        """
        return None

    def own_link(
        self, addition: "Addition", structure: Structure, index: Mapping[str, int], starts: Sequence[np.ndarray]
    ) -> OwnLink | None:
        """A link of its own; index: of the bodies, the ground's too; starts: displacement (b,) m of the bodies at time
        zero of each recording."""
        return None

    def mass_shares(self, addition: "Addition") -> Mapping[str, float]:
        """kg that bodies are heavier by for one unit of the coefficient."""
        return {}

    def body_load(
        self, addition: "Addition", structure: Structure, time: np.ndarray, inertial: Callable[[str], np.ndarray],
        **shapes: float,
    ) -> tuple[str, np.ndarray] | None:  # fmt: skip
        """A body, and the force (g,) N on it for one unit; inertial(channel): acceleration (g,) of an attached body."""
        return None

    def start_velocity(self, target: str, index: Mapping[str, int], velocity: np.ndarray) -> np.ndarray:
        """(b,) m/s by which bodies start faster for one unit, of their stated velocities (b,)."""
        raise TypeError(f"effect {self.name} is of a kind that changes no start: {type(self).__name__}")

    def course(self, variant: str, time: np.ndarray) -> np.ndarray:
        """(g,) of what it adds to a channel, for one unit; time (g,): s since the impact."""
        raise TypeError(f"effect {self.name} is of a kind that adds nothing to a channel: {type(self).__name__}")

    # --- the search of a diagnosis

    def candidates(self, structure: Structure, magnitudes: "Magnitudes") -> Iterator["Addition"]:
        """All admissible additions, several on one target where the search has several starts."""
        yield from ()

    def prior_std(self, magnitudes: "Magnitudes", addition: "Addition") -> float:
        """Prior standard deviation of the coefficient, where `size` does not state it."""
        raise TypeError(f"effect {self.name} is of a kind without an order of magnitude: {type(self).__name__}")

    def limits(self, magnitudes: "Magnitudes", addition: "Addition") -> tuple[float, float]:
        """Least and largest coefficient that a fit admits."""
        return self.low, self.high

    def extensions(self, structure: Structure, addition: "Addition") -> list["Addition"]:
        """The addition with further free parameters, which are tried once it is a candidate."""
        return []

    def log_prior_odds_against(self, structure: Structure, c: float) -> float:
        """Nats that it must gain with the coefficient c over others, where no measurement can tell them apart."""
        return 0.0

    def is_doubt(
        self, magnitudes: "Magnitudes", addition: "Addition", c: float, shapes: Mapping[str, float], fitted: "Fitted"
    ) -> bool:  # fmt: skip
        """Whether it is no more, with the coefficient and shape constants found, than what is not known of a right
        model anyway, or than what another effect is named for, or than physics allows; fitted: the model with it."""
        return False

    def stated(self, c: float, **shapes: float) -> float:
        """The coefficient as the literature states it."""
        return c

    def unstated(self, value: float, **shapes: float) -> float:
        """The coefficient as it is fitted."""
        return value


class Fitted(Protocol):
    """A model as it was fitted."""

    def largest_force(self, element: str) -> float:
        """N, pushing or pulling."""

    def constant_stiffness(self, element: str) -> float | None:
        """N/m; None where it is a function of the crush."""


@dataclass(frozen=True)
class Addition:
    """An effect on a target: what is added to a structure."""

    effect: Effect
    target: str
    shapes: Mapping[str, float] = field(default_factory=dict)  # where the search starts, absolute
    coefficient: float | None = None  # likewise
    host: str | None = None  # unmodelled_body: the body that feels its inertia
    touches: str | None = None  # unmodelled_body: the body that it pushes by a free curve
    taken_from: str | None = None  # unmodelled_body: the free body whose mass it was counted in
    variant: str = ""  # one of the effect's `variants`
    recording: str = ""  # identifier of the one test that it acts in; "": in all

    @property
    def key(self) -> tuple[str, str]:
        return self.effect.name, self.target

    @property
    def attaches_body(self) -> bool:
        return self.effect.attaches_body(self.variant)

    def spec(self, coefficient: float | None = None, shape: Mapping[str, float] | None = None) -> EffectSpec:
        """As a model file says it; without a coefficient that and the shape constants are found from the data."""
        beside = self.host, self.touches, self.taken_from, self.variant
        return EffectSpec(*self.key, coefficient, dict(shape or {}), *beside)
