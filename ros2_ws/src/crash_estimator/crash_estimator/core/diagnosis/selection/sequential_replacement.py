"""Sequential replacement: each of two effects is sought anew beside the other, as the first was found while the second
was missing (Miller, Subset Selection in Regression, 2nd edition 2002, chapter 3)."""

from collections.abc import Mapping, Sequence

import numpy as np

from ...effects.effect import Addition, Effect
from ..parameterization.magnitudes import Magnitudes
from ..residuals.residuals import analyse
from .acceptance import cost_of_noise
from .candidate_fits import CandidateFit, fit_candidates
from .fitted_model import Model, fit_model
from .pair_search import Pair, leaves_next_to_nothing, likely
from .rare_effects import effects_beside
from .search_limit import search_is_over
from .selection_step import SelectionStep, added, as_found, on_trial
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
    as_likely = final.white and not final.fit.problem.noise_is_inflated
    least = final.fit.evidence + THRESHOLDS.gain if as_likely else -np.inf
    before, kept = two
    for _ in range(THRESHOLDS.few):
        alone = fit_model(magnitudes, given.records, [*given.additions, kept])
        first = CandidateFit(kept, alone.fit.evidence - given.fit.evidence, alone.fit)
        wider, larger = on_trial(magnitudes, given, first)
        beside = effects_beside([kept], magnitudes.structure, effects)
        seconds = fit_candidates(wider, beside, larger, least=cost_of_noise(given.records))
        best = next(iter(likely(seconds)), None)
        if best is None or best.addition.key == before.key:
            return None
        widest, both = added(wider, larger, best)
        better = both.white and both.fit.evidence > least
        if better or (not final.white and leaves_next_to_nothing(final, both)):
            # those ahead of it alone are not beside the second
            others = [one for one in path[0].as_recorded if one.addition.key != kept.key and one.gain < first.gain]
            return Pair(widest, both, [SelectionStep(given, [first, *others]), SelectionStep(larger, seconds)])
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
