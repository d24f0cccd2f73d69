"""Whether a stated time zero is the impact's: recordings compared with the same ones from their onset on.

Whoever states it reads a contact switch, a flash or a curve, and may be some ms off. Where the signals begin before it,
no model can follow: its bodies are at rest, or coast, until then. Where they begin after it, a gap that closes says the
same, and a delay; that is told, and left to them, unless only from the onset on nothing but noise is left.

An onset is where signals stand out of their noise, which a rise that begins gently does late. A model that
is right says sharper when its motion began: what it leaves is least from there on.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from itertools import combinations
from typing import NamedTuple, TypeAlias

import numpy as np

from crash_replay.onset import AS_WELL, find_onset
from crash_replay.recording import Recording

from ...effects.effect import Addition, Effect
from ...structure import ModelError, Structure
from ..observation.record import ObservedRecord
from ..output_error.gauss_newton import fit
from ..output_error.normal_equations import may_diverge
from ..output_error.problem import make_problem
from ..parameterization.magnitudes import Magnitudes, measure_magnitudes
from ..parameterization.model_terms import additions_of
from ..residuals.residuals import Residuals, analyse, rms
from .fitted_model import Model, fit_given, fit_model
from .search_limit import search_is_over
from .thresholds import THRESHOLDS

BETWEEN = 12.0**-0.5
"""Standard deviation, in samples, of an instant between two of them."""

FARTHEST = 2.0 * AS_WELL**0.5
"""Standard deviations that an onset may be off: twice as far as any that fits its signals as well. And that a signal's
mean may be off its zero where it is said to rest."""

CLOSER = 5.0
"""Times `near_floor`, from which on no closer look is taken: of 65 looked-at ones that ended below that none had begun
with more than 1.5 of it."""


Observed: TypeAlias = "Callable[[Sequence[Shift]], Sequence[ObservedRecord]]"


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
    mean_square: float  # that is left from there on, in units of the noise


def onsets(recordings: Sequence[Recording], early: Sequence[float] = ()) -> tuple[Shift, ...]:
    """Of the recordings whose signals begin elsewhere than at the stated time zero; early: or where the motion may, as
    each one's filter shows it up to so many seconds before it begins."""
    shifts = []
    for k, recording in enumerate(recordings):
        onset, period = find_onset(recording), recording.sample_period
        if onset is None:
            continue
        seconds, precision = onset.time_ns * 1e-9, onset.precision_ns * 1e-9
        if onset.differs or (early and max(abs(seconds), early[k]) > period):
            std = max(precision * AS_WELL**-0.5, period * BETWEEN)
            shifts.append(Shift(k, recording.test.id, seconds, std, period, onset.differs, early[k] if early else 0.0))
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
        magnitudes = measure_magnitudes(structure, records)
        return fit_given(magnitudes, records, additions_of(magnitudes, effects))

    zero = TimeZero(shifts, given(stated))
    return zero if not zero.as_stated.white and zero.gain(given(moved)) > THRESHOLDS.gain else None


@may_diverge
def sharpened(
    onsets: Sequence[Shift], taken: Sequence[Shift], structure: Structure, choices: Sequence[Sequence[Addition]],
    observed: Observed, left: float,
) -> Sharpened | None:  # fmt: skip
    """The likeliest shifts for the structure with the likeliest of some choices of additions; and what they gain over
    those `taken` with all that was found so, which left so much (rms, m/s^2). None where the first steps leave so much
    that a closer look makes no noise of it, or where the search is over: nothing would be looked for from there on."""
    taken = tuple(taken)
    bins = sum(record.bins * record.measured.shape[1] for record in observed(taken))
    starts = [MotionStart(onsets, structure, additions, observed, bins) for additions in choices]
    pairs = ((one, one.about(taken)) for one in starts if not search_is_over())
    start, near = min(pairs, key=lambda pair: pair[0].roughly(pair[1]), default=(None, taken))
    if search_is_over() or start.left_about(near).mean_square >= CLOSER * THRESHOLDS.near_floor:
        return None
    best = start.to_the_sample(near)
    if search_is_over():
        return None
    least, as_found = start.unlikely(best), start.of_both(taken, left)
    gain = 0.5 * (min(start.unlikely(taken), as_found) - least)
    of_residuals = 0.5 * (start.of_both(best, left) - least)
    return Sharpened(start.with_stds(best), gain, of_residuals, start.left_from(best).mean_square)


class _Nothing(NamedTuple):
    """Where no motion can begin."""

    rms: float = np.inf
    mean_square: float = np.inf


