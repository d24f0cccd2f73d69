"""Dynamic time warping of two signals (compiled): Sakoe and Chiba 1978, IEEE Trans. ASSP 26, with a band, no slope
limit."""

import numpy as np
from numba import njit

from . import compile_cache as _compile_cache  # noqa: F401  before any compiled function is defined


@njit(cache=True)
def warping_path(c, t, radius):
    """The path of least summed squared difference of c (n,) and t (n,), |i - j| <= radius -> its i and its j, (m,).

    D_ij = (c_i - t_j)^2 + min(D_{i-1,j}, D_{i,j-1}, D_{i-1,j-1}); of equally cheap ways the first of these.
    """
    n = len(t)
    total = np.full((n + 1, n + 1), np.inf)
    total[0, 0] = 0.0
    for i in range(n):
        for j in range(max(0, i - radius), min(n, i + radius + 1)):
            total[i + 1, j + 1] = (c[i] - t[j]) ** 2 + min(total[i, j + 1], total[i + 1, j], total[i, j])
    rows, columns = np.zeros(2 * n, np.int64), np.zeros(2 * n, np.int64)
    i = j = n - 1
    count = 0
    while True:
        rows[count], columns[count] = i, j
        count += 1
        if i == 0 and j == 0:
            return rows[:count][::-1], columns[:count][::-1]
        above, left, both = total[i, j + 1], total[i + 1, j], total[i, j]
        if above <= left and above <= both:
            i -= 1
        elif left <= both:
            j -= 1
        else:
            i, j = i - 1, j - 1
