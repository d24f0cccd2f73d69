"""The selection under other assumptions, where the first ones may be what is wrong: finer curves, other contacts.

A model file says neither how sharply a structure folds, nor, unless it is asked to, whether the damper beside a spring
that carries compression only may pull, and what still acts where that spring is spent.
"""

from collections.abc import Callable, Mapping, Sequence
from itertools import tee

import numpy as np

from ...effects.effect import Addition, Effect
from ...structure import Structure
from ..observation.record import ObservedRecord
from ..output_error.problem import make_problem
from ..parameterization.magnitudes import CELLS, Magnitudes, measure_magnitudes
from ..parameterization.model_terms import additions_of
from ..residuals.residuals import Residuals, analyse
from ..residuals.score_test import drift_of
from ..residuals.vibration import vibrates_from
from .acceptance import cost_of_noise
from .contact_promise import likely_first, promised_by
from .contacts import all_when_spent, elastic_when_spent, never_pulling
from .fitted_model import Model, fit_given, fit_model
from .forward_selection import first_step, forward_selection
from .pruning import up_to_the_least_error
from .rare_effects import found_as_common
from .search_limit import search_is_over
from .selection_path import SelectionPath, in_the_sensors_noise
from .selection_step import models_of, sized_models
from .thresholds import THRESHOLDS
from .time_varying import likeliest_in_time

FINER_CELLS, FINEST_CELLS = 2 * CELLS, 4 * CELLS
"""Cells of half the width, where what is left may be folds that those are too wide for; of a quarter, where one stands
for little more than noise: the kink of a stiff stop within a free curve was told as a gap, which moves the knots onto
it. Of six looked-at such tests the model as given leaves noise with half the width in two, with a quarter in all."""


def select(structure: Structure, records: Sequence[ObservedRecord], effects: Mapping[str, Effect]) -> SelectionPath:
    """The effects that a structure lacks, in the band below its vibration. Raises ModelError where it names an effect
    that there is not."""
    path = _in_the_best_band(structure, records, effects)
    if not path.added or search_is_over():
        return path
    magnitudes, given = measure_magnitudes(path.structure, path.records, path.cells), path.steps[0].before
    as_recorded = in_the_sensors_noise(given, path.records)
    return path._replace(varying=likeliest_in_time(magnitudes, given, as_recorded, path.as_recorded.cost))


def _in_the_best_band(
    structure: Structure, records: Sequence[ObservedRecord], effects: Mapping[str, Effect]
) -> SelectionPath:
    path = _selected(structure, records, effects)
    if path.final.white or search_is_over():
        return path
    vibration, added = _vibration(path)
    if vibration == np.inf:
        return path
    below = [record.in_band(vibration) for record in records]
    in_band = _selected(path.structure, below, found_as_common(effects, added))
    return path if path.whole and search_is_over() and not in_band.final.white else in_band


def _rings(begun: SelectionPath) -> bool:
    return _vibration(begun)[0] < np.inf


def _vibration(path: SelectionPath) -> tuple[float, Sequence[Addition]]:
    """Hz from which on vibration is left, where that may be all and all was compared; and what else was found, or would
    be first."""
    left, best = analyse(path.furthest), None if path.whole else path.steps[0].best
    added = [best.addition] if best else path.added
    may_be_all = path.records[0].below == np.inf and left.mean_square < THRESHOLDS.near_floor
    return vibrates_from(left, path.records) if may_be_all else np.inf, added


def _selected(structure: Structure, records: Sequence[ObservedRecord], effects: Mapping[str, Effect]) -> SelectionPath:
    """Under the contacts that the structure states, then under those that promise most, until none does.

    Whether others promise more is asked after a first step that leaves more than noise already: one effect after the
    other, to make up for contacts that are not so, takes ten times as long. Contacts that are left then are not come
    back to: of 342 looked-at cases they were in 8, never with a better answer.
    """
    asked: SelectionPath | None = None  # the last one that others were compared with, and what they promised
    answers: dict[Callable[[Structure], Structure], float] = {}

    def promised(path: SelectionPath) -> dict[Callable[[Structure], Structure], float]:
        """Nats, by what can be assumed otherwise; without what promises nothing."""
        nonlocal asked, answers
        others = {one: other for one in untried if (other := one(path.structure)) not in tried}
        if path is not asked:
            likely = tee(likely_first(path), len(others))  # what one has fitted of it, the next ones need not
            pairs = zip(others.items(), likely, strict=True)
            asked, answers = path, {one: promised_by(other, path, again) for (one, other), again in pairs}
        return {one: answers[one] for one in others if answers[one] > -np.inf}

    tried = [structure]
    untried: list[Callable[[Structure], Structure]] = [never_pulling, elastic_when_spent, all_when_spent]
    path = _as_exact_as_needed(structure, records, effects, lambda begun: _rings(begun) or bool(promised(begun)))
    while untried and not (search_is_over() or path.given_up) and (others := promised(path)):
        best = max(others, key=others.__getitem__)
        untried.remove(best)
        otherwise = _as_exact_as_needed(best(path.structure), path.records, effects, _rings)
        tried.append(otherwise.structure)
        path = max(path, otherwise, key=SelectionPath.rank)
    return path


