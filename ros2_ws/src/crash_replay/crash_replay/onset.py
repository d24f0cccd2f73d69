"""When the impact begins, found from the signals themselves: a two-phase regression over all channels at once.

What is found does not depend on the stated time zero, but where the first instant that was tried fits almost as well as
the best: sought farther back, too, an onset that does not contradict the stated time zero is taken instead.

1. Noise. Each acceleration and force has its mean and standard deviation from the record's first samples, at rest;
   noise whose neighbours are alike counts for as much less, by how means over a run scatter there. A car that rolls
   towards its barrier shakes more than it did at first: no mean is known better than SHAKES of the channel's peak.
2. Alarm. The first instant at which the mean over a run of RUNS of any channel leaves its rest by more than ALARM
   standard deviations of such means, HOLDS for as long again, and is followed by another channel's, within BACK or
   while it stays away. The shortest run tells a steep rise. A rise that takes its time to get out of the noise is told
   by the run that has ended first, and known no better than by the length of that.
3. Change point. Around the alarm, for every instant k: before k a channel is at rest, from k on it follows
   b0 + b1 (t - t_k) + b2 (t - t_k)^2, with its own coefficients by least squares. Onset is the k with the smallest sum
   of squared residuals, in units of the channels' noise, over all channels that have woken by the end of the window:
   the maximum of the likelihood of a change from rest to a smooth rise.

A jump is found to the sample; a rise out of the noise as precisely as its slope allows: the instants that fit almost as
well (AS_WELL) say how precisely.
"""

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from .channel_class import takes_part_in_the_impact
from .conditioning import RESTS_AT_ZERO
from .recording import Recording, RecordingError

AT_REST = 0.010
"""s of the record's beginning that tell the noise; a record that has less before the impact has no onset to find."""
LEAST_AT_REST = 40
"""Samples: their standard deviation is known to a tenth."""
RUNS, LEAST_RUN = (0.0005, 0.001, 0.002, 0.004), 5
"""s, and samples, of the means that are watched: the first is shorter than the rise of any stiff structure and longer
than a spike; the last is as long as AT_REST tells the scatter of, and sees 2.5 g in a noise of 2 g at 10 kHz."""
ALARM, HOLDS = 8.0, 2
"""Standard deviations, which white noise does not reach in any record, and runs that a spike does not last."""
SHAKES = 0.00125
"""Of the largest mean: ALARM times it is 1 %; the car of NHTSA 10146 reaches 0.55 % of its peak before the impact,
filtered with CFC 60, its barrier 0.34 %."""
BACK, AHEAD = 0.004, 0.0015
"""s before and after the alarm in which the change point is sought and fitted; of a longer run two runs and one, where
that is more. Of 111 looked-at simulated recordings whose stated time zero is right 20 are told to begin more than two
samples before it and 2 more than 1 ms after; 14 and 4 with half of the first, 22 and none with twice as much, 25 and 2
with half of the second, 15 and 2 with twice as much."""
EARLIER = 0.002
"""s before the shortest run's alarm by which a longer one must have ended to be believed instead: what is nearer the
shortest one's change point is sought in anyway. With none the wobble of NHTSA 10146's load cells moved its onset from
+1.0 to -1.8 ms. So 2 of 214 looked-at recordings that begin at the stated time zero are told to begin elsewhere."""
LEAST_AHEAD = 12
"""Samples after a change point: three coefficients need more than noise to hold on to."""
AS_WELL = 9.0
"""Of the sum of squares: three standard deviations."""
DIFFERS = 2
"""Samples by which the onset may be off the stated time zero without a word."""


class Onset(NamedTuple):
    time_ns: int  # since the stated time zero
    sample: int
    channels: tuple[str, ...]  # that have woken then
    precision_ns: int  # that the noise allows
    differs: bool  # from the stated time zero by more than it can be wrong

    @property
    def time(self) -> float:
        """s."""
        return self.time_ns * 1e-9

    @property
    def precision(self) -> float:
        """s."""
        return self.precision_ns * 1e-9


class _Alarm(NamedTuple):
    """What means over one run say."""

    run: int  # samples
    first: int  # sample with which the first run begins that is away
    woken: tuple[int, ...]  # channels that are soon after it
    columns: Mapping[int, np.ndarray]  # by channel, (n,) in units of its noise
    gentle: bool = False  # the rise takes its time to get out of the noise, and need not be the parabola that is fitted


