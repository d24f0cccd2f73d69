"""Which physical effect is missing: the answer, from a structure and one or more recordings of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import isclose
from typing import NamedTuple

from crash_replay.recording import Recording

from ...derived_motion import with_accelerations
from ...effects import EFFECTS
from ...effects.effect import Addition, Effect
from ...sensor_faults import without_faults
from ...structure import ModelError, Structure
from ..observation.record import ObservedRecord, refuse_dead_channels, refuse_twins
from ..output_error.gauss_newton import Fit
from ..residuals.in_band import in_band
from ..residuals.misfit_windows import MisfitWindow, misfit_windows
from ..residuals.residuals import analyse, free_run, noise_floor
from ..residuals.score_test import Drift, drift_of
from ..selection.acceptance import needed_share, settled
from ..selection.fitted_model import Model
from ..selection.onset_search import select_from_the_onset
from ..selection.search_limit import limit_text, search_is_over, search_limit
from ..selection.selection_path import SelectionPath, up_to
from ..selection.selection_step import band_of_steps, fit_stated, sized_models
from ..selection.thresholds import THRESHOLDS
from ..selection.time_zero import TimeZero
from ..selection.wrong_description import wrong_description
from .fitted_constants import FittedConstant, fitted_constants
from .left import Left, left_by
from .ranking import Ranked, Rms, StepReport, ranking_of, step_of
from .remarks import remarks_on, with_assumed_noise
from .time_zero_step import TIME_ZERO, as_ranked, time_zero_step
from .tolerance import DEFAULT, Tolerance
from .verdict import ADEQUATE, EFFECT_MISSING, UNEXPLAINED, Evidence, verdict_on
from .verdict_text import verdict_text


@dataclass(frozen=True)
class Diagnosis:
    """What was found; `as_json` is the contract of `diagnose --json`."""

    verdict: str  # effect_missing, adequate or unexplained
    complete: bool  # what is left is noise, or within the tolerance
    left: Left  # with what was added
    left_before: Left  # as given, in the same band
    noise: bool  # it is noise
    tolerance: Tolerance
    text: str  # one readable line
    residual_rms: Rms  # of the fit
    free_run_rms: Rms  # of a simulation from the initial motion alone
    ranking: tuple[Ranked, ...]  # of the first step, best first
    steps: tuple[StepReport, ...]  # effects added, in order
    remaining: tuple[Ranked, ...]  # what was left of the candidates in the last step
    constants: tuple[FittedConstant, ...]  # of the structure, with what was added
    misfit: tuple[MisfitWindow, ...]  # of the structure as it was given
    misfit_after: tuple[MisfitWindow, ...]
    structure: Structure  # with the effects that were added
    models: tuple[Model, ...]  # as given, then after each step
    stopped: bool = False  # before everything was tried

    @property
    def effects_added(self) -> tuple[StepReport, ...]:
        """The steps that the structure has: a time zero, and what is wrong in one recording, are the recordings'."""
        return tuple(step for step in self.steps if step.effect != TIME_ZERO and not step.recording)

    def as_json(self) -> dict:
        return {
            "verdict": self.verdict,
            "complete": self.complete,
            "left": self.left.as_json() | {"noise": self.noise},
            "tolerance": self.tolerance._asdict(),
            "stopped": self.stopped,
            "text": self.text,
            "residual_rms": vars(self.residual_rms),
            "free_run_rms": {k: v for k, v in vars(self.free_run_rms).items() if v is not None},
            "ranking": [ranked.as_json() for ranked in self.ranking],
            "steps": [vars(step) for step in self.steps],
            "constants": [constant._asdict() for constant in self.constants],
            "misfit": [window._asdict() for window in self.misfit],
            "misfit_after": [window._asdict() for window in self.misfit_after],
        }


