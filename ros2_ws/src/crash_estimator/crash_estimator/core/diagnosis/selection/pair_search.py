"""Two effects that only count together, because neither does while the other is missing."""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from ...effects.effect import Effect
from ..parameterization.magnitudes import Magnitudes
from ..residuals.residuals import analyse
from .acceptance import share_removed
from .candidate_fits import CandidateFit, fit_candidates
from .fitted_model import Model, fit_model
from .selection_step import SelectionStep, added
from .thresholds import THRESHOLDS


class Pair(NamedTuple):
    magnitudes: Magnitudes
    model: Model  # with both
    path: list[SelectionStep]  # as if they had been found one by one


def two_at_once(
    magnitudes: Magnitudes, effects: Mapping[str, Effect], model: Model, candidates: Sequence[CandidateFit]
) -> Pair | None:
    """Where no effect counts for itself in noise as large as what it leaves: two that leave only the sensors'.

    candidates: all of them, as recorded.
    """
    found = [
        *_one_after_the_other(magnitudes, effects, model, candidates),
        *_of_one_effect(magnitudes, model, candidates),
    ]
    return max(found, key=lambda pair: (pair.model.white, pair.model.fit.evidence), default=None)


def _likely(candidates: Sequence[CandidateFit]) -> list[CandidateFit]:
    return [one for one in candidates if one.fit and one.gain > THRESHOLDS.gain_in_pair]


def _one_after_the_other(magnitudes: Magnitudes, effects, model: Model, candidates) -> Iterator[Pair]:
    """The likeliest first ones, each with the best second one."""
    records = model.records
    for first in _likely(candidates)[: THRESHOLDS.with_care]:
        if analyse(first.fit).mean_square >= THRESHOLDS.real_structure:
            continue
        wider, larger = added(magnitudes, records, model, first)
        seconds = fit_candidates(wider, effects, larger)
        if not seconds or not seconds[0].fit or seconds[0].gain < THRESHOLDS.gain_in_pair:
            continue
        widest, both = added(wider, records, larger, seconds[0])
        if both.white:
            others = [one for one in candidates if one is not first]
            yield Pair(widest, both, [SelectionStep(model, [first, *others]), SelectionStep(larger, seconds)])


def _of_one_effect(magnitudes: Magnitudes, model: Model, candidates) -> Iterator[Pair]:
    """What a model lacks on one element it may well lack on another: neither counts where the other is missing."""
    alike: dict[str, list[CandidateFit]] = {}
    for one in candidates:
        if one.addition.effect.acts_on == "element":
            alike.setdefault(one.addition.effect.name, []).append(one)
    for first, second in [ones[:2] for ones in alike.values() if len(ones) > 1 and _likely(ones[:1])]:
        larger = added(magnitudes, model.records, model, first)[1]
        both = fit_model(magnitudes, model.records, [*larger.additions, second.addition])
        gain = both.fit.evidence - larger.fit.evidence
        enough = both.white or share_removed(model.residuals, both.residuals) > THRESHOLDS.all_but_folds
        if gain > THRESHOLDS.gain_in_pair and enough:
            others = [one for one in candidates if one is not first]
            last = CandidateFit(second.addition, gain, both.fit)
            yield Pair(magnitudes, both, [SelectionStep(model, [first, *others]), SelectionStep(larger, [last])])
