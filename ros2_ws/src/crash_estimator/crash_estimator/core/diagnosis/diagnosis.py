"""Which physical effect is missing: the answer, from a structure and one or more recordings of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from crash_replay.recording import Recording

from ..effects import EFFECTS
from ..effects.base import Effect
from ..structure import ModelError, Structure
from .additions import additions_of, structure_with
from .answer import Ranked, StepReport, ranking_of, step_of
from .assess import Left, assess, free_run, noise_floor
from .constancy import Drift, drift_of
from .fit import Fit, fit
from .helpful import helpful
from .layout import Addition
from .linearise import linearise
from .misfit import MisfitWindow, misfit_windows
from .model import Model, fit_model
from .records import Record, make_record
from .rounds import Round, share_removed
from .scales import Scales, make_scales
from .search import LEAST_SHARE, NEAR_THE_FLOOR, search
from .sentence import MOST_AT_ONCE, sentence
from .trying import GAIN

CELLS = 36
"""Of a free curve over its crush scale."""

FINER_CELLS = 72


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
    text: str  # one readable line
    residual_rms: Rms  # of the fit
    free_run_rms: Rms  # of a simulation from the initial motion alone
    ranking: tuple[Ranked, ...]  # of the first round, best first
    steps: tuple[StepReport, ...]  # effects added, in order
    remaining: tuple[Ranked, ...]  # what was left of the candidates in the last round
    misfit: tuple[MisfitWindow, ...]  # of the structure as it was given
    misfit_after: tuple[MisfitWindow, ...]
    structure: Structure  # with the effects that were added
    models: tuple[Model, ...]  # as given, then after each step

    def as_json(self) -> dict:
        return {
            "verdict": self.verdict,
            "text": self.text,
            "residual_rms": vars(self.residual_rms),
            "free_run_rms": {k: v for k, v in vars(self.free_run_rms).items() if v is not None},
            "ranking": [ranked.as_json() for ranked in self.ranking],
            "steps": [step.as_json() for step in self.steps],
            "misfit": [window._asdict() for window in self.misfit],
            "misfit_after": [window._asdict() for window in self.misfit_after],
        }


def diagnose(
    structure: Structure, recordings: Sequence[Recording], effects: Mapping[str, Effect] = EFFECTS
) -> Diagnosis:
    """Compare a structure (with the effects that it has) with recordings of it, and name what is missing.

    Raises ModelError or RecordingError, one line, where the data or the model is at fault.
    """
    if not recordings:
        raise ModelError("a diagnosis needs at least one recording")
    records = [make_record(structure, recording) for recording in recordings]
    found = _found(structure, records, effects)
    if found.may_never_pull(records):
        found = max(found, _found(structure, records, effects, pulls=False), key=_Found.plausibility)
    return _answer(structure, found, drift_of(found.as_recorded, records))


class _Found(NamedTuple):
    """What a search has found."""

    scales: Scales
    rounds: list[Round]
    final: Model
    present: int  # additions that the structure had
    as_recorded: Fit  # of the final model, in the sensors' noise

    def plausibility(self) -> tuple[bool, float]:
        return self.final.left.whiteness.white, self.as_recorded.evidence

    def may_never_pull(self, records: Sequence[Record]) -> bool:
        """Something is missing, and contacts that never pull would explain some of it.

        Whether the damper beside a spring that carries compression only may pull until that is spent, nobody tells;
        taken the wrong way, it looks like another effect.
        """
        structure, final = self.scales.structure, self.final
        if all(element.tension for element in structure.elements):
            return False
        if len(final.additions) == self.present and final.left.whiteness.white:
            return False
        never = make_scales(structure, records, self.scales.cells, pulls=False)
        samples = sum(record.bins * record.measured.shape[1] for record in records)
        models = [round_.before for round_ in self.rounds]
        for model in models if models[-1] is final else [*models, final]:
            pulling = _in_the_sensors_noise(model, records)
            if not _contacts_pull(pulling, records):
                continue
            pushing = fit_model(structure, records, never, model.additions).fit
            misfit = 0.5 * max(pulling.cost - samples, 0.0)  # nats
            if pushing.evidence > pulling.evidence + GAIN + LEAST_SHARE * misfit:
                return True
        return False


def _contacts_pull(fitted: Fit, records: Sequence[Record]) -> bool:
    """Whether any does along the fitted motion; where none does, one that never pulls is the same."""
    layout = fitted.layout
    never = layout._replace(links=tuple(replace(link, pulls=False) for link in layout.links))
    for r, (record, trajectory) in enumerate(zip(records, fitted.trajectories)):
        rows = [linearise(each, record, r, fitted.theta, trajectory).rows for each in (layout, never)]
        if not np.array_equal(*rows):
            return True
    return False


def _found(
    structure: Structure, records: Sequence[Record], effects: Mapping[str, Effect], pulls: bool = True
) -> _Found:
    scales = make_scales(structure, records, CELLS, pulls=pulls)
    present = additions_of(structure, scales, effects)
    rounds, final = search(records, scales, effects, present)
    as_recorded = _in_the_sensors_noise(final, records)
    left = assess(as_recorded, records)
    finer = make_scales(structure, records, FINER_CELLS, pulls=pulls)
    if _wants_finer_curves(final, left, finer, len(present)):
        finer_rounds, finer_final = search(records, finer, effects, present)
        fewer = len(finer_final.additions) < len(final.additions) or not final.left.whiteness.white
        if finer_final.left.whiteness.white and fewer:
            scales, rounds, final = finer, finer_rounds, finer_final
            as_recorded = _in_the_sensors_noise(final, records)
    rounds, told = helpful(rounds, final, len(present))
    if told is not final:
        final, as_recorded = told, _in_the_sensors_noise(told, records)
    return _Found(scales, rounds, final, len(present), as_recorded)


def _wants_finer_curves(final: Model, left: Left, finer: Scales, present: int) -> bool:
    """Whether folds of a curve that its cells are too wide for may be what is left, or what several effects stand for.

    left: by the final model in the sensors' noise.
    """

    def refined(additions: Sequence[Addition]) -> Left:
        return fit_model(finer.structure, finer.records, finer, additions).left

    given, found = final.additions[:present], final.additions[present:]
    if len(found) > 1 and any(refined((*given, one)).whiteness.white for one in found):
        return True
    if final.left.whiteness.white or left.cost >= NEAR_THE_FLOOR:
        return False
    sharper = refined(final.additions)
    return sharper.whiteness.white or share_removed(left, sharper) > LEAST_SHARE


def _in_the_sensors_noise(model: Model, records: Sequence[Record]) -> Fit:
    """The model's fit; made again where that was in a larger noise."""
    found = model.fit
    tempered = model.records[0].mix is not None
    return fit(found.layout, records, (found.theta, found.trajectories)) if tempered else found


