"""Products and inverses of matrices with a few rows, as loops."""

import numpy as np
from numba import njit


@njit(cache=True, error_model="numpy")
def invert(matrix, keep, out):
    """Inverse of the kept rows and columns of a symmetric positive matrix, zero elsewhere; not finite if singular.

    Its diagonal is scaled to 1 (N/m beside N s/m); then Gauss-Jordan, which needs no pivoting for such a matrix.
    """
    n = len(matrix)
    scale = np.zeros(n)
    for j in range(n):
        if keep[j]:
            scale[j] = 1.0 / np.sqrt(matrix[j, j])
    for j in range(n):
        for k in range(n):
            out[j, k] = matrix[j, k] * scale[j] * scale[k] if keep[j] and keep[k] else 0.0
    for pivot in range(n):
        if not keep[pivot]:
            continue
        inverse = 1.0 / out[pivot, pivot]
        out[pivot, pivot] = 1.0
        for k in range(n):
            out[pivot, k] *= inverse
        for j in range(n):
            if j != pivot and keep[j]:
                factor = out[j, pivot]
                out[j, pivot] = 0.0
                for k in range(n):
                    out[j, k] -= factor * out[pivot, k]
    for j in range(n):
        for k in range(n):
            out[j, k] *= scale[j] * scale[k]


@njit(cache=True)
def multiply(a, b, out):
    """out = a b: for a few rows, a loop is done before the linear algebra library is called."""
    for j in range(a.shape[0]):
        for k in range(b.shape[1]):
            total = 0.0
            for i in range(a.shape[1]):
                total += a[j, i] * b[i, k]
            out[j, k] = total