def diagnose(
    structure: Structure,
    recordings: Sequence[Recording],
    effects: Mapping[str, Effect] = EFFECTS,
    tolerance: Tolerance = DEFAULT,
    seconds: float | None = None,
) -> Diagnosis:
    """Compare a structure (with the effects that it has) with recordings of it, and name what is missing.

    tolerance: what may be left of a model that is good enough; seconds: after which nothing more is tried (inf: all is
    tried); None: after `LONGEST_SEARCH` iterations instead.

    Raises ModelError or RecordingError, one line, where the data or the model is at fault.
    """
    if not recordings:
        raise ModelError("a diagnosis needs at least one recording")
    refuse_twins(recordings)
    recordings, faults = without_faults(recordings)
    stated = structure, recordings
    structure, recordings = with_accelerations(structure, recordings)
    for recording in recordings:
        refuse_dead_channels(structure, recording)
    with search_limit(seconds):
        begun = select_from_the_onset(structure, recordings, effects)
        stopped = search_is_over()
    found = _answer(structure, begun.path, tolerance, begun.zero)
    # what is stopped after so many iterations has time for that; where only noise is left, nothing is wrong
    asked = found.verdict != ADEQUATE and not found.noise and not (stopped and seconds)
    wrong = wrong_description(*stated, begun.path, effects) if asked else ""
    if begun.zero and TIME_ZERO not in [step.effect for step in found.steps]:
        begun = begun._replace(zero=None, taken=begun.zero.shifts)
    remarks = [one for one in (faults, wrong) if one]
    remarks += remarks_on(begun, found.verdict == EFFECT_MISSING, found.left)
    if stopped:
        remarks.append(f"stopped after {limit_text(seconds)}: not everything was tried{_so_far(found)}")
        remarks += ["signs and units of the channels were not looked at"] if seconds else []
    return replace(found, stopped=stopped, text="; ".join([found.text, *remarks]))


def _so_far(found: Diagnosis) -> str:
    """What leads where nothing was added in time."""
    leads = [one for one in found.ranking[:1] if one.evidence > THRESHOLDS.gain]
    if found.verdict != UNEXPLAINED or found.steps or not leads:
        return ""
    return f", and {leads[0].name} leads so far"


class _Told(NamedTuple):
    """What a path has found, in the terms of the contract, before a verdict is given on it."""

    given: Model  # from the stated time zero on
    models: tuple[Model, ...]  # as given, then after each step; where that is moved, first from the stated time zero
    runs: tuple[float, ...]  # RMS of the free run of each, m/s^2
    moved: tuple[StepReport, ...]  # the step to where the motion begins, if it is told
    added: tuple[StepReport, ...]  # one for each effect
    ranking: tuple[Ranked, ...]  # of the first step
    band: int | None  # CFC in which errors are told
    drift: Drift  # left by the last model

    @property
    def steps(self) -> tuple[StepReport, ...]:
        return (*self.moved, *self.added)

    @property
    def final(self) -> Model:
        return self.models[-1]


def _answer(structure: Structure, path: SelectionPath, tolerance: Tolerance, zero: TimeZero | None) -> Diagnosis:
    given = zero.as_stated if zero else path.steps[0].sized
    if tolerance.stated and tolerance.admits(left_by(given, band_of_steps(path.steps))):
        path, zero, given = up_to(path, 0), None, path.steps[0].sized  # whoever says so wants nothing added
    told = _told(given, path, zero)
    sure = _sure(told)
    if sure < len(path.added):
        return _answer(structure, up_to(path, sure), tolerance, zero)
    evidence = _evidence(path, told, structure)
    verdict = verdict_on(evidence, tolerance)
    if path.added and verdict.word == ADEQUATE:
        return _answer(structure, up_to(path, 0), tolerance, None)
    if len(path.added) > 1 and verdict.word == UNEXPLAINED:
        first = _answer(structure, up_to(path, 1), tolerance, zero)
        if first.verdict == EFFECT_MISSING:  # what came after it is no reason to doubt it
            return first
    final = told.final
    size = Rms(given.residuals.rms, final.residuals.rms, noise_floor(given.fit.layout, given.records))
    return Diagnosis(
        verdict=verdict.word,
        complete=verdict.complete,
        left=evidence.after,
        left_before=evidence.before,
        noise=evidence.noise and not evidence.loud,
        tolerance=tolerance,
        text=verdict_text(verdict, evidence, tolerance, told.steps, final, size, structure),
        residual_rms=size,
        free_run_rms=Rms(told.runs[0], told.runs[-1]),
        ranking=told.ranking,
        steps=told.steps,
        remaining=ranking_of(path.steps[-1]),
        constants=fitted_constants(_fit_of_all(path)),
        misfit=misfit_windows(given.fit.layout, given.records, given.residuals),
        misfit_after=misfit_windows(final.fit.layout, final.records, final.residuals),
        structure=_with_effects(path.structure, path.added, told.added),
        models=told.models,
    )


