"""Which effect is missing, as far as the samples go: an answer every moment while a test is replayed.

Each update looks at all candidates in one linearisation and fits a few in full, in means over short bins with coarse
curves: those that led at the last update, and one whose turn it is. So an update costs little, and the ranking
ripens from update to update. After the last sample it is for `diagnose` to say what is so.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from time import process_time

import numpy as np

from crash_replay.gravity import G
from crash_replay.recording import Recording, Test

from ...effects import EFFECTS
from ...effects.effect import Addition, Effect
from ...kinematics import Kinematics
from ...structure import Structure
from ..observation.bin_means import in_bins
from ..observation.record import FEWEST_SAMPLES, ObservedRecord, observe
from ..observation.rest import Quiet, quiet_of, rest_of, rests_of
from ..output_error.gauss_newton import fit
from ..output_error.problem import make_problem
from ..parameterization.layout import Layout
from ..parameterization.magnitudes import CELLS, Magnitudes, measure_magnitudes
from ..parameterization.model_terms import additions_of
from ..report.ranking import ranking_of
from ..report.verdict import ADEQUATE, EFFECT_MISSING, UNEXPLAINED
from ..residuals.misfit_windows import misfit_windows
from ..residuals.residuals import Residuals, analyse, noise_floor, rms
from ..selection.fitted_model import Model
from ..selection.rare_effects import common_effects
from ..selection.selection_step import SelectionStep
from .candidate_turns import ITERATIONS_ON, MOST_ITERATIONS, OnlineState, try_some
from .online_answer import UNKNOWN, Change, OnlineAnswer, curves
from .warm_start import carried_on

CELLS_IN_ALL = 90
"""Of free curves over their crush scales: as fine as offline where elements are few."""

BUDGET = 0.05
"""s of the processor's time; with the candidate that is being fitted then, an update stays below 0.1 s."""


@dataclass(frozen=True)
class OnlineDiagnosis:
    """Of one test; `init` and `update` fold it. Raises ModelError or RecordingError where model and test do not fit."""

    structure: Structure
    test: Test
    others: Sequence[Recording] = ()  # of the same structure, at other speeds
    effects: Mapping[str, Effect] = field(default_factory=lambda: EFFECTS)
    budget: float = BUDGET  # s of the processor's time in an update after which it begins no further candidate
    other_records: Sequence[ObservedRecord] = field(init=False)
    other_rests: Sequence[Quiet] = field(init=False)

    def __post_init__(self):
        Kinematics(self.structure, self.test)
        others = zip(self.others, rests_of(self.others), strict=True)
        object.__setattr__(self, "other_records", [observe(self.structure, *other) for other in others])
        object.__setattr__(self, "other_rests", [quiet_of(other) for other in self.others])

    def init(self) -> OnlineState:
        return OnlineState()

    def update(self, state: OnlineState, recording: Recording) -> tuple[OnlineState, OnlineAnswer | None]:
        """The answer on the samples so far; None while they are too few, or where nothing fits them."""
        if np.count_nonzero(recording.time_ns >= 0) < FEWEST_SAMPLES:
            return state, None
        out_of_time = _clock(self.budget)
        rest = rest_of(quiet_of(recording), self.other_rests)
        full = [observe(self.structure, recording, rest), *self.other_records]
        records = [in_bins(record) for record in full]
        if not (records[0].valid > 0.0).any(axis=0).all():  # a filter shows what was before the impact in all of them
            return state, None
        magnitudes = measure_magnitudes(
            self.structure, records, min(CELLS, CELLS_IN_ALL // len(self.structure.elements))
        )
        given = _model(state, records, magnitudes, additions_of(magnitudes, self.effects))
        if given is None:
            return state, None
        state, tried = try_some(state, magnitudes, common_effects(self.structure, self.effects), given, out_of_time)
        residuals = analyse(tried[0].fit) if tried and tried[0].fit else given.residuals
        # what even the best leaves counts as noise
        done = SelectionStep(given, [one._replace(gain=one.gain / max(residuals.mean_square, 1.0)) for one in tried])
        best = done.best
        residuals = residuals if best else given.residuals
        layout, found = given.fit.layout, (best.addition.spec(),) if best else ()
        finely = [
            _finely(each, full, records) for each in ((given.residuals, residuals) if best else (given.residuals,))
        ]
        answer = OnlineAnswer(
            verdict=EFFECT_MISSING if best else ADEQUATE if given.residuals.white else UNEXPLAINED,
            complete=residuals.white,
            text="",
            ranking=ranking_of(done),
            found=found,
            rms=Change(*(_rms(layout, full, each) for each in (finely[0], finely[-1]))),
            free_run=UNKNOWN,
            noise_floor=noise_floor(layout, full),
            white=(given.residuals.band_test, residuals.band_test),
            misfit=misfit_windows(layout, records[:1], given.residuals),
            fits=tuple(curves(layout, full[0], each[0], found[:k]) for k, each in enumerate(finely)),
        )
        return state, answer._replace(text=_text(recording, answer))


def _clock(budget: float) -> Callable[[], bool]:
    begun = process_time()
    return lambda: process_time() - begun > budget


def _model(
    state: OnlineState, records: Sequence[ObservedRecord], magnitudes: Magnitudes, additions: Sequence[Addition]
) -> Model | None:
    """It goes on from its last fit; at first, and where it ended nowhere, from the measured motion."""
    problem = make_problem(magnitudes, records, additions)
    start = carried_on(state.model, problem) if state.model else None
    found = fit(problem, start, most=ITERATIONS_ON if start else MOST_ITERATIONS)
    if start and not np.isfinite(found.cost):
        found = fit(problem, most=MOST_ITERATIONS)
    return Model(tuple(additions), found, analyse(found), {}) if np.isfinite(found.cost) else None


def _finely(
    residuals: Residuals, full: Sequence[ObservedRecord], records: Sequence[ObservedRecord]
) -> list[np.ndarray]:
    """What is predicted of all samples: a straight line between the bins' centres."""
    finely = []
    for every, record, predicted in zip(full, records, residuals.predicted, strict=True):
        time, centre = every.time[every.at], record.time[record.at]
        finely.append(np.stack([np.interp(time, centre, column) for column in predicted.T], axis=1))
    return finely


def _rms(layout: Layout, full: Sequence[ObservedRecord], predicted: Sequence[np.ndarray]) -> float:
    return rms(layout, [every.measured - output for every, output in zip(full, predicted, strict=True)])


def _text(recording: Recording, answer: OnlineAnswer) -> str:
    so_far = f"up to {recording.time_ns[-1] * 1e-6:.1f} ms: "
    floor = f"noise floor {answer.noise_floor / G:.3g}"
    before, after = (rms / G for rms in answer.rms)
    if answer.verdict == ADEQUATE:
        return so_far + f"nothing significant is missing (residual RMS {before:.3g} g, {floor})"
    if answer.verdict == UNEXPLAINED:
        return so_far + f"unexplained: residual RMS {before:.3g} g, {floor}; no candidate explains it yet"
    best = answer.ranking[0]
    rivals = f", not yet told from {', '.join(best.confounded_with)}" if best.confounded_with else ""
    return so_far + (
        f"effect missing: {best.name}, {best.coefficient:.4g} +- {best.std:.2g} {best.unit}{rivals}; "
        f"residual RMS {before:.3g} -> {after:.3g} g, {floor}"
    )
