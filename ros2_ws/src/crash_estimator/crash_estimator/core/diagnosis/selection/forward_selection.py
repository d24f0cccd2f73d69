"""Forward selection: fit the candidates, add the best, until nothing is left or nothing helps."""

from collections.abc import Mapping

from ...effects.effect import Effect
from ..parameterization.magnitudes import Magnitudes
from ..residuals.residuals import analyse
from .acceptance import better, explains_too_little, needed_gain
from .candidate_fits import CandidateFit
from .fitted_model import Model
from .pair_search import two_at_once
from .pruning import up_to_the_least_error, without_the_superseded
from .selection_step import SelectionStep, added, selection_step
from .thresholds import THRESHOLDS
from .time_limit import out_of_time


def forward_selection(
    magnitudes: Magnitudes, effects: Mapping[str, Effect], given: Model
) -> tuple[list[SelectionStep], Model]:
    """All steps, and the last model; given: what it starts from."""
    present = given.additions
    path, final = _one_by_one(magnitudes, effects, given, [], len(present))
    if final.white or out_of_time():
        return path, final
    pair = two_at_once(magnitudes, effects, given, path[0].as_recorded)
    if pair is None:
        return path, final
    other = _one_by_one(pair.magnitudes, effects, pair.model, pair.path, len(present))
    if other[1].white:
        return other
    paths = [up_to_the_least_error(*one, len(present)) for one in (other, (path, final))]
    return min(paths, key=lambda one: one[1].residuals.mean_square)


def _one_by_one(
    magnitudes: Magnitudes, effects: Mapping[str, Effect], model: Model, path: list[SelectionStep], present: int
) -> tuple[list[SelectionStep], Model]:
    """The best candidate is added as long as there is one; path: the steps that have led to the model."""
    while not (path and out_of_time()):
        done = selection_step(magnitudes, effects, model, path)
        path.append(done)
        fair = _without(model, done.best) if done.best and done.before is model else model
        if better(fair, model):
            # the candidate's fit has shown a better one of the model without it
            model, path = fair, path[:-1]
            continue
        needed = needed_gain(bool(model.additions[present:]) and model.white)
        if done.best is None or done.best.gain < needed or len(path) > THRESHOLDS.most_steps:
            # where the noise had to be taken larger, the model before the step is the one fitted with it
            return without_the_superseded(magnitudes, path, done.before, present)
        magnitudes, larger = added(magnitudes, model.records, model, done.best)
        if not larger.white:
            after = larger.residuals, analyse(done.best.fit)
            if explains_too_little(done.before.residuals, after):
                return path, done.before
        model = larger
    return path, model


def _without(model: Model, found: CandidateFit) -> Model:
    """The model refitted from where a candidate's fit has ended."""
    start = model.fit.problem.narrowed(found.fit.layout, found.fit.point)
    return model.refitted(start, hopeless=model.fit.cost)
