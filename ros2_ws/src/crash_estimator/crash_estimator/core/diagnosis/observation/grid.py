"""The instants of a record, and the bins that its outputs are compared in."""

from typing import Any

import numpy as np
from numba import njit
from scipy.fft import dct, prev_fast_len

from ... import compile_cache as _compile_cache  # noqa: F401  before any compiled function is defined

BIN = 4e-4
"""s: length of the bins that outputs are averaged over; they keep what is below 1250 Hz, and a crash model says nothing
of what is above 1 kHz (SAE J211: CFC 600 is its finest class for structures)."""

DRIVEN_MODES = 12
"""Cosines of a driven channel's noise beside its mean: integrated twice, what is faster moves next to nothing. With 6,
what was left moved a padding that springs back at 400 to 700 kN/m in six of 13 looked-at tests of 0.12 s, and a small
second effect was told for it; with 12 in none."""

SLOW_OF_THEM = 2
"""Of those, where a body rings faster than they are: the others are then around the cosine that it rings with, where it
amplifies what the driving sensor errs by. On a shaken table nothing was missing, and in five of 23 looked-at tests a
damper or a delay was told, of up to 35 nats; in none of the five with these, in one of two with six slow ones."""

ATTACHED_MODES = 6
"""The same of an attached body, which mostly pushes by its inertia alone: no stiff spring feels where it is. It is
what was tried first; with 9 and with 12 the engine of NHTSA 10146, which rings, is named within a quarter of its mass
as well, of three looked-at copies each, though in one the car's unloading comes before it."""

FEWEST_KEPT = 0.98
"""Share of the bins that is compared at least: the last ones of a recording say least."""


def grid_of(sample_time: np.ndarray, longest: float) -> tuple[np.ndarray, np.ndarray]:
    """Instants from time zero on, with every sample among them -> (g,) s, (n,) index of each sample."""
    stops = sample_time if sample_time[0] == 0.0 else np.concatenate([[0.0], sample_time])
    steps = np.maximum(np.ceil(np.diff(stops) / longest - 1e-6).astype(int), 1)
    index = np.concatenate([[0], np.cumsum(steps)])
    within = np.arange(index[-1]) - np.repeat(index[:-1], steps)
    time = within * np.repeat(np.diff(stops) / steps, steps) + np.repeat(stops[:-1], steps)
    return np.append(time, stops[-1]), index[len(stops) - len(sample_time) :]


def modes_of(measured: np.ndarray) -> np.ndarray:
    """(1 + DRIVEN_MODES,) half periods over a record of the cosines that a driven channel's noise is known by: slow
    ones, or those around the one that is strongest in what was measured (n, q), if that is faster."""
    values = np.nan_to_num(measured)
    spread = values.std(axis=0)
    values = values / np.where(spread > 0.0, spread, 1.0)
    strongest = int((dct(values, axis=0)[1:] ** 2).sum(axis=1).argmax()) + 1
    modes, around = np.arange(DRIVEN_MODES + 1), DRIVEN_MODES - SLOW_OF_THEM
    if strongest > DRIVEN_MODES:
        modes[-around:] = strongest - around // 2 + np.arange(around)
    return modes


def on_grid(time: np.ndarray, at: np.ndarray, modes: np.ndarray) -> dict[str, Any]:
    """What an ObservedRecord says of its instants, and of the samples at some of them; modes: as of `modes_of`."""
    dt = np.diff(time, prepend=time[0])
    return {
        "time": time,
        "dt": dt,
        "step": float(np.median(dt[1:])),
        "at": at,
        "period": float(np.median(np.diff(time[at]))),
        "cosines": np.cos(np.outer(np.pi * time / time[-1], modes)),
    }


@njit(cache=True)
def binned(bin_: np.ndarray, values: np.ndarray, bins: int) -> np.ndarray:
    """(bins, columns) sums of values (n, columns), each in its bin (n,); -1: in none."""
    found = np.zeros((bins, values.shape[1]))
    for k in range(values.shape[1]):
        for t in range(len(bin_)):
            if bin_[t] >= 0:
                found[bin_[t], k] += values[t, k]
    return found


def _of_fast_length(bins: int) -> int:
    """A few less where cosine transforms of so many take several times as long, as of a prime number."""
    fewer = prev_fast_len(bins)
    return fewer if fewer >= FEWEST_KEPT * bins else bins


def bins_of(
    time: np.ndarray,
    at: np.ndarray,
    measured: np.ndarray,
    length: float = BIN,
    mixed: float = 0.0,
    transformed: bool = False,
) -> tuple[np.ndarray, np.ndarray, int]:
    """`bin`, `valid` and `bins` of an ObservedRecord whose bins are `length` s long.

    mixed: s from the impact on in which a filter shows what was before it as well; they are not compared.
    transformed: whether the noise is coloured, for which their cosine transforms are taken again and again.
    """
    period = float(np.median(np.diff(time[at])))
    per_bin = max(1, int(round(length / period)))
    bin_ = np.full(len(time), -1)
    bin_[at] = np.arange(len(at)) // per_bin
    bins = int(bin_.max()) + 1
    bins = _of_fast_length(bins) if transformed else bins
    bin_[bin_ >= bins] = -1
    ok = np.isfinite(measured).astype(float)
    ok[bin_[at] < 0] = 0.0
    # at the very impact forces may jump: on which side this sample lies is chance
    ok[(time[at] == 0.0) | (time[at] < mixed)] = 0.0
    count = binned(bin_[at], ok, bins)
    valid = np.zeros((len(time), measured.shape[1]))
    valid[at] = ok / np.sqrt(np.maximum(count[bin_[at]], 1.0))
    return bin_, valid, bins