def find_onset(recording: Recording) -> Onset | None:
    """The instant at which the impact begins; None where nothing rests at first, or nothing wakes.

    Of the vehicle's and the barrier's channels, where none of them is among those that have woken first: a dummy is
    shaken and sways on the way to the barrier, and of a hundred channels some do so at the same time.
    """
    onset, channels = _onset_of_any(recording), recording.test.channels
    impact = [k for k, channel in enumerate(channels) if takes_part_in_the_impact(channel)]
    if onset is None or not impact or {channels[k].name for k in impact} & set(onset.channels):
        return onset
    test = replace(recording.test, channels=tuple(channels[k] for k in impact))
    return _onset_of_any(Recording(test, recording.time_ns, recording.values[:, impact])) or onset


def _onset_of_any(recording: Recording) -> Onset | None:
    period = recording.sample_period
    quiet = max(LEAST_AT_REST, round(AT_REST / period)) if period else 0
    if not quiet or len(recording) < 2 * quiet + LEAST_AHEAD:
        return None
    if recording.time[0] > -AT_REST and _begins_moving(recording, quiet):
        return None
    alarm = _first_alarm(recording, quiet, period)
    if alarm is None:
        return None
    back, _ = _around(alarm.run, period)
    found, may_be_earlier = _change_point(recording, alarm, quiet, back)
    wider = found
    while wider.differs and may_be_earlier:
        back *= 2
        wider, may_be_earlier = _change_point(recording, alarm, quiet, back)
    return found if wider.differs else wider


