"""Effects of a model file as additions of a fit, and back."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from ..effects.base import AttachedBody, Effect, StaticFactor
from ..effects.targets import checked
from ..structure import EffectSpec, Structure
from .answer import StepReport
from .layout import Addition
from .scales import Scales


def additions_of(structure: Structure, scales: Scales, effects: Mapping[str, Effect]) -> tuple[Addition, ...]:
    """Raises ModelError where a model names an effect or a target that there is not."""
    return tuple(_addition(structure, scales, spec, effects) for spec in structure.effects)


def _addition(structure: Structure, scales: Scales, spec: EffectSpec, effects: Mapping[str, Effect]) -> Addition:
    effect = checked(structure, spec, effects, scales.records[0].test)
    shapes = {
        name: shape.starts[len(shape.starts) // 2] * (scales.largest_crush(spec.target) if shape.of_crush else 1.0)
        for name, shape in effect.shapes.items()
    } | dict(spec.shape)
    coefficient = spec.coefficient
    if isinstance(effect, StaticFactor) and coefficient is not None:
        coefficient = effect.unstated(coefficient, **shapes)
    host = spec.host
    if isinstance(effect, AttachedBody) and host is None:
        host = next(body.name for body in structure.bodies if body.free)
    return Addition(effect, spec.target, shapes, coefficient, host, spec.touches, spec.taken_from, spec.variant)


def structure_with(structure: Structure, added: Sequence[Addition], steps: Sequence[StepReport]) -> Structure:
    """The structure with the effects that a search has added, with the coefficients that the answer states."""
    effects = [
        EffectSpec(
            addition.effect.name, addition.target, step.coefficient, step.shape, addition.host, addition.touches,
            addition.taken_from, addition.variant,
        )
        for addition, step in zip(added, steps, strict=True)
    ]  # fmt: skip
    return replace(structure, effects=(*structure.effects, *effects))
