"""What a lumped model is made of: bodies, elements, effects; `structure` has the equations."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from crash_replay.fault import Fault


class ModelError(Fault):
    """The model is at fault, or does not fit the test; the message is one readable line.

    keys: where a model file has what is at fault, such as ("elements", "door_rib", "between").
    """

    def __init__(self, message: str, keys: tuple[str | int, ...] = ()):
        super().__init__(message)
        self.keys = keys


@dataclass(frozen=True)
class Body:
    """A lumped mass, a driven motion or a fixed wall."""

    name: str
    mass: float | None = None  # kg; only a free body needs one
    acceleration: tuple[str, ...] = ()  # channels; their mean is the body's acceleration
    driven: bool = False  # motion taken from its channels (forced displacement, thesis 6.4.1)
    fixed: bool = False
    force: str | None = None  # channel of the measured force on a fixed body
    noise: float | None = None  # standard deviation of its equation's error, m/s^2 or N; None: found from the data
    carried_by: str | None = None  # a driven body within another one, which feels what pushes it
    hangs: tuple[float, float] | None = None  # Hz, damping ratio: it hangs so on what its channels are of
    start: tuple[float, float] = (0.0, 0.0)  # m, m/s at time zero, where the test does not say
    starts_faster: float = 0.0  # share of its initial velocity, by an effect
    applied: str | None = None  # channel of a measured force on a free body, positive in the direction of travel
    displacement: str | None = None  # channel of a free body's displacement, instead of or beside its acceleration
    velocity: str | None = None  # channel of its velocity, likewise
    derived: bool = False  # its acceleration is `derived_motion`'s, and no measurement
    velocity_std: float = 0.0  # m/s, standard deviation of its initial velocity

    @property
    def free(self) -> bool:
        return not (self.driven or self.fixed)

    @property
    def motion_channel(self) -> str | None:
        """What it is observed by beside its acceleration."""
        return self.displacement or self.velocity

    @property
    def is_measured(self) -> bool:
        """Whether a channel of the test shows how it moves; where none does, momentum says it (`momentum`)."""
        return bool(self.motion_channel or (self.acceleration and not self.derived))

    @property
    def starts_as_observed(self) -> bool:
        """Whether its own displacement or velocity says how it starts."""
        return self.derived and bool(self.motion_channel)


@dataclass(frozen=True)
class Coefficient:
    """A stiffness (N/m) or damping (N s/m): known, or estimated from an initial value."""

    value: float = 0.0  # the known value, or the initial one
    estimated: bool = False
    std: float | None = None  # of the initial value; None: as large as the value's order of magnitude
    min: float = -np.inf
    max: float = np.inf
    drift: float | None = None  # relative random walk per e-fold of crush; None: by shape
    shape: str = "curve"  # structured fit: "curve" = F(X) free in crush, "constant" = one K


@dataclass(frozen=True)
class Term:
    """One more power of the crush or of its rate in an element's force (equation 4.1): coefficient sign(u) |u|^power.

    u is X or V. The sign makes even powers pull in tension and take energy in both directions, as the odd ones do.
    """

    of: str  # "crush" or "rate"
    power: int  # 2 or more
    coefficient: Coefficient  # N/m^power, or N (s/m)^power


NOTHING, SPRINGS, ALL = "nothing", "springs", "all"
"""What acts beside a spring that is spent, as long as there is crush: nothing, as of a crushed structure that stays
short; elastic forces, functions of the crush alone; or all, dampers too, as in models of lumped masses."""


def outlasts(acts_when_spent: str, of_crush_only: bool = False) -> bool:
    """Whether a force beside the spring acts on where that is spent."""
    return acts_when_spent == ALL or (of_crush_only and acts_when_spent == SPRINGS)


@dataclass(frozen=True)
class Element:
    """A spring and damper between two bodies."""

    name: str
    between: tuple[str, str]
    stiffness: Coefficient
    damping: Coefficient = Coefficient()
    tension: bool = True  # False: carries compression only
    unloading: float | None = None  # known unloading stiffness, N/m; None: elastic
    displacement: str | None = None  # channel of the crush, instead of integrating accelerations
    velocity: str | None = None  # channel of the rate of crush; None: the crush's derivative
    terms: tuple[Term, ...] = ()  # powers beyond the first
    damper_pulls: bool = True  # without tension: the damper may pull until the spring is spent; False: never
    acts_when_spent: str = NOTHING  # what still does where the unloading line has come down to zero
    unloading_slope: Coefficient | None = None  # an unloading stiffness to be estimated, in place of a known one
    origin: float = 0.0  # m: the crush counts from here, as beyond a gap
    play: float = 0.0  # m: to either side it carries nothing, and its crush counts from there
    factor: Callable[[np.ndarray], np.ndarray] | None = None  # of the rates (n,) m/s: what multiplies the static force

    @property
    def has_spring(self) -> bool:
        return bool(self.stiffness.estimated or self.stiffness.value or self.terms)

    @property
    def unloads(self) -> bool:
        """On a line of its own."""
        return bool(self.unloading or self.unloading_slope)


@dataclass(frozen=True)
class EffectSpec:
    """A physical effect beside the springs and dampers; types and what they need are in `core.effects`."""

    type: str
    target: str  # element, body or channel; "body_a-body_b" for a load path
    coefficient: float | None = None  # where it starts; None: found from the data
    shape: Mapping[str, float] = field(default_factory=dict)  # shape constants, likewise
    host: str | None = None  # unmodelled_body: the body that feels its inertia
    touches: str | None = None  # unmodelled_body: the body that it pushes by a curve of its own
    taken_from: str | None = None  # unmodelled_body: the body whose mass it was counted in
    variant: str = ""  # one of the effect's `variants`


@dataclass(frozen=True)
class Action:
    """An effect that no element or body has a place for; `core.effects.applied` makes them, `core.actions` acts.

    force gives, by kind: element, N of an ElementMotion (g,); memory, what `RememberingForce` says; factor, h of the
    rate (g,); body, N of the time (g,) s.
    """

    name: str  # of its parameter, such as door_rib.coulomb_friction
    unit: str
    kind: str  # element, memory, factor, body, inertia, mass, gain or offset
    at: int  # the element, or the body: of "inertia" the one that feels it
    coefficient: Coefficient
    scale: float  # order of magnitude of the coefficient
    force: Callable | None = None
    body: int = -1  # inertia: whose
    lighter: int = -1  # inertia: the body whose mass it was counted in, -1: none
    share: float = 1.0  # gain, offset: of the channel in its body's acceleration
    of_crush_only: bool = False  # element: a function of the crush alone
    in_curve: bool = False  # element: it belongs to the spring's own curve, and unloads along the spring's line

    def outlasts(self, element: Element) -> bool:
        """Whether it acts on where the element's spring is spent."""
        return outlasts(element.acts_when_spent, self.of_crush_only)

    @property
    def element(self) -> int:
        """The element that it acts on; -1: none."""
        return self.at if self.kind in ("element", "memory", "factor") else -1


@dataclass(frozen=True)
class Parameter:
    """One entry of theta: a coefficient with its name, unit and scale."""

    name: str
    unit: str
    element: int  # -1: of no element
    is_stiffness: bool
    coefficient: Coefficient
    scale: float  # order of magnitude, for the initial standard deviation
    power: int = 1  # of the crush or rate
    is_unloading: bool = False  # the slope of the unloading line
