"""The spectrum of a sensor's noise, from its rest before the impact: white, coloured, or cut off by a filter.

Amplifiers colour noise: neighbouring samples are alike, and low frequencies hold more of its power than their share. An
autoregressive model e(t) = n(t) + sum over k of a_k n(t - k T), with white e of variance s^2, has the power density,
where white noise of variance s^2 has s^2,

    S(f) = s^2 / |1 + sum over k of a_k exp(-2 pi i f k T)|^2.

The a_k are found by Burg's recursion (Burg 1975), their number by Schwarz's criterion (BIC). Where that falls off as
steeply as behind a filter of SAE J211-1, passed forward and backward,

    G(f) = 1 / (1 + (f / f0)^4),   f0 = 2.0775 Hz times the channel frequency class,

the noise before it is taken as white, and what the filter has taken of the signal, too, is given back.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.fft import dct, idct
from scipy.linalg import toeplitz
from scipy.special import chdtrc

from crash_replay.conditioning import CFC_CLASSES

SLOW = 120.0
"""Hz: below it lies what a structure's motion is known by (SAE J211: CFC 60 is 3 dB down at 100 Hz), so that it is the
noise's power there that a fit has to do with."""

SIGNIFICANT = 0.001
"""Probability that white noise is called coloured."""

MOST = 12
"""Order: a filter of two poles run forward and backward takes four, a resonance two."""

PER_ORDER = 20
"""Samples, at least, for each order that is tried."""

TOLD = 10.0
"""Samples, of white noise, from which the power below SLOW must be known as well, to a factor of two ..."""

ALONE = 4.0
"""... and from each rest alone: where it is not, what is slow at rest is a body that sways, or one period of a hum,
which all sensors see, and says nothing of the noise in a crash. Of simulated rests of 15 to 50 ms noise behind a pole
at 170 Hz has 4.8 to 14, a sway of 10 Hz 0.7 to 2.7, a hum of 50 Hz as loud as the noise 1.1 to 2.4."""

FINE = 513
"""Frequencies that a density is looked at."""

STEEP = 1.6
"""Ratio of the frequencies where the density is 20 and 10 dB down, below which a filter has cut it off: 1.43 of SAE
J211's, 1.82 of two poles passed once, 3.3 of one."""

CORNER = 2.0775
"""Hz, f0 for each of a channel frequency class (SAE J211-1, appendix C)."""

SLOWEST_FILTER = CORNER * min(CFC_CLASSES)
"""Hz, f0 of CFC 60."""

TEN_DOWN = 1.21
"""Times f0: where G^2 is 10 dB down."""

ALIKE = 0.45
"""Natural logarithm of the ratio to a class's own f0 within which it is that class: classes are a factor of 1.7, 0.51,
apart at least, and 30 ms of noise tell f0 to a fifth at 10 kHz, and less well at 1 kHz: behind CFC 60 189 Hz, 0.42,
was found, behind CFC 180 581 Hz, 0.44."""

PASSED = 0.5
"""Of f0: the band in which a filtered channel is compared, and in which what the filter took, 6 %, is given back."""


class NoiseSpectrum(NamedTuple):
    """Of one channel."""

    std: float  # of a sample of white noise as strong as this one is below SLOW, or before the filter
    samples: float  # that this variance is known as well as from
    period: float  # s, between samples
    coefficients: tuple[float, ...] = ()  # a_k of coloured noise; none: white
    corner: float = np.inf  # f0, Hz, of the filter that has cut it off; inf: none has
    assumed: bool = False  # too little is recorded at rest to tell it

    @property
    def white(self) -> bool:
        return not self.coefficients and self.corner == np.inf

    @property
    def of_one_sample(self) -> float:
        """Standard deviation."""
        frequency = np.linspace(0.0, 0.5 / self.period, FINE)
        return self.std * float(np.sqrt((self.density(frequency) * _gain(frequency / self.corner) ** 2).mean()))

    @property
    def passed(self) -> float:
        """Hz up to which the channel is compared: beyond, a filter has taken away what moves."""
        return PASSED * self.corner

    def density(self, frequency: np.ndarray, means_over: int = 1) -> np.ndarray:
        """Relative to that of white noise of `std`, at frequencies in Hz; means_over: of means over so many samples
        each, which show what is faster than they are at a lower frequency, too."""
        found, rate = np.zeros(len(frequency)), 1.0 / (means_over * self.period)
        for k in range(means_over):
            f = frequency + k * rate
            share = np.sinc(f * means_over * self.period) / np.sinc(f * self.period)
            found += share**2 * _density(self.coefficients, f, self.period)
        return found / _slow_density(self.coefficients, self.period)

    def unfiltered(self, values: np.ndarray) -> np.ndarray:
        """Values (n,) of the channel with what its filter has taken in the band that is compared."""
        if self.corner == np.inf:
            return values
        frequency = np.arange(len(values)) / (2.0 * len(values) * self.period)
        gain = _gain(np.minimum(frequency / self.corner, PASSED))
        return idct(dct(values, norm="ortho") / gain, norm="ortho")