def _told(given: Model, path: SelectionPath, zero: TimeZero | None) -> _Told:
    """zero: the time zeros that recordings were moved to, which are told as the first step."""
    models, band, of_all = sized_models(path.steps, path.final), band_of_steps(path.steps), _fit_of_all(path)
    runs = tuple(free_run(model.fit).rms for model in models)
    pairs = zip(path.steps, pairwise(models), pairwise(runs), strict=False)  # the last step has added nothing
    added = tuple(step_of(step, *of, run, of_all) for step, of, run in list(pairs)[: len(path.added)])
    ranking, drift = ranking_of(path.steps[0]), _drift_left_by(path, models[-1])
    if zero is None:
        return _Told(given, models, runs, (), added, ranking, band, drift)
    runs = (free_run(given.fit).rms, *runs)
    moved = time_zero_step(zero, models[0], (runs[0], runs[1]))
    ranking = ranking if added else (as_ranked(moved), *ranking)
    return _Told(given, (given, *models), runs, (moved,), added, ranking, band, drift)


def _sure(told: _Told) -> int:
    """How many of the effects that were added are told: those before the first one within its standard deviation, if
    that is not the first of all, where more than noise is left."""
    if told.final.white and told.drift.constant:
        return len(told.added)
    within = (k for k, one in enumerate(told.added) if abs(one.coefficient) <= one.std)
    return next(within, 0) or len(told.added)


def _evidence(path: SelectionPath, told: _Told, structure: Structure) -> Evidence:
    before, after = left_by(told.given, told.band), left_by(told.final, told.band)
    from_there_on = told.models[len(told.moved) :]
    inflated = told.final.fit.problem.noise_is_inflated
    return Evidence(
        added=len(path.added) or len(told.steps),  # a time zero is none of the effects that may be too many
        white=told.final.white,
        drift=told.drift,
        before=before,
        after=after,
        ranking=told.ranking,
        further=[one for step in path.steps[1 : len(path.added)] for one in ranking_of(step)[:1]],
        weighed=inflated or after.share_explained(before) > THRESHOLDS.nearly_all,
        certain=_certain(path.added, told),
        by_first=_explained_by_first_effect(from_there_on, path.added, told.band),
        needed=needed_share(path.added),
        place_of=structure.place_of,
        assumed=bool(with_assumed_noise(path)),
        varying=path.rival_in_time,
        loud=_is_loud(told.final, path.records),
    )


def _is_loud(final: Model, records: Sequence[ObservedRecord]) -> bool:
    return final.residuals.rms > THRESHOLDS.near_floor**0.5 * noise_floor(final.fit.layout, records)


def _certain(added: Sequence[Addition], told: _Told) -> bool:
    """Every coefficient is beyond its standard deviation, and short of the largest that its effect can have: what a
    limit holds back stands for something else."""
    ends = [(step.coefficient, one.effect) for step, one in zip(told.added, added, strict=True)]
    held = any(isclose(found, limit) for found, effect in ends for limit in (effect.low, effect.high))
    return not held and all(abs(one.coefficient) > one.std for one in told.steps)


def _fit_of_all(path: SelectionPath) -> Fit:
    """That coefficients and constants are stated from: the last addition's, which has the others too."""
    steps = path.steps[: len(path.added)]
    return fit_stated(steps[-1], path.final) if steps else path.final.fit


def _with_effects(structure: Structure, added: Sequence[Addition], steps: Sequence[StepReport]) -> Structure:
    """The structure with what was added, as large as the answer says; without what is wrong in one recording."""
    pairs = zip(added, steps, strict=True)
    found = [one.spec(step.coefficient, step.shape) for one, step in pairs if not one.recording]
    return replace(structure, effects=(*structure.effects, *found))


def _drift_left_by(path: SelectionPath, sized: Model) -> Drift:
    """In the sensors' noise; sized: the final model as its error is told.

    Of a structure that rings a fit in that noise may end in a motion that its parameters do not simulate, and what that
    leaves says nothing of time: it is asked of the fit that was sized then.
    """
    recorded = path.as_recorded
    if settled(recorded, analyse(recorded)):
        return drift_of(recorded)
    return drift_of(sized.fit._replace(problem=sized.fit.problem.on(path.records)))


def _explained_by_first_effect(models: Sequence[Model], added: Sequence[Addition], cfc: int | None) -> float:
    """Share of the misfit in the band; what one element lacks another may as well, then the two count as one. Nothing
    of an inertia, a given force or a channel's error: no law of theirs may be written another way."""
    if not added or not (added[0].effect.acts_on in ("element", "between") or added[0].effect.on_ground):
        return 0.0
    effects = [addition.effect.name for addition in added]
    alike = next((k for k, effect in enumerate(effects) if effect != effects[0]), len(effects))
    given, left = (in_band(one.fit, one.residuals, cfc) for one in (models[0], models[alike]))
    return left.share_explained(given)
