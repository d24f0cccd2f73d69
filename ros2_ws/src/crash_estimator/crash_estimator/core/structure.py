"""A lumped model: bodies along one axis and the elements between them (thesis 4.2, equation 4.1).

x is positive in the direction the striking body travels. An element between bodies a and b has
crush X = x_a - x_b (compression positive), rate of crush V = dX/dt and force F = K X + C V
(compression positive), which pushes a back and b forward:

    M_k a_k = sum over elements of delta_k F + P_k + e_k,    delta = -1 for a, +1 for b

with P_k the measured force that is applied to a free body, if there is one. A free body gives one equation, divided by
its mass so that measured, predicted and residual are in the accelerometer's m/s^2; a fixed body with a measured force
gives another, in N, the force on it.
"""

from dataclasses import dataclass
from difflib import get_close_matches
from functools import cached_property
from typing import NoReturn

import numpy as np

from crash_replay.recording import Test

from .momentum import lacking_for_momentum
from .structure_parts import NOTHING, Action, Body, Coefficient, EffectSpec, Element, ModelError, Parameter, Term

__all__ = ["Action", "Body", "Coefficient", "EffectSpec", "Element", "ModelError", "Parameter", "Structure", "Term"]

CONTACT_FREQUENCY = 30.0
"""rad/s: a quarter period of 50 ms, a crash's time scale; with a mass it gives a stiffness's order of magnitude."""

TYPICAL_CRUSH, TYPICAL_RATE = 0.1, 5.0
"""m, m/s: where a higher power is taken to be as large as the first, for its order of magnitude."""