class Colour(NamedTuple):
    """Of one noise, or of several that are alike but for their strength."""

    coefficients: np.ndarray  # a_k; none: white
    samples: int  # that they were found from
    spread: float  # s^2 1' R^-1 1 / (1 + sum a)^2, R the autocovariance of n(t)
    corner: float = np.inf  # f0, Hz, of the filter that has cut it off; inf: none has

    def left(self, values: np.ndarray) -> float:
        """Variance of e in values (n,), forward and backward."""
        order, filter_ = len(self.coefficients), np.append(1.0, self.coefficients)
        both = (np.convolve(each, filter_)[order : len(values)] for each in (values, values[::-1]))
        return max(float(np.mean([e**2 for e in both])), np.finfo(float).tiny)

    def known(self, n: int, samples: int) -> float:
        """Samples of white noise whose variance is known as well as S(0) is, from n of this noise with the a_k from so
        many: var ln S(0) = 2 / n + 4 spread / samples, var ln s^2 = 2 / n."""
        return max(1.0 / (1.0 / n + 2.0 * self.spread / samples), 2.0)


def colour_of(rests: Sequence[np.ndarray], period: float) -> Colour:
    """Of noises alone, values (n,) each, that are as loud as they like; one that shows in no bit of a recorder says
    nothing."""
    samples = sum(len(rest) for rest in rests)
    rests = [(rest - rest.mean()) / np.std(rest) for rest in rests if np.ptp(rest) > 0.0]
    if not rests:
        return Colour(np.zeros(0), samples, 0.0)
    n = sum(len(rest) for rest in rests)
    variances, filters = _burg(rests, min(MOST, n // PER_ORDER, min(len(rest) for rest in rests) - 1))
    gained = n * np.log(variances[0] / variances)
    order = int(np.argmax(gained - np.arange(len(variances)) * np.log(n)))
    if order == 0 or chdtrc(order, gained[order]) > SIGNIFICANT:
        return Colour(np.zeros(0), n, 0.0)
    a = filters[order]
    return Colour(a, n, _spread(a, variances[order], rests), _corner(a, rests, period))


def noise_spectrum(values: np.ndarray, period: float, alike: Sequence[Colour] = ()) -> NoiseSpectrum:
    """Of noise alone, values (n,); alike: colours that others have, the one best known first: it has the first that
    leaves no more of it than its own does, but by chance."""
    n, values = len(values), values - values.mean()
    white = NoiseSpectrum(float(np.std(values, ddof=1)), float(n), period)
    own = colour_of([values], period)
    colour = next((one for one in alike if _explains(one, own, values)), own)
    a, order = colour.coefficients, len(colour.coefficients)
    if not order:
        return white
    if colour.corner < np.inf:
        return _before_the_filter(values, colour.corner, period)
    worth = colour.known(n, colour.samples)
    if worth < TOLD or colour.known(n, n) < ALONE:
        return white
    strength = colour.left(values) * n / (n - 1.0 - order) * _slow_density(a, period)
    return NoiseSpectrum(float(np.sqrt(strength)), worth, period, tuple(a))


def _explains(colour: Colour, own: Colour, values: np.ndarray) -> bool:
    """Whether it leaves no more of the values than their own colour, by a likelihood ratio."""
    order = max(len(colour.coefficients), len(own.coefficients), 1)
    lost = len(values) * np.log(colour.left(values) / own.left(values))
    return bool(chdtrc(order, max(lost, 0.0)) > SIGNIFICANT)


def seen_early(corner: float, loud: float = 1.0) -> float:
    """s by which a filter that runs backward, too, shows a motion before it begins: half a period of the highest
    frequency that it passes; one that jumps by `loud` times the noise, where that is more, as long as what G makes of
    a unit step, t before it, is above the noise:

        exp(-w t) cos(w t) / 2,   w = sqrt(2) pi f0."""
    return max(0.5 / PASSED, np.log(max(0.5 * loud, 1.0)) / (np.sqrt(2.0) * np.pi)) / corner


def _before_the_filter(values: np.ndarray, corner: float, period: float) -> NoiseSpectrum:
    frequency = np.arange(len(values)) / (2.0 * len(values) * period)
    inside = (frequency > 0.0) & (frequency < corner)
    power = (dct(values, norm="ortho")[inside] / _gain(frequency[inside] / corner)) ** 2
    return NoiseSpectrum(float(np.sqrt(power.mean())), float(len(power)), period, corner=corner)


def _corner(a: np.ndarray, rests: Sequence[np.ndarray], period: float) -> float:
    """f0 of the class that is near where the density is 10 dB down; of the likeliest, where none is; or as it is."""
    frequency = np.linspace(0.0, 0.5 / period, FINE)
    density = _density(a, frequency, period) / _slow_density(a, period)
    ten, twenty = (_first(frequency, density < down) for down in (0.1, 0.01))
    if not twenty < STEEP * ten:
        return np.inf
    of_classes, own = [CORNER * cfc for cfc in CFC_CLASSES], ten / TEN_DOWN
    nearest = min(of_classes, key=lambda f0: abs(np.log(f0 / own)))
    if abs(np.log(nearest / own)) < ALIKE:
        return nearest
    likelihoods = [_likelihood(rests, corner, twenty, period) for corner in (*of_classes, own)]
    likelihoods[-1] -= 0.5 * np.log(sum(len(rest) for rest in rests))  # it was found from them (BIC)
    return float((*of_classes, own)[np.argmax(likelihoods)])


def _likelihood(rests: Sequence[np.ndarray], corner: float, below: float, period: float) -> float:
    """Logarithm, less a constant, of what of noises (n,) is below so many Hz, white before a filter (Whittle 1953)."""
    found = 0.0
    for rest in rests:
        frequency = np.arange(1, len(rest)) / (2.0 * len(rest) * period)
        shape = _gain(frequency[frequency < below] / corner) ** 2
        if len(shape):  # a rest may be shorter than half a period of what is below
            power = dct(rest, norm="ortho")[1 : 1 + len(shape)] ** 2 / shape
            found -= 0.5 * (len(shape) * np.log(power.mean()) + np.log(shape).sum())
    return found


def _gain(of_corner: np.ndarray) -> np.ndarray:
    return 1.0 / (1.0 + of_corner**4)


def _first(frequency: np.ndarray, there: np.ndarray) -> float:
    return float(frequency[there.argmax()]) if there.any() else np.inf


def _burg(rests: Sequence[np.ndarray], most: int) -> tuple[np.ndarray, list[np.ndarray]]:
    """Variance of e and coefficients a, of each order from 0, that all of them have."""
    pairs = [(rest, rest) for rest in rests]
    variances, filters = [sum(float(rest @ rest) for rest in rests) / sum(len(rest) for rest in rests)], [np.zeros(0)]
    for _ in range(most):
        pairs = [(ahead[1:], behind[:-1]) for ahead, behind in pairs]
        power = sum(float(ahead @ ahead + behind @ behind) for ahead, behind in pairs)
        if not power > 0.0:
            break
        reflection = -2.0 * sum(float(ahead @ behind) for ahead, behind in pairs) / power
        filters.append(np.append(filters[-1], 0.0) + reflection * np.append(filters[-1][::-1], 1.0))
        variances.append(variances[-1] * (1.0 - reflection**2))
        pairs = [(ahead + reflection * behind, behind + reflection * ahead) for ahead, behind in pairs]
    return np.maximum(variances, np.finfo(float).tiny), filters


def _density(a, frequency: np.ndarray, period: float) -> np.ndarray:
    turn = np.exp(-2j * np.pi * period * np.outer(frequency, np.arange(1, len(a) + 1)))
    passed = np.abs(1.0 + turn @ np.asarray(a, dtype=float)) ** 2
    return 1.0 / np.maximum(passed, np.finfo(float).eps ** 2)  # what does not decay at all is a root but for rounding


def _slow_density(a, period: float) -> float:
    return float(_density(a, np.linspace(0.0, min(SLOW, 0.5 / period), 33), period).mean())


def _spread(a: np.ndarray, variance: float, rests: Sequence[np.ndarray]) -> float:
    """What a sample of coloured noise tells less of S(0) than one of white noise, of which var ln s^2 = 2 / n:

    var ln S(0) = 2 / n + 4 s^2 1' R^-1 1 / (n (1 + sum a)^2) of n samples, R the autocovariance of n(t).
    """
    n = sum(len(rest) for rest in rests)
    autocovariance = [sum(float(rest[: len(rest) - k] @ rest[k:]) for rest in rests) / n for k in range(len(a))]
    ones = np.ones(len(a))
    return max(variance * float(ones @ np.linalg.solve(toeplitz(autocovariance), ones)) / (1.0 + a.sum()) ** 2, 0.0)
