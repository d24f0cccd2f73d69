"""Additions that go again: superseded by later ones, or no part of an explanation."""

from collections.abc import Sequence

from ...effects.effect import Addition
from ..output_error.continuation import SMALL_STEPS
from ..output_error.gauss_newton import Fit, fit
from ..output_error.problem import make_problem
from ..parameterization.magnitudes import Magnitudes
from ..residuals.in_band import in_band
from ..residuals.residuals import analyse
from .fitted_model import Model
from .selection_step import SelectionStep, band_of_steps, fit_stated, models_of, sized_models
from .thresholds import THRESHOLDS


def without_the_superseded(
    magnitudes: Magnitudes, path: list[SelectionStep], final: Model
) -> tuple[list[SelectionStep], Model]:
    """An effect added first may have stood for one that was found later: what the evidence can spare goes again.

    That is one of which noise is left without it, too, and which gains no more than chance; or which gains nothing.
    Where more than noise is left anyway, only what has ended at nothing is asked.
    """
    given, number = final.given, 0
    while number < len(final.found) - 1:
        found = final.found
        if not (final.white or _is_zero(found[number], final.fit)):
            number += 1
            continue
        fewer = found[:number] + found[number + 1 :]
        smaller = _refitted(magnitudes, given + fewer, final)
        if final.fit.evidence - smaller.fit.evidence > (THRESHOLDS.gain if smaller.white else 0.0):
            number += 1
            continue
        path = path[:number] + path[number + 1 :]
        models = [_refitted(magnitudes, given + fewer[:k], final) for k in range(len(fewer))] + [smaller]
        gains = [b.fit.evidence - a.fit.evidence for a, b in zip(models, models[1:], strict=False)] + [None]
        path = [_again(*each) for each in zip(path, models, gains, strict=False)]  # it may end before the last model
        final = smaller
    return path, final


def _refitted(magnitudes: Magnitudes, additions: Sequence[Addition], like: Model) -> Model:
    """Fitted with the other, larger model's hyperparameters, so that evidences compare; from where that one has ended,
    and, as it may have been led astray, from the measured motion."""
    problem = make_problem(magnitudes, like.records, additions, like.roughness)
    from_there = problem.narrowed(like.fit.layout, like.fit.point)
    fits = (fit(problem, from_there), fit(problem), fit(problem, schedule=SMALL_STEPS))
    found = max(fits, key=lambda one: one.evidence)
    return Model(tuple(additions), found, analyse(found, sharply=True), like.roughness)


def _again(step: SelectionStep, before: Model, gain: float | None) -> SelectionStep:
    best, *others = step.candidates
    return step._replace(before=before, candidates=[best if gain is None else best._replace(gain=gain), *others])


def up_to_the_least_error(path: Sequence[SelectionStep], final: Model) -> tuple[list[SelectionStep], Model]:
    """The steps, and the last model, up to the one that leaves the least, and while each addition is more than nothing.

    What leaves white noise stands as it is. In a noise as large as the misfit a fit can end where the evidence is
    better and the error is not: what comes after the least error is no part of an explanation.
    """
    if final.white:
        return list(path), final
    models = models_of(path, final)
    told = sized_models(path, final)[: 1 + len(final.found)]
    errors = [in_band(one.fit, one.residuals, band_of_steps(path)).rms for one in told]
    last = errors.index(min(errors))
    nothing = (_is_zero(step.candidates[0].addition, fit_stated(step, final)) for step in path[:last])
    last = next((k for k, is_nothing in enumerate(nothing) if is_nothing), last)
    return (list(path[: last + 1]), models[last]) if last < len(errors) - 1 else (list(path), final)


def _is_zero(addition: Addition, fitted: Fit) -> bool:
    """An addition whose coefficient has ended there; beside a body's curve, its mass may."""
    return not addition.touches and fitted.theta[fitted.layout.term(addition).coefficient] == 0.0