def _answer(structure: Structure, found: _Found, drift: Drift) -> Diagnosis:
    rounds, final, present = found.rounds, found.final, found.present
    first = rounds[0].before
    models = (first, *(round_.before for round_ in rounds[1:]))
    if models[-1] is not final:
        models = (*models, final)
    added = final.additions[present:]
    runs = [free_run(model.fit, model.records).rms for model in models]
    steps = tuple(step_of(*each, final) for each in zip(rounds, models, models[1:], zip(runs, runs[1:])))[: len(added)]
    white = final.left.whiteness.white
    explained = white and drift.constant and len(added) <= MOST_AT_ONCE
    verdict = ("effect_missing" if added else "adequate") if explained else "unexplained"
    floor = noise_floor(first.fit.layout, first.records)
    ranking = ranking_of(rounds[0], len(first.records))
    return Diagnosis(
        verdict=verdict,
        text=sentence(verdict, steps, ranking, first, final, floor, drift, found.scales.pulls),
        residual_rms=Rms(first.left.rms, final.left.rms, floor),
        free_run_rms=Rms(runs[0], runs[-1]),
        ranking=ranking,
        steps=steps,
        remaining=ranking_of(rounds[-1], len(first.records)),
        misfit=misfit_windows(first.fit.layout, first.records, first.left),
        misfit_after=misfit_windows(final.fit.layout, final.records, final.left),
        structure=structure_with(structure, added, steps),
        models=models,
    )
