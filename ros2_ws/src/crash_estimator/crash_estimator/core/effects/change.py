"""A structure with one effect more, or one less."""

from collections.abc import Mapping
from dataclasses import replace

from crash_replay.recording import Test

from ..structure import EffectSpec, ModelError, Structure
from . import EFFECTS
from .effect import Effect
from .targets import checked


def add_effect(
    structure: Structure,
    effect: str,
    target: str,
    effects: Mapping[str, Effect] = EFFECTS,
    test: Test | None = None,
    coefficient: float | None = None,
    shape: Mapping[str, float] = {},
    **more: str | None,
) -> Structure:
    """The structure with an effect at the end of its effects.

    effect: a name in `effects`; target: element, body, channel or "body_a-body_b"; test: whose channels an
    unmodelled_body may be on; coefficient: known (None: estimated); shape: shape constants; more: host, touches,
    taken_from, variant of EffectSpec. Raises ModelError with one line: no such effect or target, or there already.
    """
    spec = EffectSpec(effect, target, coefficient, dict(shape), **more)
    checked(structure, spec, effects, test)
    if any(_same(spec, there) for there in structure.effects):
        raise ModelError(f"model {structure.name}: effect {effect} acts on {target} already")
    return replace(structure, effects=(*structure.effects, spec))


def remove_effect(structure: Structure, effect: str, target: str) -> Structure:
    """The structure without an effect; raises ModelError with one line where it has no such effect."""
    gone = EffectSpec(effect, target)
    left = tuple(there for there in structure.effects if not _same(gone, there))
    if len(left) == len(structure.effects):
        has = ", ".join(f"{there.type} on {there.target}" for there in structure.effects) or "none"
        raise ModelError(f"model {structure.name} has no effect {effect} on {target} to remove; its effects: {has}")
    return replace(structure, effects=left)


def _same(a: EffectSpec, b: EffectSpec) -> bool:
    return (a.type, a.target) == (b.type, b.target)
