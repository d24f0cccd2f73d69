"""What a search has added, as effects of a model file."""

from collections.abc import Sequence
from dataclasses import replace

from ...effects.effect import Addition
from ...structure import EffectSpec, Structure
from .ranking import StepReport


def structure_with(structure: Structure, added: Sequence[Addition], steps: Sequence[StepReport]) -> Structure:
    """The structure with the effects that a search has added, with the coefficients that the answer states; without
    those of one recording."""
    effects = [
        EffectSpec(
            addition.effect.name, addition.target, step.coefficient, step.shape, addition.host, addition.touches,
            addition.taken_from, addition.variant,
        )
        for addition, step in zip(added, steps, strict=True)
        if not addition.recording
    ]  # fmt: skip
    return replace(structure, effects=(*structure.effects, *effects))
