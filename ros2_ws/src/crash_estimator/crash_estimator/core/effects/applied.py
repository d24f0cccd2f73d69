"""Effects of a model put to work for the estimators: elements and masses where they have a place, else `Action`s.

A coefficient that the model gives is known; one that it does not give is estimated, sample by sample. What cannot be
followed that way (a gap, a delay) must be given: `diagnose --apply` writes it.
"""

from collections.abc import Mapping
from dataclasses import replace

from crash_replay.recording import Test

from ..structure import EffectSpec, Structure
from . import EFFECTS
from .effect import Effect
from .estimator_model import to_be_given
from .targets import checked


def applied(structure: Structure, test: Test, effects: Mapping[str, Effect] = EFFECTS) -> Structure:
    """The structure with its effects at work; without effects it is the same.

    Known errors of channels are not in it: `core.effects.channels` takes them out of the samples.
    Raises ModelError with one line where an effect does not fit, or needs a constant that is not given.
    """
    done = replace(structure, effects=())
    for spec in structure.effects:
        effect = checked(structure, spec, effects, test)
        done = effect.put_to_work(done, test, replace(spec, shape=_shape_constants(structure, spec, effect)))
    return done


def _shape_constants(structure: Structure, spec: EffectSpec, effect: Effect) -> dict[str, float]:
    """Those given; for others the middle of where a diagnosis starts to search, unless that depends on the crush or is
    as good as any other."""
    found = dict(spec.shape)
    for name, shape in effect.shapes_of(spec.variant).items():
        if name not in found and (shape.of_crush or shape.no_usual):
            raise to_be_given(structure, spec, f"its {name}, in {shape.unit}")
        found.setdefault(name, shape.starts[len(shape.starts) // 2])
    return found
