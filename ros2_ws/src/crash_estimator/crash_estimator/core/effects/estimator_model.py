"""How effects change the structure that an estimator or a free run takes: elements, masses, or actions beside them."""

from dataclasses import replace

import numpy as np

from ..structure import (
    CONTACT_FREQUENCY,
    TYPICAL_CRUSH,
    TYPICAL_RATE,
    Action,
    Coefficient,
    EffectSpec,
    ModelError,
    Structure,
)  # fmt: skip
from .effect import Effect, ElementMotion

ROUGHLY = 0.3
"""Share of a mass or of a force that an effect is taken to make up, for its order of magnitude."""


def to_be_given(structure: Structure, spec: EffectSpec, what: str) -> ModelError:
    return ModelError(
        f"model {structure.name}: effect {spec.type} on {spec.target} needs {what}, which no estimator can follow "
        "sample by sample: give it, or let `diagnose --apply` find it"
    )


def coefficient_of(spec: EffectSpec, effect: Effect) -> Coefficient:
    """Known where the model gives it, else estimated sample by sample."""
    if spec.coefficient is not None:
        return Coefficient(spec.coefficient)
    return Coefficient(0.0, estimated=True, min=effect.low, max=effect.high, drift=0.0, shape="constant")


def with_action(
    structure: Structure, spec: EffectSpec, unit: str, kind: str, at: int, coefficient, scale, **more
) -> Structure:
    name = f"{spec.target}.{spec.type}"
    action = Action(name, unit, kind, at, coefficient, max(scale, abs(coefficient.value)), **more)
    return replace(structure, actions=(*structure.actions, action))


def with_element(structure: Structure, name: str, **changes) -> Structure:
    return replace(
        structure, elements=tuple(replace(e, **changes) if e.name == name else e for e in structure.elements)
    )


def element_index(structure: Structure, name: str) -> int:
    return next(k for k, element in enumerate(structure.elements) if element.name == name)


def typical_motion(structure: Structure, element: int) -> ElementMotion:
    """Beyond the typical crush as well: where a force that begins late, such as a stop's, is looked at."""
    crush = TYPICAL_CRUSH * 2.0 ** np.arange(6)
    rate = np.full_like(crush, TYPICAL_RATE)
    static = structure.reduced_mass(element) * CONTACT_FREQUENCY**2 * np.full_like(crush, TYPICAL_CRUSH)
    return ElementMotion(np.zeros_like(crush), crush, rate, crush, static)


def heavier(structure: Structure, body: int, by: float) -> Structure:
    mass = structure.bodies[body].mass + by
    if mass <= 0.0:
        raise ModelError(
            f"model {structure.name}: its effects leave body {structure.bodies[body].name} no mass: {mass:g} kg"
        )
    return replace(
        structure, bodies=tuple(replace(b, mass=mass) if k == body else b for k, b in enumerate(structure.bodies))
    )
