"""Whether a stated time zero is the impact's: recordings compared with the same ones from their onset on.

Whoever states it reads a contact switch, a flash or a curve, and may be some ms off. Where the signals begin before it,
no model can follow: its bodies are at rest, or coast, until then. Where they begin after it, a gap that closes says the
same, and a delay; that is told, and left to them, unless only from the onset on nothing but noise is left.

An onset is where signals stand out of their noise, which a rise that begins gently does late. A model that
is right says sharper when its motion began: what it leaves is least from there on.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from itertools import combinations
from typing import NamedTuple

import numpy as np

from crash_replay.onset import AS_WELL, find_onset
from crash_replay.recording import Recording

from ...effects.effect import Addition, Effect
from ...structure import ModelError, Structure
from ..observation.record import ObservedRecord
from ..output_error.normal_equations import may_diverge
from ..parameterization.magnitudes import measure_magnitudes
from ..parameterization.model_terms import additions_of
from ..residuals.residuals import rms
from .assumptions import CELLS
from .fitted_model import Model, fit_model
from .thresholds import THRESHOLDS
from .time_limit import out_of_time

BETWEEN = 12.0**-0.5
"""Standard deviation, in samples, of an instant between two of them."""

FARTHEST = 2.0 * AS_WELL**0.5
"""Standard deviations that an onset may be off: twice as far as any that fits its signals as well."""


class Shift(NamedTuple):
    """Of a recording's time zero."""

    recording: int  # which of those that are diagnosed
    test: str
    seconds: float  # from the stated one to the onset
    std: float  # s
    period: float  # s, of its samples


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


class Sharpened(NamedTuple):
    """Where the motion of a model begins."""

    shifts: tuple[Shift, ...]
    gain: float  # nats, over where it was taken to begin
    of_residuals: float  # nats of these, by what is left; the rest are the onsets'


def onsets(recordings: Sequence[Recording], as_well: bool = False) -> tuple[Shift, ...]:
    """Of the recordings whose signals begin elsewhere than at the stated time zero; as_well: or that may do so."""
    shifts = []
    for k, recording in enumerate(recordings):
        onset, period = find_onset(recording), recording.sample_period
        if onset is None:
            continue
        seconds, precision = onset.time_ns * 1e-9, onset.precision_ns * 1e-9
        if onset.differs or (as_well and abs(seconds) > period):
            std = max(precision * AS_WELL**-0.5, period * BETWEEN)
            shifts.append(Shift(k, recording.test.id, seconds, std, period))
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
    """None where the model as given leaves noise only, or hardly less of the moved recordings."""

    def given(records: Sequence[ObservedRecord]) -> Model:
        magnitudes = measure_magnitudes(structure, records, CELLS)
        return fit_model(magnitudes, records, additions_of(structure, magnitudes, effects))

    zero = TimeZero(shifts, given(stated))
    return zero if not zero.as_stated.white and zero.gain(given(moved)) > THRESHOLDS.gain else None


@may_diverge
def sharpened(
    onsets: Sequence[Shift], taken: Sequence[Shift], structure: Structure, additions: Sequence[Addition],
    observed: Callable[[Sequence[Shift]], Sequence[ObservedRecord]], left: float,
) -> Sharpened:  # fmt: skip
    """The likeliest shifts for the structure with some additions; and what they gain over those `taken` with all that
    was found so, which left so much (rms, m/s^2).

    The logarithm of the likelihood is that of what is left from there on, in noise as large as that, and of the onsets,
    each with its standard deviation: free curves may begin before there is any force, and do not tell when.

    A pattern search to the sample (Hooke and Jeeves 1961), each recording's in turn and all together: from its onset,
    from what was taken for it, or from the stated time zero, in steps that are halved, the first as long as its onset
    may be wrong by. The standard deviations are those of a parabola through the samples next to it. observed(shifts)
    -> the records.
    """
    bins = sum(record.bins * record.measured.shape[1] for record in observed(taken))

    def of_both(shifts: tuple[Shift, ...], rms: float) -> float:
        """Twice the negative logarithm of the likelihood of what is left and of the onsets, less constants."""
        off = sum(((one.seconds - onset.seconds) / onset.std) ** 2 for one, onset in zip(shifts, onsets, strict=True))
        return 2.0 * bins * float(np.log(rms)) + off if np.isfinite(rms) else np.inf

    @cache
    def unlikely(shifts: tuple[Shift, ...]) -> float:
        """The same, with the additions from there on."""
        pairs = zip(shifts, onsets, strict=True)
        if any(abs(one.seconds - onset.seconds) > abs(onset.seconds) + FARTHEST * onset.std for one, onset in pairs):
            return np.inf
        try:
            records = observed(shifts)
        except ModelError:  # too little is left from there on
            return np.inf
        found = fit_model(measure_magnitudes(structure, records, CELLS), records, additions)
        return of_both(shifts, found.residuals.rms)

    def moved(shifts: tuple[Shift, ...], which: Sequence[int], samples: int) -> tuple[Shift, ...]:
        by = [samples * one.period if k in which else 0.0 for k, one in enumerate(shifts)]
        return tuple(one._replace(seconds=one.seconds + s) for one, s in zip(shifts, by, strict=True))

    each, together = [(k,) for k in range(len(onsets))], tuple(range(len(onsets)))
    best = tuple(taken)
    for k, onset in enumerate(onsets):
        starts = best[k], onset, onset._replace(seconds=0.0)
        best = min(((*best[:k], start, *best[k + 1 :]) for start in starts), key=unlikely)
    step = max(1, *(int(onset.std / onset.period) for onset in onsets))
    while step and not out_of_time():
        before = best
        for which in [*each, together]:
            best = min((best, moved(best, which, -step), moved(best, which, step)), key=unlikely)
        step //= 1 if best != before else 2

    least, later = unlikely(best), [unlikely(moved(best, which, 1)) for which in each]
    bent = np.diag([unlikely(moved(best, which, -1)) + up - 2.0 * least for which, up in zip(each, later, strict=True)])
    for i, j in combinations(range(len(onsets)), 2):
        bent[i, j] = bent[j, i] = unlikely(moved(best, (i, j), 1)) - later[i] - later[j] + least
    stds = _stds(0.5 * bent, [onset.std / onset.period for onset in onsets])
    found = tuple(one._replace(std=one.period * max(BETWEEN, std)) for one, std in zip(best, stds, strict=True))
    gain = 0.5 * (min(unlikely(tuple(taken)), of_both(tuple(taken), left)) - least)
    return Sharpened(found, gain, 0.5 * (of_both(best, left) - least))


def _stds(precision: np.ndarray, otherwise: Sequence[float]) -> Sequence[float]:
    """Of (n,) with the inverse covariance (n, n); `otherwise` where that is none."""
    if not np.isfinite(precision).all() or np.linalg.eigvalsh(precision)[0] <= 0.0:
        return otherwise
    return np.sqrt(np.diagonal(np.linalg.inv(precision))).tolist()
