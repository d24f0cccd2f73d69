"""Effective masses as a first stage of any method (thesis 4.4.1): one estimator finds M, the other K and C with them.

Both follow the same samples. As soon as every mass is known to `KNOWN_TO` of itself the second stage takes them in
place of the model's, and again whenever they change; what it has found so far stays. Its equation of a body's balance,

    a_k = (sum of element forces) / M_k + e_k,

holds for the masses that go with the accelerometers, not for those on the scales.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from crash_replay.recording import Sample

from .estimate import Estimate, Event
from .estimators.effective_mass import EffectiveMass, with_effective_masses
from .structure import Structure

KNOWN_TO = 0.1
"""Share of a mass that its standard deviation must be below: a rough one would be worse than the model's."""


class MassFirstState(NamedTuple):
    masses: Any  # of the first stage
    in_use: tuple[float, ...]  # kg; empty: those of the model
    method: Any  # of the second


class MassFirst:
    """Settings: the first stage, and what makes the second for a structure."""

    def __init__(self, structure: Structure, masses: EffectiveMass, make: Callable[[Structure], Any]):
        self.structure, self.masses, self.make = structure, masses, make
        self._made: tuple[tuple[float, ...], Any] = ((), make(structure))  # the newest: masses change rarely
        d, m = self._made[1].description, masses.description
        self.description = d._replace(extra=d.extra + m.parameters, extra_units=d.extra_units + m.parameter_units)

    def init(self) -> MassFirstState:
        return MassFirstState(self.masses.init(), (), self._second(()).init())

    def step(self, state: MassFirstState, sample: Sample) -> tuple[MassFirstState, Estimate]:
        """Fold one sample in; `state` is left as it was."""
        masses, found = self.masses.step(state.masses, sample)
        known = bool((found.std < KNOWN_TO * found.parameters).all())
        in_use = tuple(found.parameters.tolist()) if known else state.in_use
        method, estimate = self._second(in_use).step(state.method, sample)
        events = () if state.in_use or not in_use else (self._event(found),)
        return MassFirstState(masses, in_use, method), estimate._replace(
            events=estimate.events + events,
            extra=estimate.extra + tuple(found.parameters.tolist()),
            extra_std=estimate.extra_std + tuple(found.std.tolist()),
        )

    def _second(self, masses: tuple[float, ...]) -> Any:
        if self._made[0] != masses:
            names = self.masses.description.parameters
            structure = with_effective_masses(self.structure, dict(zip(names, masses))) if masses else self.structure
            self._made = (masses, self.make(structure))
        return self._made[1]

    def _event(self, found: Estimate) -> Event:
        names = (name.removesuffix(".mass") for name in self.masses.description.parameters)
        text = ", ".join(f"{n} {m:.0f} +- {s:.0f} kg" for n, m, s in zip(names, found.parameters, found.std))
        return Event("masses", "masses", float(found.parameters.sum()), f"effective masses from here on: {text}")
