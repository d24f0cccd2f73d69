"""The motion of a body that is observed by its displacement: an acceleration whose double integral stays with it.

A derivative integrated twice drifts off, by metres over ten seconds. So it is corrected on the way as an observer does:

    a = x_m'' + r^2 (x_m - x) + 2 r (x_m' - v)
"""

from collections.abc import Callable

import numpy as np
from numba import njit

from ... import compile_cache as _compile_cache  # noqa: F401  before any compiled function is defined

OF_STEP = 0.2
"""Of one over a step: fast, and slow enough that a step does not overshoot; only a start, which the fit corrects."""


def tracked_acceleration(time: np.ndarray, displacement: Callable[..., np.ndarray], x0: float, v0: float) -> np.ndarray:
    """(g,) m/s^2 at the instants of a record, of a displacement in m as a function of the time in s, which
    gives its n-th derivative for a second argument n.

    x0, v0: m and m/s from which it will be integrated.
    """
    dt = np.diff(time, prepend=time[0])
    rate = OF_STEP / float(dt.max())
    return _track(dt, displacement(time), displacement(time, 1), displacement(time, 2), rate, x0, v0)


@njit(cache=True)
def _track(dt, x_measured, v_measured, a_measured, rate, x, v):
    a = a_measured.copy()
    for t in range(1, len(dt)):
        step = dt[t]
        to_x = x + step * v + step * step * (2.0 * a[t - 1] + a[t]) / 6.0
        to_v = v + 0.5 * step * (a[t - 1] + a[t])
        a[t] += rate**2 * (x_measured[t] - to_x) + 2.0 * rate * (v_measured[t] - to_v)
        x += step * v + step * step * (2.0 * a[t - 1] + a[t]) / 6.0
        v += 0.5 * step * (a[t - 1] + a[t])
    return a
