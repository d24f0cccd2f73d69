"""Whether a stated time zero is the impact's: recordings compared with the same ones from their onset on.

Whoever states it reads a contact switch, a flash or a curve, and may be some ms off. Where the signals begin before it,
no model can follow: its bodies are at rest, or coast, until then. Where they begin after it, a gap that closes says the
same, and a delay; that is told, and left to them.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from crash_replay.onset import AS_WELL, find_onset
from crash_replay.recording import Recording

from ...effects.effect import Effect
from ...structure import Structure
from ..observation.record import ObservedRecord
from ..parameterization.magnitudes import measure_magnitudes
from ..parameterization.model_terms import additions_of
from .assumptions import CELLS
from .fitted_model import Model, fit_model
from .thresholds import THRESHOLDS


class Shift(NamedTuple):
    """Of a recording's time zero."""

    recording: int  # which of those that are diagnosed
    test: str
    seconds: float  # from the stated one to the onset
    std: float  # s


class TimeZero(NamedTuple):
    """Recordings taken from their onset on, since the model leaves much less so."""

    shifts: tuple[Shift, ...]
    as_stated: Model  # fitted from the stated time zero on

    def gain(self, moved: Model) -> float:
        """Nats: the likelihood of the errors of both, in noise as large as each leaves; a bin counts once."""
        bins = sum(record.bins * record.measured.shape[1] for record in moved.records)
        return float(bins * np.log(self.as_stated.residuals.rms / moved.residuals.rms))


def onsets_elsewhere(recordings: Sequence[Recording]) -> tuple[Shift, ...]:
    """Of the recordings whose signals begin elsewhere than at the stated time zero."""
    shifts = []
    for k, recording in enumerate(recordings):
        onset = find_onset(recording)
        if onset is not None and onset.differs:
            least = recording.sample_period / np.sqrt(12.0)  # an instant between two samples
            std = max(onset.precision_ns * 1e-9 / np.sqrt(AS_WELL), least)
            shifts.append(Shift(k, recording.test.id, onset.time_ns * 1e-9, float(std)))
    return tuple(shifts)


def moved_by(shifts: Sequence[Shift], recordings: Sequence[Recording]) -> list[Recording]:
    """With time zero at their onsets."""
    by = {shift.recording: round(shift.seconds * 1e9) for shift in shifts}
    return [Recording(r.test, r.time_ns - by.get(k, 0), r.values) for k, r in enumerate(recordings)]


def time_zero_wrong(
    structure: Structure,
    stated: Sequence[ObservedRecord],
    moved: Sequence[ObservedRecord],
    shifts: tuple[Shift, ...],
    effects: Mapping[str, Effect],
) -> TimeZero | None:
    """None where the model as given leaves hardly less of the moved recordings."""
    models = []
    for records in (stated, moved):
        magnitudes = measure_magnitudes(structure, records, CELLS)
        models.append(fit_model(magnitudes, records, additions_of(structure, magnitudes, effects)))
    as_stated, from_onset = models
    zero = TimeZero(shifts, as_stated)
    return zero if zero.gain(from_onset) > THRESHOLDS.gain else None
