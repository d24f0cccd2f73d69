"""Effects of a model file as additions of a fit, and back."""

from collections.abc import Mapping
from dataclasses import replace
from difflib import get_close_matches
from itertools import permutations

from ..effects.base import AttachedBody, ChannelError, Effect, PairSpring, StaticFactor
from ..structure import EffectSpec, ModelError, Structure
from .answer import stated
from .layout import Addition
from .scales import Scales
from .search import Model


def additions_of(structure: Structure, scales: Scales, effects: Mapping[str, Effect]) -> tuple[Addition, ...]:
    """Raises ModelError where a model names an effect or a target that there is not."""
    return tuple(_addition(structure, scales, spec, effects) for spec in structure.effects)


def _addition(structure: Structure, scales: Scales, spec: EffectSpec, effects: Mapping[str, Effect]) -> Addition:
    if spec.type not in effects:
        near = get_close_matches(spec.type, effects, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else f"; there are {', '.join(effects)}"
        raise ModelError(f"model {structure.name}: there is no effect {spec.type!r}{hint}")
    effect = effects[spec.type]
    targets = possible_targets(structure, scales, effect)
    if spec.target not in targets:
        raise ModelError(
            f"model {structure.name}: effect {spec.type} cannot act on {spec.target!r}; "
            f"it needs {'a' if key_of(effect) != 'element' else 'an'} {NOUN[key_of(effect)]}: {', '.join(targets) or 'there is none'}"
        )
    unknown = [name for name in spec.shape if name not in effect.shapes]
    if unknown:
        known = ", ".join(effect.shapes) or "none"
        raise ModelError(f"model {structure.name}: effect {spec.type} has no shape constant {unknown[0]!r}; it has {known}")
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
                addition.effect.name, addition.target, value, shapes, addition.host, addition.touches, addition.taken_from,
                addition.variant,
            )  # fmt: skip
        )
    return replace(structure, effects=(*structure.effects, *added))


NOUN = {"element": "element", "body": "free body", "channel": "channel", "between": "pair of bodies"}


def possible_targets(structure: Structure, scales: Scales, effect: Effect) -> list[str]:
    """What an effect of this kind can act on."""
    match key_of(effect):
        case "element":
            return [element.name for element in structure.elements]
        case "body":
            return [body.name for body in structure.bodies if body.free]
        case "between":
            return [f"{a.name}-{b.name}" for a, b in permutations(structure.bodies, 2) if a.free or b.free]
    used = [name for body in structure.bodies for name in (*body.acceleration, body.force) if name]
    if isinstance(effect, ChannelError):
        return used
    return [c.name for c in scales.records[0].test.channels if c.quantity == "acceleration" and c.name not in used]


def key_of(effect: Effect) -> str:
    """What the target is called in a model file."""
    if isinstance(effect, PairSpring):
        return "between"
    if isinstance(effect, (AttachedBody, ChannelError)):
        return "channel"
    return "body" if type(effect).__name__ in ("BodyInertia", "BodyForce") else "element"