def _as_exact_as_needed(
    structure: Structure, records: Sequence[ObservedRecord], effects: Mapping[str, Effect],
    elsewhere: Callable[[SelectionPath], bool],
) -> SelectionPath:  # fmt: skip
    """Masses and zeros are as stated, unless nothing but noise is left with errors of them such as scales and sensors
    have: by the model as given, or with fewer effects than were found.

    elsewhere: whether other assumptions promise more than a first step does.
    """
    magnitudes, given = as_given(structure, records, effects)
    if records[0].in_doubt:
        return _with_curves_as_fine_as_needed(magnitudes, given, effects, elsewhere)
    doubted = magnitudes._replace(records=[record._replace(in_doubt=True) for record in records])
    most = THRESHOLDS.near_floor * cost_of_noise(records)  # what leaves more is no noise
    start, path = _in_doubt(doubted, given, most), None
    if not _leaves_noise(start):
        path = _with_curves_as_fine_as_needed(magnitudes, given, effects, elsewhere)
        models = [model for model in models_of(path.steps, path.final) if model is not given]
        fewer = (_in_doubt(doubted, model, most) for model in models if not (model is path.final and path.noise))
        if search_is_over() or not any(map(_leaves_noise, fewer)):
            return path
        start = _in_doubt(doubted, path.steps[0].before)  # a candidate's fit may have shown a better one
    other = _with_curves_as_fine_as_needed(doubted, start, effects)
    if path is None or (other.noise and (not path.noise or len(other.steps) < len(path.steps))):
        return other
    return path


def as_given(
    structure: Structure, records: Sequence[ObservedRecord], effects: Mapping[str, Effect]
) -> tuple[Magnitudes, Model]:
    magnitudes = measure_magnitudes(structure, records)
    return magnitudes, fit_given(magnitudes, records, additions_of(magnitudes, effects))


def _in_doubt(doubted: Magnitudes, model: Model, hopeless: float = np.inf) -> Model:
    """The model where masses and zeros may err; hopeless: as of `fit_model`."""
    problem, start = make_problem(doubted, doubted.records, model.additions), None
    if [link.curve and len(link.curve.knots) for link in problem.layout.links] == [
        link.curve and len(link.curve.knots) for link in model.fit.layout.links
    ]:  # else its curves are finer, or reach elsewhere
        theta = problem.widened(model.fit.layout, model.fit.theta)
        start = problem.moved(theta, model.fit.trajectories)
    return fit_model(doubted, doubted.records, model.additions, start, hopeless)


def _leaves_noise(model: Model) -> bool:
    """Nothing else, and nothing that varies with time."""
    return model.white and drift_of(model.fit).constant


def _with_curves_as_fine_as_needed(
    magnitudes: Magnitudes, given: Model, effects: Mapping[str, Effect],
    elsewhere: Callable[[SelectionPath], bool] = lambda path: False,
) -> SelectionPath:  # fmt: skip
    structure, records = magnitudes.structure, magnitudes.records
    cells, first = magnitudes.cells, first_step(magnitudes, effects, given)
    if not (first.leaves_noise or search_is_over()):
        varying = likeliest_in_time(magnitudes, given, given.fit)
        much_less = varying and varying.leaves_much_less([one.fit for one in first.as_recorded if one.fit])
        begun = SelectionPath(
            structure, [first], given, given.fit, records, cells, False, varying if much_less else None
        )
        if elsewhere(begun):
            return begun
        if much_less:
            return begun._replace(whole=True)
    steps, final = forward_selection(magnitudes, effects, given, first)
    searched, as_recorded = final, in_the_sensors_noise(sized_models(steps, final)[-1], records)
    mimicked = final.white and not drift_of(as_recorded).constant
    finer = None if search_is_over() else _with_finer_curves(magnitudes, given, final, mimicked, analyse(as_recorded))
    if finer:
        finer_given = fit_given(finer, records, final.given)
        finer_first = first_step(finer, effects, finer_given)
        finer_steps, finer_final = forward_selection(finer, effects, finer_given, finer_first)
        fewer = len(finer_final.additions) < len(final.additions) or not final.white
        if finer_final.white and (fewer or (mimicked and drift_of(finer_final.fit).constant)):
            steps, final, cells = finer_steps, finer_final, finer.cells
    steps, final = up_to_the_least_error(steps, final)
    if final is not searched:
        as_recorded = in_the_sensors_noise(sized_models(steps, final)[-1], records)
    return SelectionPath(structure, steps, final, as_recorded, records, cells)


def _with_finer_curves(
    magnitudes: Magnitudes, given: Model, final: Model, mimicked: bool, residuals: Residuals
) -> Magnitudes | None:
    """Where folds of a curve that its cells are too wide for may be what is left, or what effects stand for.

    mimicked: what the final model leaves varies with time, though it is white; residuals: its in the sensors' noise.
    """
    finer, finest = (
        measure_magnitudes(magnitudes.structure, magnitudes.records, cells) for cells in (FINER_CELLS, FINEST_CELLS)
    )

    def refined(additions: Sequence[Addition], by: Magnitudes = finer) -> Model:
        return fit_model(by, by.records, additions)

    little = any(link.curve for link in given.fit.layout.links) and given.residuals.mean_square < THRESHOLDS.near_floor
    if final.found and little and refined(final.given, finest).white:
        return finest
    if len(final.found) > 1 and any(refined((*final.given, one)).white for one in final.found):
        return finer
    if mimicked:
        return finer if drift_of(refined(final.additions).fit).constant else None
    if final.white or residuals.mean_square >= THRESHOLDS.near_floor:
        return None
    return finer if refined(final.additions).white else None
