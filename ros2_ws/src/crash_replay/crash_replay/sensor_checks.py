"""Signs of a faulty sensor in a recording, in words; whether to use the channel is the user's choice.

dead      one value throughout
clipped   the extreme value held for several samples, entered and left by more than one step of resolution
stuck     one value, off the rest position, held for 10 ms or more after the impact
missing   no value in between, of one channel or (a gap in time) of all; a channel may well begin late or end early
"""

import numpy as np

from .recording import Recording

CLIPPED_SAMPLES = 5
CLIPPED_JUMP = 3.0
"""Steps of resolution into the held extreme: a smooth peak is entered by one step, a clipped one at full slope."""
STUCK_TIME = 0.010
"""s"""
OFF_REST = 0.05
"""Share of the channel's range: a channel at rest may well show one value for long."""
GAP = 1.5
"""Of the sample period: a longer step of time lacks a sample; a shorter one is the clock's jitter."""


def doubtful_channels(recording: Recording) -> list[str]:
    """A line for each channel that looks faulty, and one for each with values missing."""
    notes = []
    for channel, values in zip(recording.test.channels, recording.values.T):
        valid = np.isfinite(values)
        if not valid.any():
            notes.append(f"{channel.name}: has no valid value")
            continue
        inside = slice(np.argmax(valid), len(valid) - np.argmax(valid[::-1]))
        if not valid[inside].all():
            notes.append(f"{channel.name}: {_missing(recording.time[inside], valid[inside])}")
        if fault := _fault(recording.time[valid], values[valid]):
            notes.append(f"{channel.name}: {fault}")
    return notes


def gaps_in_time(recording: Recording) -> list[str]:
    """One line where samples are missing from all channels at once; none where time runs evenly."""
    steps = np.diff(recording.time)
    gaps = np.flatnonzero(steps > GAP * (recording.sample_period or np.inf))
    if not len(gaps):
        return []
    longest = gaps[np.argmax(steps[gaps])]
    many = "a gap" if len(gaps) == 1 else f"{len(gaps)} gaps, the longest"
    return [f"time: {many} of {1e3 * steps[longest]:.4g} ms after {recording.time[longest]:.4f} s"]


def _missing(time: np.ndarray, valid: np.ndarray) -> str:
    at = time[~valid]
    return f"{len(at)} sample{'s' * (len(at) > 1)} without a value, {at[0]:.4f} to {at[-1]:.4f} s"


def _fault(time: np.ndarray, values: np.ndarray) -> str:
    low, high = values.min(), values.max()
    if low == high:
        return f"one value ({low:.6g}) throughout: dead sensor?" if len(values) >= CLIPPED_SAMPLES else ""
    steps = np.abs(np.diff(values))
    resolution = steps[steps > 0].min()
    starts, ends = _runs(values)  # samples start to end - 1 are equal
    rest = np.median(values[time < 0]) if np.any(time < 0) else values[0]
    for k in np.argsort(starts - ends, kind="stable"):  # longest first
        start, end = int(starts[k]), int(ends[k])
        if end - start < CLIPPED_SAMPLES:
            break
        value, duration = values[start], time[end - 1] - time[start]
        jumps = [abs(values[at] - value) for at in (start - 1, end) if 0 <= at < len(values)]
        if (
            value in (low, high)
            and max(jumps) >= CLIPPED_JUMP * resolution
            and abs(value - rest) > OFF_REST * (high - low)
        ):
            return f"holds its extreme {value:.6g} for {end - start} samples from {time[start]:.4f} s: clipped?"
        if duration >= STUCK_TIME and time[start] >= 0 and abs(value - rest) > OFF_REST * (high - low):
            return f"holds {value:.6g} for {1e3 * duration:.1f} ms from {time[start]:.4f} s: stuck?"
    return ""


def _runs(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Starts and ends of the runs of equal values."""
    change = np.flatnonzero(np.diff(values) != 0) + 1
    return np.concatenate([[0], change]), np.concatenate([change, [len(values)]])
