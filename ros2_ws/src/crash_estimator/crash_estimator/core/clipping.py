"""Samples at the end of a sensor's range: they say no more than that the truth lies beyond."""

from collections.abc import Sequence

import numpy as np

from crash_replay.recording import Recording

from .differences import by_differences

RUN = 4
"""Samples in a row at a channel's very largest or smallest value: two such already are chance in any noise, where the
steps of its numbers are finer than that."""
STEPS = 3.0
"""Of a channel's numbers, by which it must have come to its extreme with one sample: the top of a smooth peak that is
level for RUN samples has a step of one, or two, beside it."""
FINER = 1e-5
"""Of the largest value: a channel whose noise is less has none, and what is level in it may be the truth."""
FEWEST = 40
"""Samples beside them that tell whether there is noise, to a tenth."""
MOST = 0.5
"""Share of the samples: of what is at its end for longer nothing else is known, and it is left as it is."""


def clipped(values: np.ndarray) -> np.ndarray:
    """(n,) bool: which of values (n,), NaN where not valid, are at an extreme that is reached RUN times in a row."""
    found = np.zeros(len(values), dtype=bool)
    valid = np.isfinite(values)
    if not valid.any():
        return found
    for extreme in (np.nanmax(values), np.nanmin(values)):
        there = values == extreme
        if _stays(there) and _comes_suddenly(values, there):
            found |= there
    rest = values[valid & ~found]
    noise = by_differences(rest) if len(rest) >= FEWEST else 0.0
    believed = noise > FINER * np.nanmax(np.abs(values)) and found.mean() < MOST
    return found if believed else np.zeros(len(values), dtype=bool)


def _stays(there: np.ndarray) -> bool:
    return np.convolve(there, np.ones(RUN), "valid").max(initial=0.0) >= RUN


def _comes_suddenly(values: np.ndarray, there: np.ndarray) -> bool:
    """Whether a sample beside any run of RUN is more than STEPS of the channel's own away."""
    step = np.diff(np.unique(values[np.isfinite(values)])).min(initial=np.inf)
    runs = np.flatnonzero(np.diff(np.concatenate([[0], there.view(np.int8), [0]]))).reshape(-1, 2)
    for start, stop in runs[runs[:, 1] - runs[:, 0] >= RUN]:
        beside = values[[k for k in (start - 1, stop) if 0 <= k < len(values)]]
        if np.nanmax(np.abs(beside - values[start]), initial=0.0) > STEPS * step:
            return True
    return False


def without_clipped(recordings: Sequence[Recording]) -> tuple[list[Recording], str]:
    """With holes where an acceleration or a force is clipped, and a line that says so; "" where none is."""
    found, said = [], []
    for recording in recordings:
        values = recording.values.copy()
        for k, channel in enumerate(recording.test.channels):
            lost = clipped(values[:, k]) if channel.quantity in ("acceleration", "force") else np.zeros(0, dtype=bool)
            if lost.any():
                values[lost, k] = np.nan
                said.append(
                    f"{channel.name} of {recording.test.id} is clipped, {np.count_nonzero(lost)} samples left out"
                )
        found.append(Recording(recording.test, recording.time_ns, values))
    return found, "; ".join(said)
