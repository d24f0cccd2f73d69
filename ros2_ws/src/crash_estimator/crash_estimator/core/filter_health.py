"""Whether a filter's covariance still is one.

Parameters differ by orders of magnitude, so its condition is that of the correlations

    R_ij = P_ij / sqrt(P_ii P_jj)

of the parameters that are not known exactly (P_ii > 0). R is singular where the samples so far cannot tell two of them
apart, before contact above all; it must not have an eigenvalue below zero by more than rounding.
"""

from typing import NamedTuple

import numpy as np

ROUNDING = 1e-9
"""What the smallest eigenvalue of R may be below zero: products of many updates, each to 1e-16 of the largest entry."""


class CovarianceHealth(NamedTuple):
    finite: bool
    positive: bool  # semi-definite, but for rounding
    condition: float  # of the correlations; inf: some cannot be told apart


def covariance_health(covariance: np.ndarray) -> CovarianceHealth:
    """covariance: (p, p)."""
    if not np.isfinite(covariance).all():
        return CovarianceHealth(False, False, np.nan)
    variance = np.diagonal(covariance)
    uncertain = variance > 0.0
    if not uncertain.any():
        return CovarianceHealth(True, bool((variance == 0.0).all()), 1.0)
    spread = np.sqrt(variance[uncertain])
    eigenvalues = np.linalg.eigvalsh(covariance[np.ix_(uncertain, uncertain)] / np.outer(spread, spread))
    smallest, largest = float(eigenvalues[0]), float(eigenvalues[-1])
    positive = smallest >= -ROUNDING and bool((variance >= 0.0).all())
    return CovarianceHealth(True, positive, largest / smallest if smallest > 0.0 else np.inf)
