"""What of a channel is compared, frequency by frequency: what its noise leaves, in the band that a model speaks for.

The cosine transform of coloured noise has coefficients that are nearly independent, each with the noise's power density
at its frequency as its variance. So a residual is whitened by dividing its coefficients by the root of that; those
above the band are left out.
"""

from collections.abc import Sequence

import numpy as np
from scipy.fft import dct, idct

from ...noise_spectrum import NoiseSpectrum


def weights(
    spectra: Sequence[NoiseSpectrum], below: float, n: int, period: float, means_over: int = 1
) -> np.ndarray | None:
    """(n, q) of the coefficients of n means over so many samples each; below: Hz; None: all of them one."""
    if below == np.inf and all(spectrum.white for spectrum in spectra):
        return None
    frequency = np.arange(n) / (2.0 * n * means_over * period)
    found = [np.where(frequency < min(below, s.passed), s.density(frequency, means_over) ** -0.5, 0.0) for s in spectra]
    return np.stack(found, axis=1)


def coefficients(values: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Of values (n, q, ...), weighted by (n, q): their sums of squares and products are those of what is `filtered`."""
    return weight.reshape(*weight.shape, *[1] * (values.ndim - 2)) * dct(values, axis=0, norm="ortho")


def filtered(values: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """values (n, q, ...) with their coefficients weighted by (n, q)."""
    return idct(coefficients(values, weight), axis=0, norm="ortho")
