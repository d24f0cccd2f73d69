"""Everything that may be missing: the vocabulary's effects on all targets where they can be told at all."""

from collections.abc import Mapping, Sequence

from ...effects.effect import Addition, Effect
from ..parameterization.magnitudes import Magnitudes


def candidates(
    magnitudes: Magnitudes, effects: Mapping[str, Effect], present: Sequence[Addition] = ()
) -> list[Addition]:
    """Every admissible addition, several with the same effect and target where the search has several starts."""
    taken = {addition.key for addition in present}
    sensed = {_carrier(magnitudes, addition.target) for addition in present if addition.attaches_body}
    found = (a for effect in effects.values() for a in effect.candidates(magnitudes.structure, magnitudes))
    return [
        addition
        for addition in found
        if addition.key not in taken
        and not (addition.attaches_body and _carrier(magnitudes, addition.target) in sensed)
    ]


def _carrier(magnitudes: Magnitudes, channel: str) -> str:
    """The body that a channel's sensor sits on: with two sensors it is still one body."""
    test = magnitudes.records[0].test
    return test.channels[test.index(channel)].body or channel
