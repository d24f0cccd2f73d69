"""The selection under other assumptions, where the first ones may be what is wrong: finer curves, other contacts.

A model file says neither how sharply a structure folds, nor, unless it is asked to, whether the damper beside a spring
that carries compression only may pull, and what still acts where that spring is spent.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain, islice
from typing import NamedTuple

import numpy as np

from ...effects.effect import Addition, Effect
from ...structure import Structure
from ..observation.record import ObservedRecord
from ..output_error.continuation import SLOW_CONTACT
from ..output_error.gauss_newton import Fit, fit
from ..output_error.problem import make_problem
from ..parameterization.magnitudes import CELLS, Magnitudes, measure_magnitudes
from ..parameterization.model_terms import additions_of
from ..residuals.residuals import Residuals, analyse
from ..residuals.score_test import drift_of
from ..residuals.vibration import vibrates_from
from .acceptance import cost_of_noise, share_removed
from .contacts import all_when_spent, elastic_when_spent, moves_otherwise, never_pulling
from .fitted_model import Model, fit_given, fit_model, forces_jump
from .forward_selection import first_step, forward_selection
from .pruning import up_to_the_least_error
from .rare_effects import found_as_common
from .search_limit import search_is_over
from .selection_step import SelectionStep, sized_models
from .thresholds import THRESHOLDS

FINER_CELLS = 2 * CELLS
"""Cells of half the width, where what is left may be folds that those are too wide for."""


class SelectionPath(NamedTuple):
    """What a selection has found."""

    structure: Structure  # as it was assumed
    steps: list[SelectionStep]
    final: Model
    as_recorded: Fit  # of the final model, in the sensors' noise
    records: Sequence[ObservedRecord]  # in the band that was compared
    cells: int  # of the final model's curves
    whole: bool = True  # False: it ends before its first addition, as other assumptions promise more

    @property
    def noise(self) -> bool:
        """The final model leaves nothing else, and nothing that varies with time."""
        return self.final.white and drift_of(self.as_recorded).constant

    @property
    def added(self) -> Sequence[Addition]:
        return self.final.found

    @property
    def furthest(self) -> Fit:
        """In the sensors' noise: of the final model, or of the best first candidate where none was added yet."""
        best = None if self.whole else self.steps[0].best
        return best.fit if best else self.as_recorded

    def rank(self) -> tuple[bool, bool, float]:
        """Of paths under different assumptions the largest is believed."""
        return self.final.white, self.whole, self.furthest.evidence


def select(structure: Structure, records: Sequence[ObservedRecord], effects: Mapping[str, Effect]) -> SelectionPath:
    """The effects that a structure lacks, in the band below its vibration. Raises ModelError where it names an effect
    that there is not."""
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
            asked, answers = path, {one: _promised(other, path, path.records) for one, other in others.items()}
        return {one: answers[one] for one in others if answers[one] > -np.inf}

    tried = [structure]
    untried: list[Callable[[Structure], Structure]] = [never_pulling, elastic_when_spent, all_when_spent]
    path = _as_exact_as_needed(structure, records, effects, lambda begun: _rings(begun) or bool(promised(begun)))
    while untried and not search_is_over() and (others := promised(path)):
        best = max(others, key=others.__getitem__)
        untried.remove(best)
        otherwise = _as_exact_as_needed(best(path.structure), path.records, effects, _rings)
        tried.append(otherwise.structure)
        path = max(path, otherwise, key=SelectionPath.rank)
    return path


def first_believed(path: SelectionPath) -> SelectionPath:
    """Up to as many additions as are believed together, where all of them leave more than noise, or where these leave
    next to nothing: the first ones explain most, and what came after them only goes on from there."""
    most = THRESHOLDS.most_at_once
    if len(path.added) <= most:
        return path
    final = path.steps[most].before
    if path.final.white and share_removed(path.steps[0].before.residuals, final.residuals) < THRESHOLDS.all_but_folds:
        return path
    return up_to(path, most)


