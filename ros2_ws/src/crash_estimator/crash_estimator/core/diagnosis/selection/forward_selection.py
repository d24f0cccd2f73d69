"""Forward selection: fit the candidates, add the best, until nothing is left or nothing helps."""

from collections.abc import Mapping, Sequence

from ...effects.effect import Effect
from ..parameterization.magnitudes import Magnitudes
from ..residuals.in_band import in_band
from .acceptance import better, explains_too_little, needed_gain, share_explained, share_removed
from .candidate_fits import CandidateFit
from .even_fit import evenly_fitted
from .fitted_model import Model
from .pair_search import two_at_once, two_of_one_effect
from .pruning import up_to_the_least_error, without_the_superseded
from .rare_effects import common_effects, effects_beside, elsewhere_than, is_rare, with_rare_ones
from .search_limit import search_is_over
from .selection_step import (
    SelectionStep,
    added,
    as_fitted,
    band_of_steps,
    in_recorded_noise,
    only_screened,
    weighed,
    weighed_beside_a_second,
)
from .sequential_replacement import replaced
from .thresholds import THRESHOLDS


def first_step(magnitudes: Magnitudes, effects: Mapping[str, Effect], given: Model) -> SelectionStep:
    """All candidates for a first addition to the model that is given."""
    common = common_effects(magnitudes.structure, effects)
    return with_rare_ones(magnitudes, effects, in_recorded_noise(magnitudes, common, given))


def forward_selection(
    magnitudes: Magnitudes, effects: Mapping[str, Effect], given: Model, first: SelectionStep
) -> tuple[list[SelectionStep], Model]:
    """All steps, and the last model; given: what it starts from, first: its `first_step`."""
    path, final = _one_by_one(magnitudes, effects, given, [], first)
    if others := replaced(magnitudes, effects, given, path, final):
        return _one_by_one(magnitudes, effects, *others)
    next_to_nothing = share_removed(given.residuals, final.residuals) > THRESHOLDS.nearly_all
    if final.white or next_to_nothing or search_is_over():
        return path, final
    firsts = [*first.doubted[:1], *first.as_recorded]
    one_is_enough = first.leaves_noise or first.share_removed > THRESHOLDS.nearly_all
    alike = [] if one_is_enough else two_of_one_effect(magnitudes, given, first.candidates)
    pair = two_at_once(magnitudes, effects, given, firsts, alike, _followed(path))
    if pair is None:
        return path, final
    other = _one_by_one(magnitudes, effects, *pair)
    if other[1].white:
        return other
    paths = [up_to_the_least_error(*one) for one in (other, (path, final))]
    return min(paths, key=lambda one: one[1].residuals.mean_square)


def _one_by_one(
    magnitudes: Magnitudes, effects: Mapping[str, Effect], model: Model, path: list[SelectionStep],
    first: SelectionStep | None = None,
) -> tuple[list[SelectionStep], Model]:  # fmt: skip
    """The best candidate is added as long as there is one; path: the steps that have led to the model, first: the next
    one in the sensors' noise, where it is known."""
    common, evenly = common_effects(magnitudes.structure, effects), None
    while not (path and search_is_over()):
        if first is None:
            rare = any(map(is_rare, model.found))
            beside = effects_beside(model.found, magnitudes.structure, effects) if rare else common
            first = _next_step(magnitudes, beside, model, path)
            if not rare and len(model.found) < THRESHOLDS.most_at_once:
                first = with_rare_ones(magnitudes, effects, first, model.found)
        if not path and _none_leads(first):
            once = weighed(magnitudes, common, first, noises=1)
            if _none_leads(once):
                return [once], once.before
        done = weighed(magnitudes, common, first, path, evenly)
        if not path:
            done = weighed_beside_a_second(magnitudes, common, first, done)
        first = None
        path.append(done)
        fair = _without(model, done.best) if done.best and done.before is model else model
        if better(fair, model) and not search_is_over():
            # the candidate's fit has shown a better one of the model without it
            model, path = fair, path[:-1]
            continue
        needed = needed_gain(model)
        if done.best is None or done.best.gain < needed or len(path) > THRESHOLDS.few:
            # where the noise had to be taken larger, the model before the step is the one fitted with it
            return without_the_superseded(magnitudes, path, done.before)
        if _errs_by_little(path):
            return path, done.before
        larger = added(magnitudes, model, done.best)
        evenly = None if larger.white else evenly_fitted(as_fitted(done.before, done.best), band_of_steps(path), larger)
        if evenly and explains_too_little(done.sized, evenly, band_of_steps(path)):
            return path, done.before
        model = larger
    return without_the_superseded(magnitudes, path, model)


