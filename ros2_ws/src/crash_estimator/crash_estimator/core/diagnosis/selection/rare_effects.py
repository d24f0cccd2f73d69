"""Rare effects bend far, and two of them would follow most that no vocabulary has: they are asked after the common
ones, alone or beside one of those, and believed only where what is left is noise, or next to nothing where no common
one comes near. Beside a rare one that was found another one is added only where noise is left, and no rare one but
those that have no shape constant to bend."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from ...effects.effect import Addition, Effect
from ...structure import Structure
from ..output_error.gauss_newton import fit
from ..output_error.problem import make_problem
from ..parameterization.magnitudes import Magnitudes
from ..residuals.residuals import analyse
from .acceptance import cost_of_noise
from .candidate_fits import CandidateFit, begin, fit_harder, ranked
from .fitted_model import Model
from .search_limit import search_is_over
from .selection_step import SelectionStep, as_found
from .thresholds import THRESHOLDS


def common_effects(structure: Structure, effects: Mapping[str, Effect]) -> Mapping[str, Effect]:
    """Those that are looked for first; what the model has already is one of them."""
    has = {spec.type for spec in structure.effects}
    found = {name: effect if name in has else effect.common() for name, effect in effects.items()}
    return {name: effect for name, effect in found.items() if effect}


def effects_beside(
    found: Iterable[Addition], structure: Structure, effects: Mapping[str, Effect]
) -> Mapping[str, Effect]:
    """All; beside a rare one the common ones, and of the rare ones those that have no shape constant."""
    if not any(map(is_rare, found)):
        return effects
    straight = {name: effect for name, effect in effects.items() if not effect.shapes}
    return {**common_effects(structure, effects), **straight}


def found_as_common(effects: Mapping[str, Effect], found: Iterable[Addition]) -> Mapping[str, Effect]:
    """The effects, with rare ones that were found looked for among the first."""
    return {**effects} | {o.effect.name: effects[o.effect.name].as_common(o.variant) for o in found if is_rare(o)}


def is_rare(addition: Addition) -> bool:
    """Whether it is of an effect, or of a form of one, that is looked for last."""
    common = addition.effect.common()
    return common is None or addition.variant not in common.variants


def with_rare_ones(
    magnitudes: Magnitudes, effects: Mapping[str, Effect], step: SelectionStep, found: Sequence[Addition] = ()
) -> SelectionStep:
    """A step of common effects, with the rare ones in its ranking where one of them is believed, beside those found.

    They are fitted with care where the common ones leave more than noise, and one of them less than the best of those.
    """
    common = common_effects(magnitudes.structure, effects)
    rest = {name: effect.without(common.get(name)) for name, effect in effects.items()}
    rare = {name: effect for name, effect in rest.items() if effect}
    model = step.before
    in_a_band = any(np.isfinite(record.below) for record in model.records)
    little_is_missing = model.white and not (step.best and step.best.gain > THRESHOLDS.gain_beyond_white)
    if not rare or little_is_missing or in_a_band or search_is_over():
        return step
    least = min([model.fit.cost, *(one.fit.cost for one in step.candidates if one.fit)])

    def fitted() -> SelectionStep:
        return elsewhere_than(magnitudes, found, SelectionStep(model, search.ranking()))

    search = begin(magnitudes, rare, model, least)
    alone = fitted()
    if _leaving_less(alone, least) and not (step.leaves_noise or alone.leaves_noise):
        fit_harder(search, model)
        alone = fitted()
    if not (alone.leaves_noise or (_leaves_next_to_nothing(alone) and not _comes_near(step, alone))):
        doubted = [] if step.leaves_noise else _leaving_less(alone, least)
        return step._replace(doubted=doubted) if doubted else step
    best: dict[tuple[str, str], CandidateFit] = {}
    for one in ranked([*step.candidates, *alone.candidates]):
        best.setdefault(one.addition.key, one)
    together = list(best.values())
    return SelectionStep(model, together, together)


def elsewhere_than(magnitudes: Magnitudes, found: Iterable[Addition], step: SelectionStep) -> SelectionStep:
    """Without the candidates on the same element: of two there, one of them rare, one follows what the form of the
    other leaves. What leaves only noise without that, too, stays: the other one was found in its place."""
    on_target = {addition.target: addition for addition in found}

    def stays(one: CandidateFit) -> bool:
        there = on_target.get(one.addition.target)
        return there is None or (one.fit is not None and _leaves_noise_without(magnitudes, there, step.before, one))

    return step._replace(candidates=[one for one in step.candidates if stays(one)])


def _leaves_noise_without(magnitudes: Magnitudes, other: Addition, before: Model, one: CandidateFit) -> bool:
    """Of a candidate that does so beside the other addition, of the model before it."""
    if not analyse(one.fit).white:
        return False
    kept = [addition for addition in before.additions if addition is not other]
    problem = make_problem(magnitudes, before.records, [*kept, as_found(one)], before.roughness)
    return analyse(fit(problem, problem.narrowed(one.fit.layout, one.fit.point))).white


def _leaving_less(step: SelectionStep, cost: float) -> list[CandidateFit]:
    """The candidates that do, than what has that cost."""
    return [one for one in step.candidates if one.fit and one.fit.cost < cost]


def _leaves_next_to_nothing(step: SelectionStep) -> bool:
    """The best leaves less than the noise again, of much more: the rest may be the form of its law. Or, where it is no
    law of an element, of which two common ones may add up to it, practically nothing of far more."""
    if step.best is None:
        return False
    enough = THRESHOLDS.nearly_all if _near_the_floor(step) else THRESHOLDS.practically_all
    is_a_law = step.best.addition.effect.acts_on == "element"
    return (_near_the_floor(step) or not is_a_law) and step.share_removed > enough


def _comes_near(step: SelectionStep, rare: SelectionStep) -> bool:
    """A common one leaves as little; not where that is a share of the noise that counts, of which the rare one explains
    as much as is asked of what is named."""
    if step.best is None or not (_near_the_floor(step) or step.share_removed > THRESHOLDS.practically_all):
        return False
    next_to_none = analyse(step.best.fit).mean_square < 1.0 + THRESHOLDS.some
    noise = cost_of_noise(step.before.records)
    left, by_rare = (one.best.fit.cost - noise for one in (step, rare))
    return next_to_none or left - by_rare < THRESHOLDS.most * left


def _near_the_floor(step: SelectionStep) -> bool:
    return analyse(step.best.fit).mean_square < THRESHOLDS.near_floor
