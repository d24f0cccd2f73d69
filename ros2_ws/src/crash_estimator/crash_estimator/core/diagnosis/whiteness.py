"""Whether a residual is at the noise floor: its power in frequency bands, channel by channel.

The cosine transform of white noise of n samples has n independent coefficients of the same variance; the mean
square of m of them over the noise variance, itself known from s samples, has the F distribution with m and s
degrees of freedom. A missing effect leaves its power in a few low bands, where few coefficients hide little.
"""

from typing import NamedTuple

import numpy as np
from scipy.fft import dct
from scipy.special import fdtrc

EDGES = (0.0, 60.0, 120.0, 240.0, 500.0, 1000.0, 2000.0, np.inf)
"""Hz."""

SIGNIFICANT = 0.001
"""Probability that white noise fails in any band of any channel: a wrong alarm once in a thousand tests; what a missing
effect leaves is mostly far beyond it."""

CLIP = 4.5
"""Standard deviations: single samples beside a jump of the force are no missing effect."""


class Band(NamedTuple):
    """The worst band of one output of one record."""

    record: int
    output: int
    low: float  # Hz
    high: float  # Hz
    ratio: float  # power over the noise's


class Whiteness(NamedTuple):
    white: bool
    probability: float  # that white noise looks as bad, over all bands
    worst: Band


def whiteness(residuals, noise_samples, periods) -> Whiteness:
    """residuals: per record (n, q) in standard deviations of the noise, NaN where not valid; noise_samples (q,) per
    record; periods: s between samples, per record."""
    tests, least = 0, (np.inf, Band(0, 0, 0.0, 0.0, 0.0))
    for r, (residual, samples, period) in enumerate(zip(residuals, noise_samples, periods)):
        for q in range(residual.shape[1]):
            z = residual[:, q]
            z = np.clip(z[np.isfinite(z)], -CLIP, CLIP)
            power = dct(z, norm="ortho") ** 2
            frequency = np.arange(len(z)) / (2.0 * len(z) * period)
            for low, high in zip(EDGES, EDGES[1:]):
                inside = (frequency >= low) & (frequency < high)
                m = int(np.count_nonzero(inside))
                if not m:
                    continue
                ratio = float(power[inside].mean())
                p = float(fdtrc(m, min(float(samples[q]), 1e6), ratio))
                tests += 1
                if p < least[0]:
                    least = p, Band(r, q, low, min(high, 0.5 / period), ratio)
    probability = float(-np.expm1(tests * np.log1p(-min(least[0], 1.0 - 1e-12))))
    return Whiteness(probability > SIGNIFICANT, probability, least[1])
