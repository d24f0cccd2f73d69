"""Which physical effect is missing: the answer, from a structure and one or more recordings of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from crash_replay.recording import Recording

from ...derived_motion import with_accelerations
from ...effects import EFFECTS
from ...effects.effect import Addition, Effect
from ...sensor_faults import without_faults
from ...sensor_noise import ASSUMED
from ...structure import ModelError, Structure
from ..observation.record import refuse_dead_channels
from ..residuals.in_band import in_band
from ..residuals.misfit_windows import MisfitWindow, misfit_windows
from ..residuals.residuals import analyse, free_run, noise_floor
from ..residuals.score_test import Drift, drift_of
from ..selection.acceptance import needed_share, settled
from ..selection.fitted_model import Model
from ..selection.onset_search import select_from_the_onset
from ..selection.search_limit import limit_text, search_is_over, search_limit
from ..selection.selection_path import SelectionPath, up_to
from ..selection.selection_step import band_of_steps, fit_of_all, sized_models
from ..selection.thresholds import THRESHOLDS
from ..selection.time_zero import TimeZero
from .fitted_constants import FittedConstant, fitted_constants
from .left import Left, left_by
from .ranking import Ranked, StepReport, ranking_of, step_of
from .time_zero_step import TIME_ZERO, as_ranked, signals_begin, time_zero_step
from .tolerance import DEFAULT, Tolerance
from .verdict import ADEQUATE, EFFECT_MISSING, UNEXPLAINED, Evidence, verdict_on
from .verdict_text import verdict_text


@dataclass(frozen=True)
class Rms:
    """Root mean square of measured minus predicted over all outputs, m/s^2; None where it is not known."""

    before: float
    after: float
    noise_floor: float | None = None
    unit: str = "m/s^2"


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
            "tolerance": self.tolerance.as_json(),
            "stopped": self.stopped,
            "text": self.text,
            "residual_rms": vars(self.residual_rms),
            "free_run_rms": {k: v for k, v in vars(self.free_run_rms).items() if v is not None},
            "ranking": [ranked.as_json() for ranked in self.ranking],
            "steps": [step.as_json() for step in self.steps],
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
    recordings, faults = without_faults(recordings)
    structure, recordings = with_accelerations(structure, recordings)
    for recording in recordings:
        refuse_dead_channels(structure, recording)
    with search_limit(seconds):
        begun = select_from_the_onset(structure, recordings, effects)
        stopped = search_is_over()
    found = _answer(structure, begun.path, tolerance, begun.zero)
    remarks = [faults] if faults else []
    if assumed := _with_assumed_noise(begun.path):
        remarks.append(
            f"of {', '.join(assumed)} too little is recorded at rest to tell the noise behind a filter: it is taken "
            f"for {100.0 * ASSUMED:g} % of the peak; record 20 ms before time zero, or state it (`noise` of a body)"
        )
    elsewhere = {shift.test: shift.seconds for shift in begun.unused if shift.off(0.0)}  # whatever a filter shows early
    if elsewhere:
        remarks.append(signals_begin(elsewhere))
    if begun.taken:
        taken = {shift.test: shift.seconds for shift in begun.taken}
        remarks.append(f"{signals_begin(taken)}, and are compared from there on")
    if stopped:
        remarks.append(f"stopped after {limit_text(seconds)}: not everything was tried")
    return replace(found, stopped=stopped, text="; ".join([found.text, *remarks]))


def _with_assumed_noise(path: SelectionPath) -> list[str]:
    """Tests."""
    return [one.test.id for one in path.records if any(spectrum.assumed for spectrum in one.spectra)]


def _answer(structure: Structure, path: SelectionPath, tolerance: Tolerance, zero: TimeZero | None) -> Diagnosis:
    models = sized_models(path.steps, path.final)
    band = band_of_steps(path.steps)
    given = zero.as_stated if zero else models[0]
    before = left_by(given, band)
    if tolerance.stated and tolerance.admits(before):  # whoever says so wants nothing added
        path, zero = up_to(path, 0), None
        models = sized_models(path.steps, path.final)
    steps, final, added = path.steps, models[-1], path.added
    runs = [free_run(model.fit).rms for model in models]
    pairs = zip(steps, models, models[1:], zip(runs, runs[1:], strict=False), strict=False)  # the last has no successor
    of_all = fit_of_all(steps[: len(added)], path.final)
    reports = effects_added = tuple(step_of(*each, of_all) for each in list(pairs)[: len(added)])
    drift = _drift_left_by(path, final)
    sure = next((k for k, one in enumerate(reports) if abs(one.coefficient) <= one.std), len(added))
    if 0 < sure < len(added) and not (final.white and drift.constant):
        return _answer(structure, up_to(path, sure), tolerance, zero)
    ranking, after = ranking_of(steps[0]), left_by(final, band)
    by_first = _explained_by_first_effect(models, added, band)
    if zero:
        runs = [free_run(given.fit).rms, *runs]
        moved = time_zero_step(zero, models[0], (runs[0], runs[1]))
        models, reports = (given, *models), (moved, *effects_added)
        ranking = ranking if added else (as_ranked(moved), *ranking)
    weighed = final.fit.problem.noise_is_inflated or after.share_explained(before) > THRESHOLDS.nearly_all
    certain = all(abs(one.coefficient) > one.std for one in reports)
    many = len(added) or len(reports)  # a time zero is none of the effects that may be too many
    needed = needed_share(added)
    evidence = Evidence(
        many,
        final.white,
        drift,
        before,
        after,
        ranking,
        weighed,
        certain,
        by_first,
        needed,
        structure.place_of,
        bool(_with_assumed_noise(path)),
    )
    verdict = verdict_on(evidence, tolerance)
    if added and verdict.word == ADEQUATE:
        return _answer(structure, up_to(path, 0), tolerance, None)
    if len(added) > 1 and verdict.word == UNEXPLAINED:
        first = _answer(structure, up_to(path, 1), tolerance, zero)
        if first.verdict == EFFECT_MISSING:  # what came after it is no reason to doubt it
            return first
    floor = noise_floor(given.fit.layout, given.records)
    return Diagnosis(
        verdict=verdict.word,
        complete=verdict.complete,
        left=after,
        left_before=before,
        noise=evidence.noise,
        tolerance=tolerance,
        text=verdict_text(verdict, evidence, tolerance, reports, given, final, floor, structure),
        residual_rms=Rms(given.residuals.rms, final.residuals.rms, floor),
        free_run_rms=Rms(runs[0], runs[-1]),
        ranking=ranking,
        steps=reports,
        remaining=ranking_of(steps[-1]),
        constants=fitted_constants(of_all),
        misfit=misfit_windows(given.fit.layout, given.records, given.residuals),
        misfit_after=misfit_windows(final.fit.layout, final.records, final.residuals),
        structure=_with_effects(path.structure, added, effects_added),
        models=models,
    )


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
