"""Whether a stated time zero is the impact's: recordings compared with the same ones from their onset on.

Whoever states it reads a contact switch, a flash or a curve, and may be some ms off. Where the signals begin before it,
no model can follow: its bodies are at rest, or coast, until then. Where they begin after it, a gap that closes says the
same, and a delay; that is told, and left to them, unless only from the onset on nothing but noise is left.

An onset is where signals stand out of their noise, which a rise that begins gently does late. A model that is right
says sharper when its motion began: bodies coast until they touch, and are as much farther away at the record's first
sample as they touch late. A fit in which that is open says when, together with all else that it finds (`Layout.late`).
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from crash_replay.onset import AS_WELL, find_onset
from crash_replay.recording import Recording
from crash_replay.time_unit import SECOND

from ..output_error.gauss_newton import Fit
from ..parameterization.nuisances import FARTHEST
from ..residuals.residuals import rms
from .fitted_model import Model

BETWEEN = 12.0**-0.5
"""Standard deviation, in samples, of an instant between two of them."""

RISES = 2e-4
"""s: an onset is that of a parabola, which no rise is. 174 looked-at onsets of the second simulator were off by 1.03 of
their standard deviations with so much more in each; without it by up to 9 of them."""


class Shift(NamedTuple):
    """Of a recording's time zero."""

    recording: int  # which of those that are diagnosed
    test: str
    seconds: float  # from the stated one to the onset
    std: float  # s
    period: float  # s, of its samples
    differs: bool = True  # from the stated one by more than it can be wrong
    early: float = 0.0  # s by which its sensors' filter may show the motion before it begins

    def off(self, seconds: float) -> float:
        """s by which a motion that begins then is off this onset: it may begin as much later as the filter is early."""
        late = seconds - self.seconds
        return late - min(max(late, 0.0), self.early)

    @property
    def impact(self) -> tuple[float, float]:
        """s, from the stated time zero to where the bodies may touch, and its standard deviation."""
        return self.seconds + 0.5 * self.early, float(np.hypot(np.hypot(self.std, RISES), 0.5 * self.early))


class TimeZero(NamedTuple):
    """Recordings taken from their onset on, since the model leaves much less so."""

    shifts: tuple[Shift, ...]
    as_stated: Model  # fitted from the stated time zero on

    def gain(self, moved: Model) -> float:
        """Nats: the likelihood of the errors of both, in noise as large as each leaves; a bin counts once.

        Of the same samples: those before the stated zero are quiet, and any model leaves little of them.
        """
        bins = sum(record.bins * record.measured.shape[1] for record in self.as_stated.records)
        begins = {shift.recording: -shift.seconds for shift in self.shifts}
        pairs = zip(moved.records, moved.residuals.residual, strict=True)
        of_both = [left[record.time[record.at] >= begins.get(k, 0.0)] for k, (record, left) in enumerate(pairs)]
        return float(bins * np.log(self.as_stated.residuals.rms / rms(moved.fit.layout, of_both)))


def onsets(recordings: Sequence[Recording]) -> tuple[Shift, ...]:
    """Of the recordings that rest before them."""
    shifts = []
    for k, recording in enumerate(recordings):
        onset, period = find_onset(recording), recording.sample_period
        if onset is not None:
            std = max(onset.precision * AS_WELL**-0.5, period * BETWEEN)
            shifts.append(Shift(k, recording.test.id, onset.time, std, period, onset.differs))
    return tuple(shifts)


def moved_by(shifts: Sequence[Shift], recordings: Sequence[Recording]) -> list[Recording]:
    """With time zero at their onsets."""
    by = {shift.recording: round(shift.seconds * SECOND) for shift in shifts}
    return [Recording(r.test, r.time_ns - by.get(k, 0), r.values) for k, r in enumerate(recordings)]


def coasting(recording: Recording, shift: Shift) -> Recording:
    """From before the bodies may touch: until then they coast."""
    impact, std = shift.impact
    lead = min(FARTHEST * std, impact - float(recording.time[0]))
    (moved,) = moved_by([shift._replace(recording=0, seconds=impact - lead)], [recording])
    before = {body: -v * lead for body, v in moved.test.initial_velocity.items()}
    stated = moved.test.initial_displacement
    placed = {body: stated.get(body, 0.0) + before.get(body, 0.0) for body in {**stated, **before}}
    return Recording(replace(moved.test, initial_displacement=placed), moved.time_ns, moved.values)


def touching(shift: Shift, fitted: Fit) -> Shift:
    """When bodies touch, as a fit says in which they coast until then."""
    late, (impact, _) = fitted.layout.late[shift.recording], shift.impact
    std = float(np.sqrt(fitted.covariance[late, late]))
    return shift._replace(seconds=impact + float(fitted.theta[late]), std=max(std, shift.period * BETWEEN))