def _change_point(recording: Recording, alarm: _Alarm, quiet: int, back: int) -> tuple[Onset, bool]:
    """And whether the first instant that was tried fits almost as well, so that it may be earlier; back: samples before
    the alarm in which it is sought."""
    period = recording.sample_period
    _, ahead = _around(alarm.run, period)
    candidates = np.arange(
        max(quiet // 2, alarm.first - back), min(alarm.first + alarm.run, len(recording) - LEAST_RUN)
    )
    columns = np.array([alarm.columns[k] for k in alarm.woken])
    costs = _change_costs(columns, candidates, min(alarm.first + ahead, len(recording)))
    sample = int(candidates[np.argmin(costs)])
    almost = candidates[costs <= costs.min() + AS_WELL]
    time_ns = int(recording.time_ns[sample])
    precision = int(max(np.abs(recording.time_ns[almost] - time_ns).max(), alarm.gentle * alarm.run * period * 1e9))
    differs = abs(time_ns) > max(DIFFERS * period * 1e9 + 1.0, precision)
    woken = tuple(recording.test.channels[k].name for k in alarm.woken)
    return Onset(time_ns, sample, woken, precision, differs), candidates[0] == almost[0] and candidates[0] > quiet // 2


def _begins_moving(recording: Recording, quiet: int) -> bool:
    """Whether the record begins within the impact, or hardly before: a channel of the vehicle or the barrier goes
    straight somewhere from the first sample on, by more than what is shaken does of its peak, and that is more than
    half of its variance. Filtered noise may do so for 10 ms, too: asked of records with less before their time zero."""
    across = np.linspace(-0.5, 0.5, quiet)
    for channel, values in zip(recording.test.channels, recording.values.T, strict=True):
        first = values[:quiet]
        if channel.quantity in RESTS_AT_ZERO and takes_part_in_the_impact(channel) and np.isfinite(first).all():
            by = 12.0 / quiet * float(across @ first)  # the slope of a line by least squares, over the whole of it
            farthest = np.nanmax(np.abs(values - first.mean()))
            if abs(by) > ALARM * SHAKES * farthest and by**2 / 12.0 > 0.5 * first.var():
                return True
    return False


def _first_alarm(recording: Recording, quiet: int, period: float) -> _Alarm | None:
    """Of the shortest run, or of the one that has ended first, where that is EARLIER."""
    runs = sorted({max(LEAST_RUN, round(seconds / period)) for seconds in RUNS})
    alarms = [alarm for run in runs if (alarm := _alarm_by(run, recording, quiet))]
    if not alarms:
        return None
    steep, earliest = alarms[0], min(alarms, key=lambda alarm: alarm.first + alarm.run)
    if earliest.first + earliest.run < steep.first - round(EARLIER / period):
        return earliest._replace(gentle=True)
    return steep


def _around(run: int, period: float) -> tuple[int, int]:
    """Samples before and after an alarm in which the change point is sought."""
    return max(round(BACK / period), 2 * run), max(LEAST_AHEAD, round(AHEAD / period), run)


def _alarm_by(run: int, recording: Recording, quiet: int) -> _Alarm | None:
    """None where no channel rests at first and wakes."""
    columns, away = {}, {}
    for k, (channel, values) in enumerate(zip(recording.test.channels, recording.values.T, strict=True)):
        if channel.quantity not in RESTS_AT_ZERO or not np.isfinite(values[:quiet]).all():
            continue
        column = _in_its_noise(values, quiet, run)
        if column is not None:
            mean = np.convolve(column, np.full(run, 1.0 / run), mode="valid") * np.sqrt(run)
            columns[k], away[k] = column, np.abs(mean) > ALARM
    alarms = {k: alarm for k in away if (alarm := _first_to_stay(away[k], quiet, run))}
    if not alarms:
        return None
    back, ahead = _around(run, recording.sample_period)
    first = _first_with_a_witness(alarms, away, back)
    return _Alarm(run, first, tuple(k for k, alarm in alarms.items() if first <= alarm <= first + ahead), columns)


def _in_its_noise(values: np.ndarray, quiet: int, run: int) -> np.ndarray | None:
    """(n,) in units of the noise that a sum of squares may count; None for a channel without any."""
    rest = values[:quiet]
    sigma = float(rest.std())
    if not sigma > 0.0:
        return None
    moved = np.nan_to_num(values - rest.mean())
    means = np.convolve(moved, np.full(run, 1.0 / run), mode="valid")
    scatter = max(float(means[: quiet - run + 1].std()), SHAKES * float(np.abs(means).max()))
    return moved / max(sigma, np.sqrt(run) * scatter)  # the second is the first where the noise is white


def _first_to_stay(away: np.ndarray, quiet: int, run: int) -> int:
    """Index of the first sample of the first run that leaves its rest and stays away; 0 for none."""
    for k in np.flatnonzero(away[quiet:]) + quiet:
        if away[k : k + HOLDS * run].all():
            return int(k)
    return 0


def _first_with_a_witness(alarms: Mapping[int, int], away: Mapping[int, np.ndarray], within: int) -> int:
    """The first alarm that another one's follows, soon or while it stays away: before an impact a head turns, or a
    cable moves, alone."""
    ordered = sorted((alarm, channel) for channel, alarm in alarms.items())
    for (one, channel), (other, _) in pairwise(ordered):
        if other - one <= within or away[channel][one:other].all():
            return one
    return ordered[0][0]


def _change_costs(columns: np.ndarray, candidates: np.ndarray, end: int) -> np.ndarray:
    """Sum of squares that a change at each candidate leaves in columns (channels, n), in units of their noise."""
    start = int(candidates[0])
    before = np.concatenate([[0.0], np.cumsum((columns[:, start:end] ** 2).sum(axis=0))])
    costs = np.full(len(candidates), np.inf)
    for j, k in enumerate(candidates):
        if end - k >= LEAST_RUN:
            t = np.arange(end - k, dtype=float) / (end - start)
            basis, _ = np.linalg.qr(np.stack([np.ones_like(t), t, t * t], axis=1))
            after = columns[:, k:end]
            costs[j] = before[k - start] + np.sum(after * after) - np.sum((after @ basis) ** 2)
    return costs


def at_onset(recording: Recording) -> Recording:
    """The recording with its time zero at the onset; the notes say by how much it has moved.

    Raises RecordingError where there is no onset to be found.
    """
    onset = find_onset(recording)
    if onset is None:
        raise RecordingError(
            f"test {recording.test.id}: no onset found: no acceleration or force is at rest in the first "
            f"{AT_REST * 1e3:g} ms and wakes later; leave the time zero as it is stated"
        )
    return moved_time_zero(recording, onset.time_ns, f"to the onset ({_seen(onset)})")


def moved_time_zero(recording: Recording, by_ns: int, why: str) -> Recording:
    """With time zero so much later; the notes say so.

    Raises RecordingError where that is outside the recording.
    """
    if not recording.time_ns[0] <= by_ns < recording.time_ns[-1]:
        raise RecordingError(
            f"test {recording.test.id}: --time-zero {by_ns * 1e-9:g} is outside the recording, which lasts from "
            f"{recording.time_ns[0] * 1e-9:g} to {recording.time_ns[-1] * 1e-9:g} s"
        )
    note = f"time zero moved by {by_ns * 1e-6:+.4g} ms from the stated one: {why}"
    test = replace(recording.test, notes=(*recording.test.notes, note))
    return Recording(test, recording.time_ns - by_ns, recording.values)


def onset_note(recording: Recording) -> str:
    """A line where the signals begin elsewhere than at the stated time zero, and what to do; "" else."""
    onset = find_onset(recording)
    if onset is None or not onset.differs:
        return ""
    return (
        f"onset: the signals begin {onset.time_ns * 1e-6:+.4g} ms from the stated time zero ({_seen(onset)}); "
        "--time-zero auto takes the onset"
    )


def _seen(onset: Onset) -> str:
    more = f" and {len(onset.channels) - 2} more" if len(onset.channels) > 2 else ""
    return ", ".join(onset.channels[:2]) + more
