"""Whether a stated time zero is the impact's: recordings compared with the same ones from their onset on.

Whoever states it reads a contact switch, a flash or a curve, and may be some ms off. A model whose bodies begin to move
too early or too late leaves what other effects then seem to explain: a gap, a delay, a damper.
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


def from_their_onset(recordings: Sequence[Recording]) -> tuple[list[Recording], tuple[Shift, ...]]:
    """Those whose signals begin elsewhere than at the stated time zero are moved there."""
    moved, shifts = [], []
    for recording in recordings:
        onset = find_onset(recording)
        if onset is not None and onset.differs:
            least = recording.sample_period / np.sqrt(12.0)  # an instant between two samples
            std = max(onset.precision_ns * 1e-9 / np.sqrt(AS_WELL), least)
            shifts.append(Shift(recording.test.id, onset.time_ns * 1e-9, float(std)))
            recording = Recording(recording.test, recording.time_ns - onset.time_ns, recording.values)
        moved.append(recording)
    return moved, tuple(shifts)


def time_zero_wrong(
    structure: Structure,
    stated: Sequence[ObservedRecord],
    moved: Sequence[ObservedRecord],
    shifts: tuple[Shift, ...],
    effects: Mapping[str, Effect],
) -> TimeZero | None:
    """None where the model as given leaves hardly less of the moved recordings: a body may well be hit later than at
    time zero, over a gap."""
    models = []
    for records in (stated, moved):
        magnitudes = measure_magnitudes(structure, records, CELLS)
        models.append(fit_model(magnitudes, records, additions_of(structure, magnitudes, effects)))
    as_stated, from_onset = models
    zero = TimeZero(shifts, as_stated)
    return zero if zero.gain(from_onset) > THRESHOLDS.gain else None
