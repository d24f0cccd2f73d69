"""A record in means over short bins, on a grid of the bins alone: small enough to be fitted while the test is replayed.

A mean over a bin is a sample with less noise, at the bin's centre; what is faster than the bins is not seen.
"""

import numpy as np

from .grid import modes_of, on_grid
from .record import ObservedRecord, Signal

STEP = 5e-4
"""s: the linear-acceleration step's phase error, (omega dt)^2 / 24, is 4e-4 for the stiffest contact, 200 rad/s."""

MOST_STEPS = 160
"""About: of a long record the bins are longer, or an update of the ranking would take more than its budget."""


def in_bins(record: ObservedRecord) -> ObservedRecord:
    """The record in bins; itself where its samples are no closer than the bins would be."""
    time = record.time[record.at]
    per_bin = int(round(max(STEP, (time[-1] - time[0]) / MOST_STEPS) / record.period))
    bins = len(time) // max(per_bin, 1)
    if per_bin < 2 or bins < 2:
        return record
    used = bins * per_bin  # the last samples: what is new must be seen, what is left over is at the impact
    centre = time[-used:].reshape(bins, per_bin).mean(axis=1)
    measured = record.measured[-used:].reshape(bins, per_bin, -1)
    compared = record.valid[record.at][-used:].reshape(bins, per_bin, -1) > 0.0
    count = compared.sum(axis=1)
    mean = np.where(compared, measured, 0.0).sum(axis=1) / np.where(count, count, np.nan)
    grid = np.concatenate([[0.0], centre])
    coarse = record._replace(
        **on_grid(grid, np.arange(1, bins + 1), modes_of(record.measured)),
        measured=mean,
        noise=record.noise / np.sqrt(per_bin),
        signals={name: _in_bins(signal, used, per_bin, grid) for name, signal in record.signals.items()},
        bin=np.arange(-1, bins),
        valid=np.concatenate([np.zeros((1, mean.shape[1])), np.sqrt(count / per_bin)]),
        bins=bins,
        means_over=per_bin,
    )
    return coarse.in_band(record.below)


def _in_bins(signal: Signal, used: int, per_bin: int, grid: np.ndarray) -> Signal:
    means = signal.values[-used:].reshape(-1, per_bin).mean(axis=1)
    values = np.concatenate([means[:1], means])
    spectrum = signal.spectrum._replace(std=signal.noise / np.sqrt(per_bin))
    return signal._replace(time=grid, values=values, on_grid=values, spectrum=spectrum)