def up_to(path: SelectionPath, count: int) -> SelectionPath:
    """With the first of its additions only."""
    steps = path.steps[: count + 1]
    final = steps[-1].before
    as_recorded = in_the_sensors_noise(steps[-1].sized, path.records)
    return path._replace(steps=steps, final=final, as_recorded=as_recorded)


def _promised(other: Structure, path: SelectionPath, records: Sequence[ObservedRecord]) -> float:
    """Nats: the evidence of what was found, under contacts as they are assumed otherwise; -inf where nothing is
    missing, where they would explain none of it, or less than what leaves noise already.

    Taken the wrong way, a damper that pulls looks like another effect.
    """
    final = path.final
    if other == path.structure or (not path.added and final.white):
        return -np.inf
    magnitudes = measure_magnitudes(other, records, path.cells)
    models = [step.before for step in path.steps]
    models = models if models[-1] is final else [*models, final]
    found = ((model.additions, in_the_sensors_noise(model, records)) for model in models)
    felt = ((additions, one) for additions, one in found if moves_otherwise(one, other))
    likely = ((additions, one) for additions, one in _likely(path) if moves_otherwise(one, other))
    first = max((one.fit.evidence for one in path.steps[0].as_recorded[:1] if one.fit), default=-np.inf)
    most, seen = -np.inf, set()
    for additions, as_recorded in chain(felt, islice(likely, THRESHOLDS.few)):
        what = frozenset((one.key, one.variant) for one in additions)
        if what in seen:
            continue
        seen.add(what)
        otherwise = _fitted_slowly(magnitudes, records, additions)
        misfit = 0.5 * max(as_recorded.cost - cost_of_noise(records), 0.0)  # nats
        # what stays behind the best of all must gain most of what it lacked
        share = THRESHOLDS.least_share if otherwise.evidence > first else THRESHOLDS.leading_share
        if otherwise.evidence > as_recorded.evidence + THRESHOLDS.gain + share * misfit:
            most = max(most, otherwise.evidence)
    if final.white and len(path.added) <= THRESHOLDS.most_at_once:
        return most if most > path.as_recorded.evidence else -np.inf
    return most if most > first or not path.whole else -np.inf


def _fitted_slowly(magnitudes: Magnitudes, records: Sequence[ObservedRecord], additions: Sequence[Addition]) -> Fit:
    """With care for forces that jump at a contact."""
    problem = make_problem(magnitudes, records, additions)
    found = fit(problem)
    if not forces_jump(problem.layout):
        return found
    return max(found, fit(problem, found.point, SLOW_CONTACT), key=lambda one: one.evidence)


def _likely(path: SelectionPath) -> Iterator[tuple[Sequence[Addition], Fit]]:
    """The best first candidates, as another than the right one may have come first, in all their forms; where one
    leaves noise, those that explain nearly as much."""
    first = path.steps[0]
    magnitudes = measure_magnitudes(path.structure, path.records, path.cells)
    fitted = [one for one in first.as_recorded if one.fit]
    if path.final.white:
        fitted = [one for one in fitted if one.gain > (1.0 - THRESHOLDS.least_share) * fitted[0].gain]
    for one in fitted:  # from where it began: what it has come to may be what made up for the contact
        yield (*first.before.additions, one.addition), one.fit
        for other in _in_other_forms(one.addition):
            additions = (*first.before.additions, other)
            yield additions, fit(make_problem(magnitudes, path.records, additions))


def _in_other_forms(addition: Addition) -> Iterator[Addition]:
    """With the same constants: the form that leaves least under some contacts may be another one than under others."""
    effect = addition.effect
    alike = (v for v in effect.variants if v != addition.variant and [*effect.shapes_of(v)] == [*addition.shapes])
    yield from (replace(addition, variant=variant) for variant in alike)


