"""The selection under other assumptions, where the first ones may be what is wrong: finer curves, dampers that push.

A model file says neither how sharply a structure folds, nor, unless it is asked to, whether the damper beside a spring
that carries compression only may pull until that is spent.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...effects.effect import Addition, Effect
from ...structure import Structure
from ..mechanics.linearization import linearise
from ..observation.record import ObservedRecord
from ..output_error.gauss_newton import Fit, fit
from ..parameterization.experiment import experiments_of
from ..parameterization.magnitudes import Magnitudes, measure_magnitudes
from ..parameterization.model_terms import additions_of
from ..residuals.residuals import Residuals, analyse
from ..residuals.vibration import vibrates_from
from .acceptance import share_removed
from .fitted_model import Model, fit_model
from .forward_selection import forward_selection
from .pruning import up_to_the_least_error
from .selection_step import SelectionStep
from .thresholds import THRESHOLDS
from .time_limit import out_of_time

CELLS = 36
"""Of a free curve over its crush scale: 1 cm of a crush of 0.4 m, the length of a fold of a longitudinal."""

FINER_CELLS = 2 * CELLS


class SelectionPath(NamedTuple):
    """What a selection has found."""

    structure: Structure  # as it was assumed
    steps: list[SelectionStep]
    final: Model
    present: int  # additions that the structure had
    as_recorded: Fit  # of the final model, in the sensors' noise
    records: Sequence[ObservedRecord]  # in the band that was compared

    def rank(self) -> tuple[bool, float]:
        """Of paths under different assumptions the largest is believed."""
        return self.final.white, self.as_recorded.evidence


def select(structure: Structure, records: Sequence[ObservedRecord], effects: Mapping[str, Effect]) -> SelectionPath:
    """The effects that a structure lacks, in the band below its vibration. Raises ModelError where it names an effect
    that there is not."""
    path = _selected(structure, records, effects)
    if path.final.white or out_of_time():
        return path
    left = analyse(path.as_recorded)
    vibration = vibrates_from(left, records)
    if vibration == np.inf or left.mean_square >= THRESHOLDS.near_floor:
        return path
    return _selected(structure, [record.in_band(vibration) for record in records], effects)


def _selected(structure: Structure, records: Sequence[ObservedRecord], effects: Mapping[str, Effect]) -> SelectionPath:
    path = _as_exact_as_needed(structure, records, effects)
    pushing = never_pulling(structure)
    if pushing is not structure and not out_of_time() and _may_be_explained_by(pushing, path, records):
        path = max(path, _as_exact_as_needed(pushing, path.records, effects), key=SelectionPath.rank)
    return path


def first_believed(path: SelectionPath) -> SelectionPath:
    """Up to as many additions as are believed together, where all of them leave more than noise, or where these leave
    next to nothing: the first ones explain most, and what came after them only goes on from there."""
    most = THRESHOLDS.most_at_once
    if len(path.final.additions) - path.present <= most:
        return path
    final = path.steps[most].before
    if path.final.white and share_removed(path.steps[0].before.residuals, final.residuals) < THRESHOLDS.all_but_folds:
        return path
    as_recorded = in_the_sensors_noise(final, path.records)
    return path._replace(steps=path.steps[: most + 1], final=final, as_recorded=as_recorded)


def never_pulling(structure: Structure) -> Structure:
    """The structure whose dampers never pull where their element carries compression only; itself where none can."""
    if all(element.tension or not element.damper_pulls for element in structure.elements):
        return structure
    elements = (e if e.tension else replace(e, damper_pulls=False) for e in structure.elements)
    return replace(structure, elements=tuple(elements))


def _may_be_explained_by(pushing: Structure, path: SelectionPath, records: Sequence[ObservedRecord]) -> bool:
    """Something is missing, and contacts that never pull would explain some of it.

    Taken the wrong way, a damper that pulls looks like another effect.
    """
    final = path.final
    if len(final.additions) == path.present and final.white:
        return False
    magnitudes = measure_magnitudes(pushing, records, CELLS)
    samples = sum(record.bins * record.measured.shape[1] for record in records)
    models = [step.before for step in path.steps]
    for model in models if models[-1] is final else [*models, final]:
        pulling = in_the_sensors_noise(model, records)
        if not _contacts_pull(pulling):
            continue
        other = fit_model(magnitudes, records, model.additions).fit
        misfit = 0.5 * max(pulling.cost - samples, 0.0)  # nats
        if other.evidence > pulling.evidence + THRESHOLDS.gain + THRESHOLDS.least_share * misfit:
            return True
    return False


def _contacts_pull(fitted: Fit) -> bool:
    """Whether any does along the fitted motion; where none does, one that never pulls is the same."""
    problem = fitted.problem
    never = problem.layout._replace(links=tuple(replace(link, damper_pulls=False) for link in problem.layout.links))
    pairs = zip(problem.experiments, experiments_of(never, problem.records), fitted.trajectories, strict=True)
    for pulling, pushing, trajectory in pairs:
        rows = [linearise(experiment, fitted.theta, trajectory).rows for experiment in (pulling, pushing)]
        if not np.array_equal(*rows):
            return True
    return False


def _as_exact_as_needed(
    structure: Structure, records: Sequence[ObservedRecord], effects: Mapping[str, Effect]
) -> SelectionPath:
    """Masses and zeros are as stated, unless nothing but noise is left with errors of them such as scales and sensors
    have: by the model as given, or with fewer effects than were found."""
    magnitudes, given = _as_given(structure, records, effects)
    if records[0].in_doubt:
        return _with_curves_as_fine_as_needed(magnitudes, given, effects)
    doubted = [record.doubted() for record in records]
    doubtful = _white_in_doubt(magnitudes, given, doubted)
    path = None if doubtful else _with_curves_as_fine_as_needed(magnitudes, given, effects)
    if path:
        models = [step.before for step in path.steps[1:] if step.before is not path.final]
        models += [] if path.final.white else [path.final]
        if out_of_time() or not any(_white_in_doubt(magnitudes, model, doubted) for model in models):
            return path
    other = _with_curves_as_fine_as_needed(*_as_given(structure, doubted, effects), effects)
    if path is None or (other.final.white and (not path.final.white or len(other.steps) < len(path.steps))):
        return other
    return path


def _as_given(
    structure: Structure, records: Sequence[ObservedRecord], effects: Mapping[str, Effect]
) -> tuple[Magnitudes, Model]:
    magnitudes = measure_magnitudes(structure, records, CELLS)
    return magnitudes, fit_model(magnitudes, records, additions_of(structure, magnitudes, effects))


def _white_in_doubt(magnitudes: Magnitudes, model: Model, doubted: Sequence[ObservedRecord]) -> bool:
    """Whether a model leaves nothing but noise if masses and zeros may err."""
    if model.white or model.residuals.mean_square >= THRESHOLDS.real_structure:
        return model.white
    return fit_model(magnitudes._replace(records=doubted), doubted, model.additions).white


def _with_curves_as_fine_as_needed(
    magnitudes: Magnitudes, given: Model, effects: Mapping[str, Effect]
) -> SelectionPath:
    structure, records, present = magnitudes.structure, magnitudes.records, given.additions
    steps, final = forward_selection(magnitudes, effects, given)
    as_recorded = in_the_sensors_noise(final, records)
    finer = measure_magnitudes(structure, records, FINER_CELLS)
    if not out_of_time() and _wants_finer_curves(final, analyse(as_recorded), finer, len(present)):
        finer_steps, finer_final = forward_selection(finer, effects, fit_model(finer, records, present))
        fewer = len(finer_final.additions) < len(final.additions) or not final.white
        if finer_final.white and fewer:
            steps, final = finer_steps, finer_final
            as_recorded = in_the_sensors_noise(final, records)
    steps, reported = up_to_the_least_error(steps, final, len(present))
    if reported is not final:
        final, as_recorded = reported, in_the_sensors_noise(reported, records)
    return SelectionPath(structure, steps, final, len(present), as_recorded, records)


def _wants_finer_curves(final: Model, residuals: Residuals, finer: Magnitudes, present: int) -> bool:
    """Whether folds of a curve that its cells are too wide for may be what is left, or what several effects stand for.

    residuals: of the final model in the sensors' noise.
    """

    def refined(additions: Sequence[Addition]) -> Residuals:
        return fit_model(finer, finer.records, additions).residuals

    given, found = final.additions[:present], final.additions[present:]
    if len(found) > 1 and any(refined((*given, one)).white for one in found):
        return True
    if final.white or residuals.mean_square >= THRESHOLDS.near_floor:
        return False
    sharper = refined(final.additions)
    return sharper.white or share_removed(residuals, sharper) > THRESHOLDS.least_share


def in_the_sensors_noise(model: Model, records: Sequence[ObservedRecord]) -> Fit:
    """The model's fit; made again where that was in a larger noise."""
    problem = model.fit.problem
    return fit(problem.on(records), model.fit.point) if problem.noise_is_inflated else model.fit
