"""Products and inverses of matrices with a few rows, as loops."""

import numpy as np
from numba import njit

from .short_loops import short_loops


@njit(cache=True, error_model="numpy")
def invert(matrix, keep, scale):
    """Inverse, in place, of the kept rows and columns of a symmetric positive matrix, zero elsewhere; not finite if
    singular; scale (n,) is scratch.

    Its diagonal is scaled to 1 (N/m beside N s/m); then Gauss-Jordan, which needs no pivoting for such a matrix.
    """
    short_loops()
    n = len(matrix)
    for j in range(n):
        scale[j] = 1.0 / np.sqrt(matrix[j, j]) if keep[j] else 0.0
    for j in range(n):
        for k in range(n):
            matrix[j, k] = matrix[j, k] * scale[j] * scale[k] if keep[j] and keep[k] else 0.0
    for pivot in range(n):
        if not keep[pivot]:
            continue
        inverse = 1.0 / matrix[pivot, pivot]
        matrix[pivot, pivot] = 1.0
        for k in range(n):
            matrix[pivot, k] *= inverse
        for j in range(n):
            factor = matrix[j, pivot]
            if j != pivot and factor != 0.0:
                matrix[j, pivot] = 0.0
                for k in range(n):
                    matrix[j, k] -= factor * matrix[pivot, k]
    for j in range(n):
        for k in range(n):
            matrix[j, k] *= scale[j] * scale[k]


@njit(cache=True, inline="always")
def multiply(a, b, out):
    """out = a b, of which a may have many zeros: for a few rows, that is done before the linear algebra library is
    called."""
    for j in range(out.shape[0]):
        for k in range(out.shape[1]):
            out[j, k] = 0.0
        for i in range(a.shape[1]):
            if a[j, i] != 0.0:
                for k in range(out.shape[1]):
                    out[j, k] += a[j, i] * b[i, k]