def _as_exact_as_needed(
    structure: Structure, records: Sequence[ObservedRecord], effects: Mapping[str, Effect],
    elsewhere: Callable[[SelectionPath], bool] = lambda path: False,
) -> SelectionPath:  # fmt: skip
    """Masses and zeros are as stated, unless nothing but noise is left with errors of them such as scales and sensors
    have: by the model as given, or with fewer effects than were found.

    elsewhere: whether other assumptions promise more than a first step does.
    """
    magnitudes, given = as_given(structure, records, effects)
    if records[0].in_doubt:
        return _with_curves_as_fine_as_needed(magnitudes, given, effects, elsewhere)
    doubted = magnitudes._replace(records=[record._replace(in_doubt=True) for record in records])
    start, path = _in_doubt(doubted, given), None
    if not _leaves_noise(start):
        path = _with_curves_as_fine_as_needed(magnitudes, given, effects, elsewhere)
        models = [step.before for step in path.steps if step.before is not given]
        models += [] if path.steps[-1].before is path.final else [path.final]
        fewer = (_in_doubt(doubted, model) for model in models if not (model is path.final and path.noise))
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


def _in_doubt(doubted: Magnitudes, model: Model) -> Model:
    """The model where masses and zeros may err."""
    problem, start = make_problem(doubted, doubted.records, model.additions), None
    if [link.curve and len(link.curve.knots) for link in problem.layout.links] == [
        link.curve and len(link.curve.knots) for link in model.fit.layout.links
    ]:  # else its curves are finer, or reach elsewhere
        theta = problem.widened(model.fit.layout, model.fit.theta)
        start = problem.moved(theta, model.fit.trajectories)
    return fit_model(doubted, doubted.records, model.additions, start)


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
        begun = SelectionPath(structure, [first], given, given.fit, records, cells, whole=False)
        if elsewhere(begun):
            return begun
    steps, final = forward_selection(magnitudes, effects, given, first)
    as_recorded = in_the_sensors_noise(sized_models(steps, final)[-1], records)
    finer = measure_magnitudes(structure, records, FINER_CELLS)
    mimicked = final.white and not drift_of(as_recorded).constant
    if not search_is_over() and _wants_finer_curves(final, mimicked, analyse(as_recorded), finer):
        finer_given = fit_given(finer, records, final.given)
        finer_first = first_step(finer, effects, finer_given)
        finer_steps, finer_final = forward_selection(finer, effects, finer_given, finer_first)
        fewer = len(finer_final.additions) < len(final.additions) or not final.white
        if finer_final.white and (fewer or (mimicked and drift_of(finer_final.fit).constant)):
            steps, final, cells = finer_steps, finer_final, finer.cells
            as_recorded = in_the_sensors_noise(sized_models(steps, final)[-1], records)
    steps, reported = up_to_the_least_error(steps, final)
    if reported is not final:
        final, as_recorded = reported, in_the_sensors_noise(sized_models(steps, reported)[-1], records)
    return SelectionPath(structure, steps, final, as_recorded, records, cells)


def _wants_finer_curves(final: Model, mimicked: bool, residuals: Residuals, finer: Magnitudes) -> bool:
    """Whether folds of a curve that its cells are too wide for may be what is left, or what several effects stand for.

    mimicked: what the final model leaves varies with time, though it is white; residuals: its in the sensors' noise.
    """

    def refined(additions: Sequence[Addition]) -> Model:
        return fit_model(finer, finer.records, additions)

    if len(final.found) > 1 and any(refined((*final.given, one)).white for one in final.found):
        return True
    if mimicked:
        return drift_of(refined(final.additions).fit).constant
    if final.white or residuals.mean_square >= THRESHOLDS.near_floor:
        return False
    return refined(final.additions).white


def in_the_sensors_noise(model: Model, records: Sequence[ObservedRecord]) -> Fit:
    """The model's fit; made again where that was in a larger noise."""
    problem = model.fit.problem
    return fit(problem.on(records), model.fit.point) if problem.noise_is_inflated else model.fit
