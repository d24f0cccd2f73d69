"""What an effect can act on, and whether a model's effect is one that there is."""

from collections.abc import Mapping, Sequence
from difflib import get_close_matches

from crash_replay.limits import NUMBER
from crash_replay.recording import Test

from ..structure import EffectSpec, ModelError, Structure
from .effect import Effect

NOUN = {"element": "an element", "body": "a free body", "channel": "a channel", "between": "two bodies"}


def check_effects(structure: Structure, effects: Mapping[str, Effect]) -> None:
    """Those of a model, as far as can be said without a test; raises ModelError with one line and where it is."""
    there = [(spec.type, spec.target) for spec in structure.effects]
    for place, spec in enumerate(structure.effects):
        try:
            checked(structure, spec, effects)
            if there.index((spec.type, spec.target)) < place:
                raise ModelError(f"model {structure.name}: effect {spec.type} acts on {spec.target} twice")
        except ModelError as error:
            raise ModelError(str(error), ("effects", place)) from None


def checked(structure: Structure, spec: EffectSpec, effects: Mapping[str, Effect], test: Test | None = None) -> Effect:
    """The effect that a model's entry means.

    Raises ModelError with one line where there is no such effect, or its target, shape constant, form or body is none.
    """
    effect = _known(structure, spec.type, effects)
    what = f"model {structure.name}: effect {spec.type}"
    targets = effect.possible_targets(structure, test)
    if targets is not None and spec.target not in targets:
        nouns = " or ".join(dict.fromkeys(NOUN[effect.target_key(variant)] for variant in effect.variants))
        raise ModelError(f"{what} cannot act on {spec.target!r}; it needs {nouns}: {_choice(spec.target, targets)}")
    if spec.variant not in effect.variants:
        forms = ", ".join(filter(None, effect.variants))
        raise ModelError(f"{what} has no form {spec.variant!r}; " + (f"it has {forms}" if forms else "leave it out"))
    shapes = effect.shapes_of(spec.variant)
    for name in spec.shape:
        if name not in shapes:
            in_form = f" in form {spec.variant!r}" if spec.variant else ""
            has = ", ".join(shapes) or "none"
            raise ModelError(f"{what} has no shape constant {name!r}{in_form}; it has {has}")
    if spec.coefficient is not None:
        _admissible(f"{what} on {spec.target}", spec.coefficient, effect)
    for name, value in spec.shape.items():
        if not 0.0 < value <= NUMBER.highest:
            raise ModelError(f"{what} on {spec.target}: {name} must be above 0, got {value:g}")
    bodies = [body.name for body in structure.bodies]
    for role in ("host", "touches", "taken_from"):
        name = getattr(spec, role)
        if name is not None and name not in bodies:
            raise ModelError(f"{what} on {spec.target}: {role} must be a body, got {name!r}; {_choice(name, bodies)}")
    effect.refuse(structure, spec)
    return effect


def _admissible(what: str, coefficient: float, effect: Effect) -> None:
    """Raises ModelError where a coefficient is outside the effect's physical limits."""
    if wrong := NUMBER.wrong(coefficient):
        raise ModelError(f"{what}: coefficient {wrong}")
    low, high = effect.stated_limits()
    if not low <= coefficient <= high:
        limits = f"not below {low:g}" if high == float("inf") else f"from {low:g} to {high:g}"
        raise ModelError(f"{what}: coefficient must be {limits} {effect.unit}".rstrip() + f", got {coefficient:g}")


def _known(structure: Structure, name: str, effects: Mapping[str, Effect]) -> Effect:
    if name not in effects:
        near = get_close_matches(name, effects, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else f"; there are {', '.join(effects)}"
        raise ModelError(f"model {structure.name}: there is no effect {name!r}{hint}")
    return effects[name]


def _choice(name: str, known: Sequence[str]) -> str:
    near = get_close_matches(name, known, n=1)
    return f"did you mean {near[0]!r}?" if near else f"there are {', '.join(known)}" if known else "there is none"
