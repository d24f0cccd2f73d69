"""Effects of a model file, and the unloading stiffnesses that it leaves open, as additions of a fit."""

from collections.abc import Mapping

from ...effects.effect import Addition, Effect
from ...effects.targets import checked
from ...structure import EffectSpec, Element, Structure
from .magnitudes import Magnitudes


def additions_of(magnitudes: Magnitudes, effects: Mapping[str, Effect]) -> tuple[Addition, ...]:
    """Raises ModelError where a model names an effect or a target that there is not."""
    structure = magnitudes.structure
    stated = [_addition(magnitudes, spec, effects) for spec in structure.effects]
    lines = [
        Addition(effects["plastic_unloading"], element.name, coefficient=element.unloading_slope.value)
        for element in _open_lines(structure)
    ]
    return (*stated, *lines)


def number_of_additions(structure: Structure) -> int:
    """How many `additions_of` finds."""
    return len(structure.effects) + len(_open_lines(structure))


def _open_lines(structure: Structure) -> list[Element]:
    """Elements whose unloading stiffness is to be estimated."""
    return [element for element in structure.elements if element.unloading_slope]


def _addition(magnitudes: Magnitudes, spec: EffectSpec, effects: Mapping[str, Effect]) -> Addition:
    structure = magnitudes.structure
    effect = checked(structure, spec, effects, magnitudes.records[0].test)
    shapes = {
        name: shape.starts[len(shape.starts) // 2] * magnitudes.shape_unit(shape, spec.target)
        for name, shape in effect.shapes_of(spec.variant).items()
    } | dict(spec.shape)
    coefficient = spec.coefficient
    if coefficient is not None:
        coefficient = effect.unstated(coefficient, **shapes)
    host = spec.host
    if effect.attaches_body(spec.variant) and host is None:
        host = next(body.name for body in structure.bodies if body.free)
    return Addition(effect, spec.target, shapes, coefficient, host, spec.touches, spec.taken_from, spec.variant)