class MotionStart:
    """Where the motion of a structure with some additions begins.

    The logarithm of the likelihood is that of what is left from there on, in noise as large as that, and of the onsets,
    each with its standard deviation: free curves may begin before there is any force, and do not tell when.

    A pattern search to the sample (Hooke and Jeeves 1961), each recording's in turn and all together: from its onset,
    from what was taken for it, or from the stated time zero, in steps that are halved, the first as long as its onset
    may be wrong by.
    """

    def __init__(
        self, onsets: Sequence[Shift], structure: Structure, additions: Sequence[Addition], observed: Observed,
        bins: int,
    ):  # fmt: skip
        """observed(shifts) -> the records; bins of all outputs in all of them."""
        self.onsets, self.structure, self.additions, self.observed = onsets, structure, additions, observed
        self.bins = bins
        self.step = max(1, *(int(onset.std / onset.period) for onset in onsets))
        self.each = [(k,) for k in range(len(onsets))]
        self.left_from = cache(partial(self._left_from, _with_care))
        self.left_about = cache(partial(self._left_from, _fitted))

    def of_both(self, shifts: Sequence[Shift], rms: float) -> float:
        """Twice the negative logarithm of the likelihood of what is left and of the onsets, less constants."""
        pairs = zip(shifts, self.onsets, strict=True)
        off = sum((onset.off(one.seconds) / onset.std) ** 2 for one, onset in pairs)
        return 2.0 * self.bins * float(np.log(rms)) + off if np.isfinite(rms) else np.inf

    def unlikely(self, shifts: tuple[Shift, ...]) -> float:
        """The same, with the additions from there on."""
        return self.of_both(shifts, self.left_from(shifts).rms)

    def roughly(self, shifts: tuple[Shift, ...]) -> float:
        """The same, from one fit each."""
        return self.of_both(shifts, self.left_about(shifts).rms)

    def _left_from(self, left_by: Callable[..., Residuals], shifts: tuple[Shift, ...]) -> Residuals | _Nothing:
        """left_by(magnitudes, records, additions)."""
        pairs = zip(shifts, self.onsets, strict=True)
        if any(abs(onset.off(one.seconds)) > abs(onset.seconds) + FARTHEST * onset.std for one, onset in pairs):
            return _Nothing()
        try:
            records = self.observed(shifts)
        except ModelError:  # too little is left from there on
            return _Nothing()
        return left_by(measure_magnitudes(self.structure, records), records, self.additions)

    def about(self, taken: tuple[Shift, ...]) -> tuple[Shift, ...]:
        """Within the first step."""
        best = taken
        for k, onset in enumerate(self.onsets):
            starts = best[k], onset, onset._replace(seconds=0.0)
            best = min(((*best[:k], start, *best[k + 1 :]) for start in starts), key=self.roughly)
        return self._walked(best, self.step, self.roughly)

    def to_the_sample(self, best: tuple[Shift, ...]) -> tuple[Shift, ...]:
        step = max(1, self.step // 2)
        while step:
            best = self._walked(best, step, self.unlikely)
            step //= 2
        return best

    def with_stds(self, best: tuple[Shift, ...]) -> tuple[Shift, ...]:
        """The standard deviations are those of a parabola through the samples next to it."""
        least, later = self.unlikely(best), [self.unlikely(_moved(best, which, 1)) for which in self.each]
        pairs = zip(self.each, later, strict=True)
        bent = np.diag([self.unlikely(_moved(best, which, -1)) + up - 2.0 * least for which, up in pairs])
        for i, j in combinations(range(len(best)), 2):
            bent[i, j] = bent[j, i] = self.unlikely(_moved(best, (i, j), 1)) - later[i] - later[j] + least
        stds = _stds(0.5 * bent, [onset.std / onset.period for onset in self.onsets])
        return tuple(one._replace(std=one.period * max(BETWEEN, std)) for one, std in zip(best, stds, strict=True))

    def _walked(
        self, best: tuple[Shift, ...], step: int, unlikely: Callable[[tuple[Shift, ...]], float]
    ) -> tuple[Shift, ...]:
        """As far as steps of so many samples lead."""
        before = None
        while best != before and not search_is_over():
            before = best
            for which in [*self.each, tuple(range(len(best)))]:
                best = min((best, _moved(best, which, -step), _moved(best, which, step)), key=unlikely)
        return best


def _with_care(magnitudes: Magnitudes, records: Sequence[ObservedRecord], additions: Sequence[Addition]) -> Residuals:
    return fit_model(magnitudes, records, additions).residuals


def _fitted(magnitudes: Magnitudes, records: Sequence[ObservedRecord], additions: Sequence[Addition]) -> Residuals:
    return analyse(fit(make_problem(magnitudes, records, additions)))


def _moved(shifts: tuple[Shift, ...], which: Sequence[int], samples: int) -> tuple[Shift, ...]:
    by = [samples * one.period if k in which else 0.0 for k, one in enumerate(shifts)]
    return tuple(one._replace(seconds=one.seconds + s) for one, s in zip(shifts, by, strict=True))


def _stds(precision: np.ndarray, otherwise: Sequence[float]) -> Sequence[float]:
    """Of (n,) with the inverse covariance (n, n); `otherwise` where that is none."""
    if not np.isfinite(precision).all() or np.linalg.eigvalsh(precision)[0] <= 0.0:
        return otherwise
    return np.sqrt(np.diagonal(np.linalg.inv(precision))).tolist()
