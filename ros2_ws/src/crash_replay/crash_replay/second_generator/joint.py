"""An element between two bodies a and b: crush x = x_a - x_b, its force pushes a back and b forward.

One-way elements carry compression only: apart, on the curve, and where they unload along a line of their own (slope
`unload`, from the largest crush, to zero force) on that line. All that acts beside the curve belongs to the crushed
structure then: it acts in contact, and the contact never pulls, unless `pulls`.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, Protocol

from .branches import Branch, DryFriction, Z
from .curves import Curve

APART, CURVE, BACK, LINE = range(4)
"""Phases of a one-way element: CURVE loads; BACK unloads along the curve itself, LINE along the line."""


class Rate(Protocol):
    def factor(self, v: float) -> float: ...


class Held(NamedTuple):
    """What is constant between two events."""

    phase: int
    peak: float  # m, from where the line starts
    modes: tuple[int, ...]  # of the branches
    zone: int  # between which breaks of the curve


@dataclass(frozen=True)
class Joint:
    a: str
    b: str
    curve: Curve
    one_way: bool = True
    unload: float | None = None  # N/m
    gap: float = 0.0  # m, before a one-way element carries; of a two-way one the play to either side
    rate: Rate | None = None
    branches: tuple[Branch, ...] = ()
    pulls: bool = False

    @cached_property
    def size(self) -> int:
        return sum(branch.size for branch in self.branches)

    def with_branch(self, branch: Branch, **more) -> "Joint":
        return replace(self, branches=(*self.branches, branch), **more)

    def effective(self, x: float) -> float:
        """Crush behind the gap."""
        if self.one_way or not self.gap:
            return x - self.gap
        return 0.0 if abs(x) <= self.gap else x - self.gap if x > 0.0 else x + self.gap

    def start(self, x: float, v: float) -> Held:
        phase = CURVE
        if self.one_way:
            phase = CURVE if self.effective(x) >= 0.0 and v >= 0.0 else APART
        return Held(phase, 0.0, tuple(branch.start(v) for branch in self.branches), self._zone(x))

    # --- forces

    def spring(self, x: float, v: float, held: Held) -> float:
        """Of the curve alone."""
        u = self.effective(x)
        if not self.one_way:
            return self.curve.force(u) if u >= 0.0 else -self.curve.force(-u)
        if held.phase == APART:
            return 0.0
        if held.phase == LINE:
            static = max(self.curve.force(held.peak) - self.unload * (held.peak - u), 0.0)
        else:
            static = self.curve.force(max(u, 0.0))
        return static * self.rate.factor(v) if self.rate and v > 0.0 else static

    def force(self, x: float, v: float, z: Z, held: Held, but: Branch | None = None) -> float:
        """Of all, or of all but one branch, N."""
        beside = elastic = 0.0
        at = 0
        for branch, mode in zip(self.branches, held.modes):
            if branch is not but:
                one = branch.force(x, v, z[at : at + branch.size], mode)
                beside, elastic = (beside, elastic + one) if branch.elastic else (beside + one, elastic)
            at += branch.size
        spring = self.spring(x, v, held)
        if not self.one_way:  # within its play it carries nothing
            return elastic if abs(x) < self.gap else spring + beside + elastic
        if held.phase == APART:
            return elastic
        return spring + elastic + beside if self.pulls or but is not None else max(spring + elastic + beside, 0.0)

    def flow(self, x: float, v: float, z: Z, held: Held) -> list[float]:
        rates: list[float] = []
        for branch, mode in zip(self.branches, held.modes):
            rates.extend(branch.flow(x, v, z[len(rates) : len(rates) + branch.size], mode))
        return rates

    def sticking(self, held: Held) -> DryFriction | None:
        if self.one_way and held.phase == APART:
            return None
        return next((b for b, m in zip(self.branches, held.modes) if isinstance(b, DryFriction) and m == 0), None)

    # --- events: what falls through zero, and what is then

    def guards(self, x: float, v: float, z: Z, held: Held) -> list[float]:
        values = [*self._phase_guards(x, v, held), *self._zone_guards(x, held)]
        if self.sticking(held):  # nothing moves in it: its rate is zero but for rounding, which is no event
            values = [1.0] * len(values)
        at = 0
        for branch, mode in zip(self.branches, held.modes):
            values.extend(branch.guards(x, v, z[at : at + branch.size], mode))
            at += branch.size
        return values

    def switched(self, guard: int, x: float, v: float, z: Z, held: Held) -> Held:
        phases = len(self._phase_guards(x, v, held))
        if guard < phases:
            return self._phase_after(guard, x, held)
        guard -= phases
        zones = self._zone_guards(x, held)
        if guard < len(zones):
            up = held.zone < len(self._breaks) and (guard == len(zones) - 1)
            return held._replace(zone=held.zone + (1 if up else -1))
        guard -= len(zones)
        at = 0
        for n, (branch, mode) in enumerate(zip(self.branches, held.modes)):
            own = z[at : at + branch.size]
            count = len(branch.guards(x, v, own, mode))
            if guard < count:
                after = branch.switched(guard, x, v, own, mode)
                return held._replace(modes=(*held.modes[:n], after, *held.modes[n + 1 :]))
            guard -= count
            at += branch.size
        raise AssertionError("no such guard")

    def rest(self, held: Held) -> float:
        """Effective crush at which the line reaches zero force."""
        if not self.unload or not held.peak:
            return 0.0
        return held.peak - self.curve.force(held.peak) / self.unload

    def _phase_guards(self, x: float, v: float, held: Held) -> tuple[float, ...]:
        if not self.one_way:
            return ()
        u = self.effective(x)
        if held.phase == APART:
            return (self.rest(held) - u,)
        if held.phase == CURVE:
            return (v, u)
        if held.phase == BACK:
            return (-v, u)
        return (held.peak - u, u - self.rest(held))

    def _phase_after(self, guard: int, x: float, held: Held) -> Held:
        u = self.effective(x)
        if held.phase == APART:
            return held._replace(phase=LINE if self.unload and held.peak else CURVE)
        if guard == 1:
            return held._replace(phase=APART)
        if held.phase == CURVE:
            return held._replace(phase=LINE, peak=u) if self.unload else held._replace(phase=BACK)
        return held._replace(phase=CURVE)

    @cached_property
    def _breaks(self) -> tuple[float, ...]:
        """Crush at which the curve, the gap or a spring beside it has a kink."""
        own = [b + self.gap for b in self.curve.breaks]
        own += [b for branch in self.branches for b in getattr(getattr(branch, "curve", None), "breaks", ())]
        if not self.one_way:
            own += [-b for b in own] + ([self.gap, -self.gap] if self.gap else [])
        return tuple(sorted(own))

    def _zone(self, x: float) -> int:
        return sum(x > b for b in self._breaks)

    def _zone_guards(self, x: float, held: Held) -> tuple[float, ...]:
        breaks = self._breaks
        down = (x - breaks[held.zone - 1],) if held.zone > 0 else ()
        up = (breaks[held.zone] - x,) if held.zone < len(breaks) else ()
        return (*down, *up)
