"""Noise as large as what a model leaves: honest weights where nothing in the vocabulary reaches the sensors' noise.

A real structure vibrates, and a lumped model leaves slow errors that its channels share (an error of a force
pushes one body and pulls the other). So outputs are compared in the band that is meant for the motion of a whole
structure (SAE J211 CFC 60), and the power that the model leaves there, as a matrix over the channels, takes the
place of the sensors' noise. Evidence then counts as many independent samples as there are, and a relation
between channels that holds in spite of a poor force (a balance of inertias) has the weight that it deserves.
"""

from collections.abc import Sequence

import numpy as np
from scipy.fft import dct

from crash_replay.conditioning import RATE_PER_CFC

from .grid import binned, bins_of
from .record import ObservedRecord

CFC = 60
"""The band in which forces and inertias of a structure that rings are compared (SAE J211: its motion as a whole)."""

SLOWEST = RATE_PER_CFC * CFC
"""Samples in a second that the filter needs."""

BIN = 4e-3
"""s: means over it keep what is below 125 Hz; CFC 60 is 3 dB down at 100 Hz."""

EDGES = (0.0, CFC / 2.0, CFC, 0.5 / BIN)
"""Hz: two halves of the band of `CFC`, and what its filter still passes above, up to what the bins keep."""


def with_inflated_noise(
    records: Sequence[ObservedRecord], residuals: Sequence[np.ndarray]
) -> tuple[ObservedRecord, ...]:
    """The records with the noise that residuals, (n, q) SI each, show; never less than the sensors' own."""
    coarse, powers, levels = [], [], []
    for record, residual in zip(records, residuals):
        bin_, valid, bins = bins_of(record.time, record.at, record.measured, BIN, record.seen_early)
        weight = valid[record.at] / record.noise
        spectrum = dct(binned(bin_[record.at], np.nan_to_num(residual) * weight, bins), norm="ortho", axis=0)
        frequency = np.arange(bins) / (2.0 * float(record.time[-1]))
        bands = [(frequency >= a) & (frequency < b) for a, b in zip(EDGES, EDGES[1:])]
        powers.append(spectrum.T @ spectrum / bins)
        levels.append([float((spectrum[inside] ** 2).mean()) for inside in bands if inside.any()])
        coarse.append(record._replace(bin=bin_, valid=valid, bins=bins, weight=None))
    # the strongest band says how many samples are independent: as many as of white noise as strong as it
    power = np.mean(powers, axis=0)
    peak = max(float(np.mean(level)) for level in zip(*levels)) / max(float(np.trace(power)) / len(power), 1e-30)
    covariance = np.eye(len(power)) + max(peak, 1.0) * power
    whitener = np.linalg.inv(np.linalg.cholesky(covariance))
    return tuple(record._replace(whitener=whitener) for record in coarse)
