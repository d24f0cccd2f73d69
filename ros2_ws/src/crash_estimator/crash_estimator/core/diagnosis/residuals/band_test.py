"""Whether a residual is at the noise floor: its power in frequency bands, channel by channel.

The cosine transform of white noise of n samples has n independent coefficients of the same variance; the mean
square of m of them over the noise variance, itself known from s samples, has the F distribution with m and s
degrees of freedom. A missing effect leaves its power in a few low bands, where few coefficients hide little.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.fft import dct
from scipy.special import fdtrc

EDGES = (0.0, 60.0, 120.0, 240.0, 500.0, 1000.0, 2000.0, np.inf)
"""Hz: octaves, about, from the class of a structure's motion (SAE J211 CFC 60) on; the last one reaches as far as was
sampled."""

SIGNIFICANT = 0.001
"""Probability that white noise fails in any band of any channel: a wrong alarm once in a thousand tests; what a missing
effect leaves is mostly far beyond it."""

ABSORBING = EDGES[:5]
"""Hz: what is fitted moves slowly; above, a fit absorbs next to nothing."""

LEAST_LEFT = 1.0
"""Degrees of freedom: where a fit leaves fewer, there is nothing to tell from."""

CLIP = 4.5
"""Standard deviations: single samples beside a jump of the force are no missing effect."""


class Band(NamedTuple):
    """The worst band of one output of one record."""

    record: int
    output: int
    low: float  # Hz
    high: float  # Hz


class BandTest(NamedTuple):
    white: bool
    probability: float  # that white noise looks as bad, over all bands
    worst: Band


class Absorbed(NamedTuple):
    """What a fit leaves of noise in one output of one record: residual and derivative, whitened, means over bins."""

    residual: np.ndarray  # (bins,)
    root: np.ndarray  # (bins, p) its derivative times a root of the parameters' covariance
    period: float  # s


def band_test(residuals, noise_samples, periods) -> BandTest:
    """residuals: per record (n, q) in standard deviations of the noise, NaN where not valid; noise_samples (q,) per
    record; periods: s between samples, per record."""
    found = []
    for r, (residual, samples, period) in enumerate(zip(residuals, noise_samples, periods)):
        for q in range(residual.shape[1]):
            z = residual[:, q]
            for low, high, _, power in power_in_bands(z[np.isfinite(z)], period, EDGES):
                p = probability_of(len(power), samples[q], float(power.mean()))
                found.append((p, Band(r, q, low, min(high, 0.5 / period))))
    return _worst_of(found)


def band_test_of_fit(records: Sequence[Sequence[Absorbed]], noise_samples) -> BandTest:
    """The same of a fit's residual, sharper in the low bands: what the fit has absorbed there is no longer expected.

    The residual of the right model has the covariance C = I - J P J', with the derivative J and the posterior
    covariance P of the parameters. The sum of its squares in a band has the mean m = tr C_B and, nearly, the
    distribution of m / v chi^2 with v = m^2 / tr C_B^2 degrees of freedom (Satterthwaite).
    """
    found = []
    for r, (outputs, samples) in enumerate(zip(records, noise_samples)):
        for q, one in enumerate(outputs):
            root = dct(one.root, norm="ortho", axis=0)
            for low, high, inside, power in power_in_bands(one.residual, one.period, ABSORBING):
                covariance = np.eye(len(power)) - root[inside] @ root[inside].T
                mean, square = float(np.trace(covariance)), float((covariance**2).sum())
                if mean < LEAST_LEFT:
                    continue
                ratio = float(power.sum()) / mean
                found.append((probability_of(mean**2 / square, samples[q], ratio), Band(r, q, low, high)))
    return _worst_of(found)


def power_in_bands(
    z: np.ndarray, period: float, edges: Sequence[float]
) -> Iterator[tuple[float, float, np.ndarray, np.ndarray]]:
    """The bands that hold any coefficients of the cosine transform: low and high Hz, which (n,), and their power."""
    power = dct(np.clip(z, -CLIP, CLIP), norm="ortho") ** 2
    frequency = np.arange(len(z)) / (2.0 * len(z) * period)
    for low, high in pairwise(edges):
        inside = (frequency >= low) & (frequency < high)
        if inside.any():
            yield low, high, inside, power[inside]


def probability_of(freedom: float, samples: float, ratio: float) -> float:
    """That noise of so many degrees of freedom is as large, over one that is known from so many samples."""
    return float(fdtrc(freedom, min(float(samples), 1e6), ratio))


def of_any(least: float, tests: int) -> float:
    """Probability that any of so many independent tests gives one as low as the least (Sidak 1967)."""
    return float(-np.expm1(tests * np.log1p(-min(least, 1.0 - 1e-12))))


def _worst_of(found: Sequence[tuple[float, Band]]) -> BandTest:
    least = min(found, key=lambda one: one[0], default=(1.0, Band(0, 0, 0.0, 0.0)))
    probability = of_any(least[0], len(found))
    return BandTest(probability > SIGNIFICANT, probability, least[1])
