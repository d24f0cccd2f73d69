"""Two effects that only count together, because neither does while the other is missing."""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from ..effects.base import Effect
from .assess import assess
from .model import Model, fit_model
from .records import Record
from .rounds import Round, added, share_removed
from .scales import Scales
from .trying import Tried, try_candidates

FIRST_ONES = 3
"""Candidates that are tried with a second one at once."""

MOST_LEFT = 100.0
"""Mean square in units of the noise that the first one leaves: of a real structure no second one takes that."""

PAIR_GAIN = 100.0
"""Nats that each of two must gain that are found at once: there are thousands of pairs, and some mimic anything
small."""

ALL_BUT_FOLDS = 0.95
"""Share that two of a kind must remove, where they do not leave noise alone: the rest may be folds of the curves."""


class Pair(NamedTuple):
    scales: Scales
    model: Model  # with both
    rounds: list[Round]  # as if they had been found one by one


def two_at_once(
    records: Sequence[Record], scales: Scales, effects: Mapping[str, Effect], model: Model, tried: Sequence[Tried]
) -> Pair | None:
    """Where no effect counts for itself in noise as large as what it leaves: two that leave only the sensors'.

    tried: all candidates, as recorded.
    """
    found = [
        *_one_after_the_other(records, scales, effects, model, tried),
        *_of_one_effect(records, scales, model, tried),
    ]
    return max(found, key=lambda pair: (pair.model.left.whiteness.white, pair.model.fit.evidence), default=None)


def _likely(tried: Sequence[Tried]) -> list[Tried]:
    return [one for one in tried if one.fit and one.gain > PAIR_GAIN]


def _one_after_the_other(records, scales: Scales, effects, model: Model, tried) -> Iterator[Pair]:
    """The likeliest first ones, each with the best second one."""
    for first in [one for one in _likely(tried)[:FIRST_ONES] if assess(one.fit, records).cost < MOST_LEFT]:
        wider, larger = added(records, scales, model, first)
        seconds = try_candidates(records, wider, effects, larger)
        if not seconds or not seconds[0].fit or seconds[0].gain < PAIR_GAIN:
            continue
        widest, both = added(records, wider, larger, seconds[0])
        if both.left.whiteness.white:
            others = [one for one in tried if one is not first]
            yield Pair(widest, both, [Round(model, [first, *others]), Round(larger, seconds)])


def _of_one_effect(records, scales: Scales, model: Model, tried) -> Iterator[Pair]:
    """What a model lacks on one element it may well lack on another: neither counts where the other is missing."""
    elements = {element.name for element in scales.structure.elements}
    alike: dict[str, list[Tried]] = {}
    for one in tried:
        if one.addition.target in elements:
            alike.setdefault(one.addition.effect.name, []).append(one)
    for first, second in [ones[:2] for ones in alike.values() if len(ones) > 1 and _likely(ones[:1])]:
        larger = added(records, scales, model, first)[1]
        both = fit_model(scales.structure, records, scales, [*larger.additions, second.addition])
        gain = both.fit.evidence - larger.fit.evidence
        if gain > PAIR_GAIN and (both.left.whiteness.white or share_removed(model.left, both.left) > ALL_BUT_FOLDS):
            others = [one for one in tried if one is not first]
            last = Tried(second.addition, gain, both.fit, None)
            yield Pair(scales, both, [Round(model, [first, *others]), Round(larger, [last])])
