"""Laplace's approximation: the posterior as a normal distribution about its maximum, and the evidence that gives.

    ln evidence = - 1/2 cost - 1/2 ln det H + 1/2 ln det Lambda + ln 2 for each half-normal prior

with H the posterior's precision at the maximum and Lambda the prior's (MacKay 1992).
"""

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, solve_triangular

from ..parameterization.layout import Layout

RIDGE = 1e-8
"""Share of a parameter's own precision: two columns that say the same may round to less than positive."""


def cholesky(matrix: np.ndarray) -> tuple[np.ndarray, bool]:
    """Factor of a matrix with a unit diagonal. Raises LinAlgError where a ridge does not make it positive."""
    try:
        return cho_factor(matrix, lower=True, check_finite=False)
    except LinAlgError:
        return cho_factor(matrix + RIDGE * np.eye(len(matrix)), lower=True, check_finite=False)


def posterior(matrix: np.ndarray) -> tuple[np.ndarray, float]:
    """Covariance (p, p) and the logarithm of the precision's determinant.

    A parameter held at its limit counts like any other: it was free to be elsewhere.
    """
    scale = 1.0 / np.sqrt(np.diagonal(matrix))
    factor = cholesky(matrix * np.outer(scale, scale))[0]
    inner = solve_triangular(factor, np.eye(len(factor)), lower=True, check_finite=False)
    log_determinant = 2.0 * float(np.log(np.diagonal(factor)).sum() - np.log(scale).sum())
    return (inner.T @ inner) * np.outer(scale, scale), log_determinant


def log_prior(layout: Layout) -> float:
    """Logarithm of the determinant of the prior's precision, and what limits add: half a normal is twice as dense."""
    prior = layout.prior
    scale = 1.0 / np.sqrt(np.diagonal(prior.precision))
    value = float(np.linalg.slogdet(prior.precision * np.outer(scale, scale))[1] - 2.0 * np.log(scale).sum())
    return value + 2.0 * np.log(2.0) * np.count_nonzero((prior.low == 0.0) & (prior.mean == 0.0))
