"""Samples at the end of a sensor's range: they say no more than that the truth lies beyond."""

from math import erf, sqrt

import numpy as np

from .differences import by_differences

RUN = 4
"""Samples in a row at a channel's very largest or smallest value: two such already are chance in any noise, where the
steps of its numbers are finer than that."""
STEPS = 3.0
"""Of a channel's numbers, by which it must have come to its extreme with one sample: the top of a smooth peak that is
level for RUN samples has a step of one, or two, beside it."""
CHANCE = 1e-3
"""Probability that some samples of a level top are the same number for so long: below it the range ends there."""
FINER = 1e-5
"""Of the largest value: a channel whose noise is less has none, and what is level in it may be the truth."""
FEWEST = 40
"""Samples beside them that tell whether there is noise, to a tenth."""
BESIDE = 3.0
"""Standard deviations of the noise below an end at which one sample in 700 is still at it. Nearer than that those that
are not at it are the low ones; with 2 what is left of a looked-at pulse is one deviation of its mean too low."""
MOST = 0.5
"""Share of the samples: of what is at its end for longer nothing else is known, and it is left as it is."""


def clipped(values: np.ndarray) -> np.ndarray:
    """(n,) bool: which of values (n,), NaN where not valid, are at an extreme that is reached RUN times in a row, or
    beside such as close to it as the noise is large."""
    found = np.zeros(len(values), dtype=bool)
    valid = np.isfinite(values)
    if not valid.any():
        return found
    extremes = [there for extreme in (np.nanmax(values), np.nanmin(values)) if _stays(there := values == extreme)]
    rest = values[valid & ~np.any([found, *extremes], axis=0)]
    noise = by_differences(rest) if len(rest) >= FEWEST else 0.0
    step = np.diff(np.unique(values[valid])).min(initial=np.inf)
    for there in extremes:
        if _is_no_chance(there, noise / step) or _comes_suddenly(values, there, step):
            found |= _with_those_beside(values, there, BESIDE * noise)
    believed = noise > FINER * np.nanmax(np.abs(values)) and found.mean() < MOST
    return found if believed else np.zeros(len(values), dtype=bool)


def _with_those_beside(values: np.ndarray, there: np.ndarray, near: float) -> np.ndarray:
    """With the samples among and beside those at an end whose mean over some is near it: one by one only noise tells
    which of them are at it, and those that are not are too low."""
    valid, some = np.isfinite(values), np.ones(2 * RUN + 1)
    count = np.convolve(valid, some, "same")
    mean = np.convolve(np.where(valid, values, 0.0), some, "same") / np.maximum(count, 1.0)
    close = there | ((count > 0.0) & (np.abs(mean - values[there][0]) < near))
    runs = runs_of(close)
    found = np.zeros(len(values), bool)
    for start, stop in runs[[there[start:stop].any() for start, stop in runs]]:
        found[start:stop] = valid[start:stop]
    return found


def _stays(there: np.ndarray) -> bool:
    return np.convolve(there, np.ones(RUN), "valid").max(initial=0.0) >= RUN


def _is_no_chance(there: np.ndarray, noise: float) -> bool:
    """Whether noise, in steps of the channel's numbers, would not let a level top be the same number for so long."""
    longest = max((stop - start for start, stop in runs_of(there)), default=0)
    return chance_of_run(int(longest), len(there), noise) < CHANCE


def chance_of_run(length: int, samples: int, noise: float) -> float:
    """Of so many samples in a row that are the same number, somewhere among all, at most; noise: in steps of the
    numbers."""
    same = erf(0.5 / (noise * sqrt(2.0))) if noise else 1.0  # the largest probability that any number can have
    return samples * same**length


def runs_of(there: np.ndarray) -> np.ndarray:
    """(m, 2) first sample of each run, and the one after its last."""
    return np.flatnonzero(np.diff(np.concatenate([[0], there.view(np.int8), [0]]))).reshape(-1, 2)


def _comes_suddenly(values: np.ndarray, there: np.ndarray, step: float) -> bool:
    """Whether a sample beside any run of RUN is more than STEPS of the channel's own away."""
    runs = runs_of(there)
    for start, stop in runs[runs[:, 1] - runs[:, 0] >= RUN]:
        beside = values[[k for k in (start - 1, stop) if 0 <= k < len(values)]]
        if np.nanmax(np.abs(beside - values[start]), initial=0.0) > STEPS * step:
            return True
    return False
