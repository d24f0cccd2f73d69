"""The ARMA(p, q) model of an equation's error that recursive Gauss-Newton finds (thesis 4.1)."""

from typing import NamedTuple

import numpy as np

LARGEST_ROOT = 0.98
"""Of D and A, in modulus: at 1 the noise model would integrate, beyond it the predictor diverges."""


class NoiseModel(NamedTuple):
    """D(B) e = A(B) eps of one equation."""

    d: np.ndarray  # (p,)
    a: np.ndarray  # (q,)
    covariance: np.ndarray  # (p + q, p + q) of d and a
    variance: float  # of eps, (m/s^2)^2 or N^2


def stable(coefficients: np.ndarray, limit: float = LARGEST_ROOT) -> np.ndarray:
    """Coefficients c of 1 + c_1 B + ... with every root r of z^n + c_1 z^(n-1) + ... at most `limit` in modulus.

    All roots are drawn in by the same factor f, which multiplies c_i by f^i and keeps the shape of the spectrum.
    """
    if not len(coefficients) or np.isinf(limit) or np.abs(coefficients).sum() < limit ** len(coefficients):
        return coefficients  # by Rouche's theorem all roots are within
    largest = np.abs(np.roots(np.concatenate([[1.0], coefficients]))).max()
    if largest <= limit:
        return coefficients
    return coefficients * (limit / largest) ** np.arange(1, len(coefficients) + 1)