def _followed(path: Sequence[SelectionStep]) -> tuple[str, str] | None:
    """Effect and target of the first addition, where a second one was looked for beside it."""
    looked_for = len(path) > 1 and any(one.fit for one in path[1].candidates)
    return path[1].before.found[0].key if looked_for else None


def _none_leads(step: SelectionStep) -> bool:
    """Whether no candidate explains so much that it could be named, or lead to what could: two at once still may."""
    far = THRESHOLDS.near_floor <= step.before.residuals.mean_square < THRESHOLDS.real_structure
    return far and not step.leaves_noise and _all_explain_less(step, THRESHOLDS.half)


def _next_step(
    magnitudes: Magnitudes, effects: Mapping[str, Effect], model: Model, path: Sequence[SelectionStep]
) -> SelectionStep:
    """All candidates for one more addition; only screened where none would be believed beside those found: beside a
    rare one or beyond two only one that leaves noise is, and none that removes next to nothing, but of what a real
    structure leaves, where the sensors' noise counts for little."""
    found, tried = model.found, []
    rare = [one for one in found if is_rare(one)]
    only_to_noise = len(found) >= THRESHOLDS.most_at_once or rare
    far_from_noise = model.residuals.mean_square >= THRESHOLDS.real_structure
    if not (only_to_noise and far_from_noise):
        step = in_recorded_noise(magnitudes, effects, model)
        tried = step.candidates[:1]
        step = elsewhere_than(magnitudes, rare, step) if rare else step
        in_vain = only_to_noise or (found and not far_from_noise and _all_explain_less(step, THRESHOLDS.some, path))
        if step.leaves_noise or not in_vain:
            return step
    return only_screened(magnitudes, effects, model, tried)


def _all_explain_less(step: SelectionStep, share: float, path: Sequence[SelectionStep] = ()) -> bool:
    """All candidates that were fitted; path: the steps before."""
    before, band = step.before, band_of_steps([*path, step])
    fitted = (as_fitted(before, one) for one in step.candidates if one.fit)
    return all(share_explained(before, larger, band) < share for larger in fitted)


def _errs_by_little(path: Sequence[SelectionStep]) -> bool:
    """Whether the best of the last step is an error of a channel or of a stated speed, of so little weight beside what
    was found before that it may be the form of that: a sensor that lags by t shows a spring k as a damper of - k t, and
    six of twelve simulated foams whose unloading is of no form that is known were told a speed 4 to 7 % off.

    Only where more than noise is left; what a structure leaves in the band is of no form that is known.
    """
    first, last = path[0], path[-1]
    effect = last.best.addition.effect
    if not ((effect.distorts or effect.changes_start) and last.before.fit.problem.noise_is_inflated):
        return False
    left, given = (in_band(one.sized.fit, one.sized.residuals, band_of_steps(path)) for one in (last, first))
    return left.share_explained(given) > THRESHOLDS.nearly_all


def _without(model: Model, found: CandidateFit) -> Model:
    """The model refitted from where a candidate's fit has ended."""
    start = model.fit.problem.narrowed(found.fit.layout, found.fit.point)
    return model.refitted(start, hopeless=model.fit.cost)
