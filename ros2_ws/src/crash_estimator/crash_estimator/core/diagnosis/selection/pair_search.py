"""Two effects that only count together, because neither does while the other is missing."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import islice
from typing import NamedTuple

from ...effects.effect import Addition, Effect
from ..parameterization.magnitudes import Magnitudes
from ..residuals.in_band import band_of
from ..residuals.residuals import analyse
from .acceptance import cost_of_noise, explains_too_little, share_removed
from .candidate_fits import CandidateFit, fit_candidates
from .fitted_model import Model, fit_model
from .rare_effects import effects_beside
from .selection_step import SelectionStep, added, as_fitted
from .thresholds import THRESHOLDS


class Pair(NamedTuple):
    model: Model  # with both
    path: list[SelectionStep]  # as if they had been found one by one


def two_at_once(
    magnitudes: Magnitudes, effects: Mapping[str, Effect], model: Model, candidates: Sequence[CandidateFit],
    alike: Sequence[Pair], followed: tuple[str, str] | None,
) -> Pair | None:  # fmt: skip
    """Where no effect counts for itself in noise as large as what it leaves: two that leave only the sensors'.

    candidates: all of them, as recorded; alike: two of one effect; followed: effect and target of the one whose second
    has been looked for already, and left more.
    """
    found = [
        *_one_after_the_other(magnitudes, effects, model, candidates, followed),
        *(pair for pair in alike if pair.model.white or _removes_nearly_all(model, pair)),
    ]
    return max(found, key=lambda pair: (pair.model.white, pair.model.fit.evidence), default=None)


def two_of_one_effect(magnitudes: Magnitudes, model: Model, candidates: Sequence[CandidateFit]) -> list[Pair]:
    """What a model lacks on one element it may well lack on another: neither counts where the other is missing.

    Of the likeliest effects, each where it explains most and at one more place.
    """
    alike: dict[str, list[CandidateFit]] = {}
    for one in candidates:
        if one.addition.effect.acts_on == "element":
            alike.setdefault(one.addition.effect.name, []).append(one)
    several = [places for places in alike.values() if len(places) > 1 and _leading(model, places[:1])]
    found = []
    for first, *others in several[: THRESHOLDS.shortlist]:
        larger = as_fitted(model, first)
        pairs = (_together(magnitudes, candidates, model, first, larger, o.addition) for o in others)
        found += [pair for pair in islice(pairs, THRESHOLDS.few) if pair]
    return found


def _together(
    magnitudes: Magnitudes, candidates: Sequence[CandidateFit], model: Model, first: CandidateFit, larger: Model,
    second: Addition,
) -> Pair | None:  # fmt: skip
    """A second one beside the first, which the larger model has; None where it gains too little."""
    both = fit_model(magnitudes, model.records, [*larger.additions, second])
    gain = both.fit.evidence - larger.fit.evidence
    if gain <= THRESHOLDS.gain_in_pair:
        return None
    rest = [one for one in candidates if one is not first]
    last = CandidateFit(second, gain, both.fit)
    path = [SelectionStep(model, [first, *rest], candidates), SelectionStep(larger, [last], [last])]
    return Pair(both, path)


def seconds_beside(
    magnitudes: Magnitudes, effects: Mapping[str, Effect], model: Model, first: CandidateFit
) -> tuple[Model, list[CandidateFit]]:
    """The model with the first, and all candidates for a second one beside it."""
    larger = as_fitted(model, first)
    others = effects_beside([first.addition], magnitudes.structure, effects)
    return larger, fit_candidates(magnitudes, others, larger, least=cost_of_noise(model.records))


def _removes_nearly_all(model: Model, pair: Pair) -> bool:
    return share_removed(model.residuals, pair.model.residuals) > THRESHOLDS.nearly_all


def likely(candidates: Sequence[CandidateFit]) -> list[CandidateFit]:
    """Those that gain enough to be one of two."""
    return [one for one in candidates if one.fit and one.gain > THRESHOLDS.gain_in_pair]


def _leading(model: Model, candidates: Sequence[CandidateFit]) -> list[CandidateFit]:
    """The likely ones that explain not too little to be one of two."""
    band = band_of(model)
    return [one for one in likely(candidates) if not explains_too_little(model, as_fitted(model, one), band)]


def _one_after_the_other(magnitudes: Magnitudes, effects, model: Model, candidates, followed) -> Iterator[Pair]:
    """The likeliest first ones, each with the best second one."""
    for first in _leading(model, candidates)[: THRESHOLDS.few]:
        if first.addition.key == followed or analyse(first.fit).mean_square >= THRESHOLDS.real_structure:
            continue
        larger, seconds = seconds_beside(magnitudes, effects, model, first)
        best = next(iter(likely(seconds)), None)
        if best is None:
            continue
        both = added(magnitudes, larger, best)
        if both.white:
            others = [one for one in candidates if one is not first]
            yield Pair(both, [SelectionStep(model, [first, *others]), SelectionStep(larger, seconds)])
