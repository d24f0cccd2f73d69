"""Who is on stage: the test, and what each estimator calls its parameters, equations, elements and bodies.

The layout and every drawing follow from the cast alone, so that several models and methods come side by
side: what has the same name shares a plot, and each estimator keeps its colour everywhere. When its model is changed,
the newest revision has that colour and stands in front; those before it fade.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..core.estimate import ParameterStatus
from .blocks import ForceBlock, ParameterBlock, ResidualBlock, TestBlock, estimator_of, revision_of
from .colors import ESTIMATOR_COLORS, Color, faded
from .units import Shown, shown

Range = tuple[float, float]

LIGHT = 10.0
"""kg: where no body is heavier, a kN is far too much."""


class Member(NamedTuple):
    """The names of one estimator, or of one revision of its model."""

    name: str
    model: str
    method: str
    parameters: tuple[tuple[str, str], ...]  # (name, unit) of those that are estimated
    equations: tuple[tuple[str, str], ...]  # (name, unit)
    elements: tuple[str, ...]
    between: tuple[tuple[str, str], ...]
    bodies: tuple[str, ...]
    masses: tuple[float | None, ...]  # kg, None where the model gives none (driven, fixed)
    besides: tuple[tuple[str, str], ...] = ()  # (name, unit) of what the method knows besides the parameters


def member(parameters: ParameterBlock, residuals: ResidualBlock, forces: ForceBlock) -> Member:
    """An estimator's names from its first block of each kind."""
    status = parameters.status[0]
    estimated = (~np.isin(status, (ParameterStatus.KNOWN, ParameterStatus.METHOD))).tolist()
    pairs = list(zip(parameters.name, parameters.unit))
    return Member(
        name=parameters.estimator,
        model=parameters.model,
        method=parameters.method,
        parameters=tuple(pair for pair, shown in zip(pairs, estimated, strict=True) if shown),
        equations=tuple(zip(residuals.name, residuals.unit)),
        elements=forces.element,
        between=tuple(_ends(between, forces.body) for between in forces.between),
        bodies=forces.body,
        masses=tuple(None if np.isnan(mass) else float(mass) for mass in forces.mass),
        besides=tuple(pair for pair, own in zip(pairs, status == ParameterStatus.METHOD, strict=True) if own),
    )


def _ends(between: str, bodies: tuple[str, ...]) -> tuple[str, str]:
    """The two bodies of "body_a-body_b", where a name may contain a hyphen itself."""
    for a in bodies:
        b = between[len(a) + 1 :]
        if between == f"{a}-{b}" and b in bodies:
            return a, b
    raise ValueError(f"element between {between!r}: expected two of the bodies {', '.join(bodies)} joined by '-'")


@dataclass(frozen=True)
class Cast:
    """The test and the estimators that follow it."""

    test: TestBlock
    span: tuple[float, float]  # s, first and last sample of the recording
    members: tuple[Member, ...] = ()
    rankings: tuple[int, ...] = ()  # revisions of the model that a ranking of missing effects has come of
    outputs: tuple[tuple[str, str], ...] = ()  # (name, unit) of what the diagnosis compares
    judged: tuple[str, ...] = ()  # members whose whole pass the validation has judged
    revisions_whole: bool = False  # every revision has its curve over the whole record
    whole: bool = False  # some member has been drawn to the last sample
    ranges: tuple[tuple[str, Range], ...] = ()  # of the vertical axes, by what a plot shows; others follow their data
    reach: tuple[float, float] = (0.0, 0.0)  # what the moving masses take to the left and right of their places

    def with_member(self, new: Member) -> "Cast":
        """The same with one more member, or with one replaced: an estimator that was started again.

        Revisions of one model stand together, the newest first.
        """
        members = {m.name: m for m in self.members} | {new.name: new}
        order = list(dict.fromkeys(map(estimator_of, members)))
        place = {name: (order.index(estimator_of(name)), -revision_of(name)) for name in members}
        return replace(self, members=tuple(members[name] for name in sorted(members, key=place.__getitem__)))

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(m.name for m in self.members)

    def member(self, name: str) -> Member:
        return self.members[self.names.index(name)]

    @property
    def newest(self) -> tuple[Member, ...]:
        """Of each estimator the newest revision."""
        return tuple(m for m in self.members if self.is_newest(m.name))

    def before(self, name: str) -> str | None:
        """The revision that a member has taken the place of."""
        older = [m for m in self.names if estimator_of(m) == estimator_of(name) and revision_of(m) < revision_of(name)]
        return max(older, key=revision_of, default=None)

    @property
    def estimators(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(map(estimator_of, self.names)))

    def is_newest(self, name: str) -> bool:
        """Whether no member is a later revision of the same model."""
        return all(revision_of(m) <= revision_of(name) for m in self.names if estimator_of(m) == estimator_of(name))

    def color(self, name: str) -> Color:
        own = ESTIMATOR_COLORS[self.estimators.index(estimator_of(name)) % len(ESTIMATOR_COLORS)]
        return own if self.is_newest(name) else faded(own)

    def label(self, name: str) -> str:
        """The member's name in legends; with its model where the models differ and the name does not say it."""
        model, several = self.member(name).model, len({m.model for m in self.members}) > 1
        label = name if self.is_newest(name) or revision_of(name) else f"{name} as given"
        return f"{label} ({model})" if several and model not in name else label

    def shown(self, si_unit: str) -> Shown:
        """The unit on the screen, and the factor from SI; forces among bodies of a few kilograms are in N."""
        heaviest = max((mass or 0.0 for m in self.members for mass in m.masses), default=0.0)
        return shown(si_unit, light=0.0 < heaviest < LIGHT)

    def inputs_of(self, body: str) -> tuple[str, ...]:
        """Crush and rate of every element at a body: the inputs of its equation."""
        at = dict.fromkeys(e for m in self.members for e, ends in zip(m.elements, m.between) if body in ends)
        return tuple(f"{element}.{kind}" for element in at for kind in ("crush", "rate"))

    @property
    def mass(self) -> float:
        """kg, of all bodies with a mass in the lightest model; infinite where none has one."""
        masses = [sum(mass for mass in m.masses if mass) for m in self.members]
        return min((mass for mass in masses if mass > 0.0), default=np.inf)

    @property
    def equations(self) -> tuple[tuple[str, str], ...]:
        """(name, unit) of every equation of any member: accelerations first, then forces."""
        found = self._union(lambda m: m.equations)
        return tuple(e for e in found if e[1] != "N") + tuple(e for e in found if e[1] == "N")

    @property
    def parameters(self) -> tuple[tuple[str, str], ...]:
        return self._union(lambda m: m.parameters)

    @property
    def elements(self) -> tuple[str, ...]:
        return self._union(lambda m: m.elements)

    def _union(self, names_of: Callable[[Member], tuple]) -> tuple:
        return tuple(dict.fromkeys(name for m in self.members for name in names_of(m)))
