"""Dynamic time warping of two signals (compiled): Sakoe and Chiba 1978, IEEE Trans. ASSP 26, with a band, no slope
limit."""

import numpy as np
from numba import njit

from . import compile_cache as _compile_cache  # noqa: F401  before any compiled function is defined

ABOVE, LEFT, BOTH = 0, 1, 2
"""Where the cheapest way to a pair comes from: (i - 1, j), (i, j - 1) or (i - 1, j - 1)."""


@njit(cache=True)
def warping_path(c, t, radius):
    """The path of least summed squared difference of c (n,) and t (n,), |i - j| <= radius -> its i and its j, (m,).

    D_ij = (c_i - t_j)^2 + min(D_{i-1,j}, D_{i,j-1}, D_{i-1,j-1}); of equally cheap ways the first of these. A byte is
    kept of each of n (2 radius + 1) pairs: where the way comes from, at column j - i + radius.
    """
    n, width = len(t), 2 * radius + 1
    came = np.empty((n, width), np.uint8)
    before, now = np.full(width + 2, np.inf), np.full(width + 2, np.inf)  # D of a row, from column 1 on
    before[radius + 1] = 0.0  # as if there were a pair before the first
    for i in range(n):
        now[:] = np.inf
        for j in range(max(0, i - radius), min(n, i + radius + 1)):
            column = j - i + radius
            above, left, both = before[column + 2], now[column], before[column + 1]
            now[column + 1] = (c[i] - t[j]) ** 2 + min(above, left, both)
            came[i, column] = ABOVE if above <= left and above <= both else LEFT if left <= both else BOTH
        before, now = now, before
    rows, columns = np.zeros(2 * n, np.int64), np.zeros(2 * n, np.int64)
    i = j = n - 1
    count = 0
    while True:
        rows[count], columns[count] = i, j
        count += 1
        if i == 0 and j == 0:
            return rows[:count][::-1], columns[:count][::-1]
        way = came[i, j - i + radius]
        if way != LEFT:
            i -= 1
        if way != ABOVE:
            j -= 1
