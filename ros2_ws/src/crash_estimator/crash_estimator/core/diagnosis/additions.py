"""Effects of a model file as additions of a fit, and back."""

from collections.abc import Mapping
from dataclasses import replace

from ..effects.base import AttachedBody, Effect, StaticFactor
from ..effects.targets import checked
from ..structure import EffectSpec, Structure
from .answer import stated
from .layout import Addition
from .model import Model
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


def structure_with(structure: Structure, model: Model, present: int) -> Structure:
    """The structure with the effects that a search has added, as found."""
    added = []
    for addition in model.additions[present:]:
        place = next(p for p in model.fit.layout.places if p.addition.key == addition.key)
        value, _, shapes = stated(place, model.fit)
        added.append(
            EffectSpec(
                addition.effect.name,
                addition.target,
                value,
                shapes,
                addition.host,
                addition.touches,
                addition.taken_from,
                addition.variant,
            )  # fmt: skip
        )
    return replace(structure, effects=(*structure.effects, *added))