@dataclass(frozen=True)
class Structure:
    """Bodies and elements; checked when made."""

    name: str
    bodies: tuple[Body, ...]
    elements: tuple[Element, ...]
    effects: tuple[EffectSpec, ...] = ()
    actions: tuple[Action, ...] = ()  # of the effects, once they are applied
    preset: str = "ours"  # of the methods' settings, where none is given: see `methods.PRESETS`

    def __post_init__(self):
        known = [body.name for body in self.bodies]
        for element in self.elements:
            for end in element.between:
                if end not in known:
                    near = get_close_matches(end, known, n=1)
                    hint = f"did you mean {near[0]!r}?" if near else f"there are {', '.join(known)}"
                    self._at_fault(
                        f"element {element.name}: no body {end!r}; {hint}", "elements", element.name, "between"
                    )
        for body in self.bodies:
            self._check_body(body)
        for element in self.elements:
            place = "elements", element.name
            if element.unloading is not None and element.unloading_slope is not None:
                self._at_fault(f"element {element.name} has a known and an estimated unloading", *place, "unloading")
            for term in element.terms:
                if term.of not in ("crush", "rate") or term.power < 2:
                    self._at_fault(f"element {element.name}: a further power is 2 or more, got {term}", *place)
        if not self.equations:
            self._at_fault("there is no equation to fit: give a free body an acceleration channel", "bodies")

    def _check_body(self, body: Body) -> None:
        place = "bodies", body.name
        if body.free and not (body.mass and body.mass > 0):
            self._at_fault(f"body {body.name} is free and needs a mass > 0 kg", *place)
        if body.driven and not body.acceleration:
            self._at_fault(f"body {body.name} names no channel for its motion", *place)
        if body.free and not body.is_measured:
            lacks = lacking_for_momentum(self, body.name)
            if lacks:
                self._at_fault(
                    f"body {body.name} names no channel for its motion, and momentum does not say it: {lacks}", *place
                )
        if len(set(body.acceleration)) < len(body.acceleration):
            key = "motion" if body.driven else "acceleration"
            self._at_fault(f"body {body.name} names a channel twice: {', '.join(body.acceleration)}", *place, key)

    def _at_fault(self, what: str, *keys: str) -> NoReturn:
        raise ModelError(f"model {self.name}: {what}", keys)

    @cached_property
    def body_index(self) -> dict[str, int]:
        return {body.name: k for k, body in enumerate(self.bodies)}

    @cached_property
    def ends(self) -> np.ndarray:
        """(elements, 2) indices of the bodies a and b."""
        return np.array([[self.body_index[end] for end in e.between] for e in self.elements]).reshape(-1, 2)

    @cached_property
    def equations(self) -> tuple[int, ...]:
        """Indices of the bodies that give an equation: free with a channel, or fixed with a measured force."""
        return tuple(k for k, b in enumerate(self.bodies) if (b.free and b.is_measured) or (b.fixed and b.force))

    @cached_property
    def equation_units(self) -> tuple[str, ...]:
        return tuple("m/s^2" if self.bodies[k].free else "N" for k in self.equations)

    @cached_property
    def force_to_equation(self) -> np.ndarray:
        """(equations, elements) delta / M: what one newton in an element adds to each equation's right-hand side."""
        share = np.zeros((len(self.equations), len(self.elements)))
        for row, k in enumerate(self.equations):
            inertia = self.bodies[k].mass if self.bodies[k].free else 1.0
            a, b = (np.isin(self.ends[:, side], self.pushed_with(k)).astype(float) for side in (0, 1))
            share[row] = (b - a) / inertia
        return share

    def pushed_with(self, body: int) -> list[int]:
        """The body and those that it carries."""
        return [k for k, other in enumerate(self.bodies) if body in (k, self.body_index.get(other.carried_by))]

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Those of the elements, then one for each action."""
        return self.element_parameters + tuple(
            Parameter(a.name, a.unit, a.element, False, a.coefficient, a.scale) for a in self.actions
        )

    @cached_property
    def element_parameters(self) -> tuple[Parameter, ...]:
        """Stiffness and damping of every element, known ones included; then higher powers and estimated unloading."""
        found = []
        for k, element in enumerate(self.elements):
            mass = self.reduced_mass(k)
            for kind, unit, scale in (
                ("stiffness", "N/m", mass * CONTACT_FREQUENCY**2),
                ("damping", "N*s/m", mass * CONTACT_FREQUENCY),
            ):
                coefficient = getattr(element, kind)
                scale = max(abs(coefficient.value), scale)
                found.append(Parameter(f"{element.name}.{kind}", unit, k, kind == "stiffness", coefficient, scale))
        return tuple(found) + tuple(self._further_parameters())

    def _further_parameters(self) -> list[Parameter]:
        found = []
        for k, element in enumerate(self.elements):
            mass = self.reduced_mass(k)
            for term in element.terms:
                spring, n = term.of == "crush", term.power
                name = f"{element.name}.{'stiffness' if spring else 'damping'}{n}"
                unit = f"N/m^{n}" if spring else f"N*(s/m)^{n}"
                first = mass * CONTACT_FREQUENCY**2 if spring else mass * CONTACT_FREQUENCY
                scale = max(abs(term.coefficient.value), first / (TYPICAL_CRUSH if spring else TYPICAL_RATE) ** (n - 1))
                found.append(Parameter(name, unit, k, False, term.coefficient, scale, n))
            if element.unloading_slope is not None:
                slope = element.unloading_slope
                scale = max(abs(slope.value), mass * CONTACT_FREQUENCY**2)
                found.append(Parameter(f"{element.name}.unloading", "N/m", k, False, slope, scale, is_unloading=True))
        return found

    @property
    def first_order(self) -> bool:
        """Whether springs and dampers of the first power, which may pull, and known unloading are all there is."""
        more = any(e.terms or e.unloading_slope or e.origin or e.play or e.factor for e in self.elements)
        more |= any(not e.damper_pulls or e.acts_when_spent != NOTHING for e in self.elements)
        return not (more or self.actions or any(body.carried_by or body.applied for body in self.bodies))

    def is_held(self, body: int) -> bool:
        """Whether a spring brings the body back."""
        return any(body in ends and element.has_spring for element, ends in zip(self.elements, self.ends))

    def place_of(self, target: str) -> frozenset[str]:
        """The bodies that an effect's target joins, an element or "body_a-body_b"; of any other, the target itself."""
        between = {e.name: e.between for e in self.elements}
        between |= {f"{a.name}-{b.name}": (a.name, b.name) for a in self.bodies for b in self.bodies if a is not b}
        return frozenset(between.get(target, (target,)))

    def reduced_mass(self, element: int) -> float:
        """Of the two bodies of an element; a driven or fixed one is infinitely heavy, a carried one its carrier."""
        ends = [self.bodies[k] for k in self.ends[element]]
        ends = [self.bodies[self.body_index[end.carried_by]] if end.carried_by else end for end in ends]
        inverse = sum(1.0 / body.mass for body in ends if body.free and body.mass)
        return 1.0 / inverse if inverse else 1.0

    def check_channels(self, test: Test) -> None:
        """Every channel that the model names is in the test and of the right quantity, or a one-line error."""
        for wanted_by, name, quantity in self.channels():
            channel = test.channels[test.index(name, wanted_by)]
            if channel.quantity != quantity:
                raise ModelError(
                    f"{wanted_by} of model {self.name} needs a channel of {quantity}, "
                    f"but {name} of test {test.id} is one of {channel.quantity}"
                )

    def channels(self) -> list[tuple[str, str, str]]:
        """(wanted by, channel, quantity) for every channel that the model reads."""
        wanted = [(f"body {b.name}", name, "acceleration") for b in self.bodies for name in b.acceleration]
        wanted += [(f"body {b.name}", name, "force") for b in self.bodies for name in (b.force, b.applied) if name]
        wanted += [(f"body {b.name}", b.displacement, "displacement") for b in self.bodies if b.displacement]
        wanted += [(f"body {b.name}", b.velocity, "velocity") for b in self.bodies if b.velocity]
        wanted += [(f"element {e.name}", e.displacement, "displacement") for e in self.elements if e.displacement]
        wanted += [(f"element {e.name}", e.velocity, "velocity") for e in self.elements if e.velocity]
        wanted += [
            (f"effect {e.type}", e.target, "acceleration") for e in self.effects if self._names_a_channel(e, wanted)
        ]
        return wanted

    def _names_a_channel(self, effect: EffectSpec, wanted: list[tuple[str, str, str]]) -> bool:
        """Whether an effect's target is a channel that no body or element reads."""
        others = {name for _, name, _ in wanted} | {b.name for b in self.bodies} | {e.name for e in self.elements}
        pairs = {f"{a.name}-{b.name}" for a in self.bodies for b in self.bodies}
        return effect.target not in others | pairs
