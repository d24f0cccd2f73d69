"""Sequential replacement: each of two effects is sought anew beside the other, as the first was found while the second
was missing (Miller, Subset Selection in Regression, 2nd edition 2002, chapter 3)."""

from collections.abc import Mapping, Sequence

from ...effects.effect import Addition, Effect
from ..parameterization.magnitudes import Magnitudes
from ..residuals.residuals import analyse
from .acceptance import share_removed
from .candidate_fits import CandidateFit
from .fitted_model import Model, fit_model
from .pair_search import Pair, likely, seconds_beside
from .search_limit import search_is_over
from .selection_step import SelectionStep, added, as_fitted, as_found
from .thresholds import THRESHOLDS


def replaced(
    magnitudes: Magnitudes, effects: Mapping[str, Effect], given: Model, path: Sequence[SelectionStep], final: Model
) -> Pair | None:
    """Two that leave only noise, or next to nothing of what is left, in the place of those that were found one after
    the other; where those leave only noise, too, two that are likelier by as much as counts. None where there are none.

    given: the model without either; path: the steps that have led to the final model.
    """
    two = _two_that_explain_most(path, final)
    if len(two) < 2 or search_is_over():
        return None

    def alone(addition: Addition) -> CandidateFit:
        model = fit_model(magnitudes, given.records, [*given.additions, addition])
        return CandidateFit(addition, model.fit.evidence - given.fit.evidence, model.fit)

    def instead(both: Model) -> bool:
        if final.white and not final.fit.problem.noise_is_inflated:
            return both.white and both.fit.evidence > final.fit.evidence + THRESHOLDS.gain
        return both.white or (not final.white and _leaves_next_to_nothing(final, both))

    before, kept = two
    for _ in range(THRESHOLDS.few):
        first = alone(kept)
        larger, seconds = seconds_beside(magnitudes, effects, given, first)
        best = next(iter(likely(seconds)), None)
        if best is None or best.addition.key == before.key:
            return None
        both = added(magnitudes, larger, best)
        if instead(both):
            other = alone(as_found(best))
            if other.gain > first.gain:  # what explains more comes first
                turned = fit_model(magnitudes, given.records, [*given.additions, other.addition, kept])
                if instead(turned):
                    last = CandidateFit(kept, turned.fit.evidence - other.fit.evidence, turned.fit)
                    first, larger, both, seconds = other, as_fitted(given, other), turned, [last]
            # those ahead of it alone are not beside the second
            rest = [
                one for one in path[0].as_recorded if one.gain < first.gain and one.addition.key != first.addition.key
            ]
            return Pair(both, [SelectionStep(given, [first, *rest]), SelectionStep(larger, seconds)])
        before, kept = kept, best.addition
    return None


def _two_that_explain_most(path: Sequence[SelectionStep], final: Model) -> Sequence[Addition]:
    """The first that was found, and the best beside it, believed or not, unless they leave what a real structure does
    of any two."""
    if final.white or len(path) < 2:
        return final.found if len(final.found) == 2 else ()
    step = path[1]
    second = next(iter(likely([*step.doubted, *step.as_recorded])), None)
    if second is None or analyse(second.fit).mean_square >= THRESHOLDS.real_structure:
        return ()
    return step.before.found[0], as_found(second)


def _leaves_next_to_nothing(found: Model, both: Model) -> bool:
    """Less than the noise again, of what was left by those found one by one: the rest may be the form of a law."""
    near = both.residuals.mean_square < THRESHOLDS.near_floor
    return near and share_removed(found.residuals, both.residuals) > THRESHOLDS.nearly_all
