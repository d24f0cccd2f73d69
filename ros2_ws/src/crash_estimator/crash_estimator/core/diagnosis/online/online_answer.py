"""What can be said of a test at a moment of its replay, and after its last sample: one form for both."""

from typing import NamedTuple

import numpy as np

from crash_replay.time_unit import SECOND

from ...structure import EffectSpec
from ..observation.record import ObservedRecord
from ..parameterization.layout import Layout
from ..report.diagnosis import Diagnosis
from ..report.ranking import Ranked
from ..residuals.band_test import BandTest
from ..residuals.misfit_windows import MisfitWindow, misfit_windows


class Change(NamedTuple):
    """Of the model as it is, and with what was found missing."""

    before: float
    after: float


UNKNOWN = Change(np.nan, np.nan)


class FitCurves(NamedTuple):
    """Measured and fitted outputs of one model on one recording: n samples of q outputs."""

    effects: tuple[EffectSpec, ...]  # what was found, and is in this fit beside the model's own
    names: tuple[str, ...]  # of the outputs: the body, or its channel where several measure it
    units: tuple[str, ...]
    time_ns: np.ndarray  # (n,) int64, ns since the impact
    measured: np.ndarray  # (n, q) zero offset removed, NaN where not valid
    predicted: np.ndarray  # (n, q)
    noise: np.ndarray  # (q,) standard deviation of one sample


class OnlineAnswer(NamedTuple):
    verdict: str  # effect_missing, adequate or unexplained
    complete: bool  # what is left with what was found is noise, or within the tolerance
    text: str  # one readable line
    ranking: tuple[Ranked, ...]  # best first
    found: tuple[EffectSpec, ...]  # what is missing, one added after the other; with its constants where that is final
    rms: Change  # m/s^2
    free_run: Change  # m/s^2; NaN before the last sample
    noise_floor: float  # m/s^2
    white: tuple[BandTest, BandTest]  # before and after
    misfit: tuple[MisfitWindow, ...]  # of the recording that is replayed
    fits: tuple[FitCurves, ...]  # of the model as it is, then with each effect that was found
    final: bool = False
    force: str = ""  # channel of the measured force, where the share that all inertias explain is known
    force_explained: Change = UNKNOWN  # with the first of what was found


def final_answer(found: Diagnosis) -> OnlineAnswer:
    """The offline answer; of its recordings the first is the one that is replayed."""
    first, last = found.models[0], found.models[-1]
    effects = found.structure.effects[len(first.fit.layout.structure.effects) :]
    force, share = next(iter(found.steps[0].force_explained.items() if found.steps else ()), ("", UNKNOWN._asdict()))
    return OnlineAnswer(
        verdict=found.verdict,
        complete=found.complete,
        text=found.text,
        ranking=found.ranking,
        found=effects,
        rms=Change(found.residual_rms.before, found.residual_rms.after),
        free_run=Change(found.free_run_rms.before, found.free_run_rms.after),
        noise_floor=found.residual_rms.noise_floor,
        white=(first.residuals.band_test, last.residuals.band_test),
        misfit=misfit_windows(first.fit.layout, first.records[:1], first.residuals),
        fits=tuple(
            curves(m.fit.layout, m.records[0], m.residuals.predicted[0], effects[: len(m.found)]) for m in found.models
        ),
        final=True,
        force=force,
        force_explained=Change(**share),
    )


def curves(layout: Layout, record: ObservedRecord, predicted: np.ndarray, effects: tuple[EffectSpec, ...]) -> FitCurves:
    """predicted: (n, q) at the record's samples."""
    bodies = [layout.structure.bodies[output.body].name for output in layout.outputs]
    return FitCurves(
        effects,
        tuple(o.channel if bodies.count(body) > 1 else body for o, body in zip(layout.outputs, bodies)),
        tuple(output.unit for output in layout.outputs),
        np.round(record.time[record.at] * SECOND).astype(np.int64),
        record.measured,
        predicted,
        record.noise,
    )
