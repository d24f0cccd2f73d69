"""A stiffness as a tabulated function of crush, interpolated without overshoot."""

from bisect import bisect_right
from collections.abc import Sequence

import numpy as np


class Curve:
    """Monotone cubic interpolation between knots, constant beyond both ends.

        y(x) = c3 d^3 + c2 d^2 + c1 d + c0,  d = x - x_k

    scipy finds the coefficients; evaluating one number at a time in plain Python is what the
    integrator needs, and twenty times faster than scipy's own call.
    """

    def __init__(self, x: Sequence[float] | np.ndarray, y: Sequence[float] | np.ndarray):
        from scipy.interpolate import PchipInterpolator  # late: it takes longer to import than all the rest

        if len(x) != len(y) or len(x) < 2:
            raise ValueError(f"a curve needs two knots or more, and as many x as y; got {len(x)} x and {len(y)} y")
        self.x, self.y = tuple(map(float, x)), tuple(map(float, y))
        self._pieces = PchipInterpolator(self.x, self.y).c.T.tolist()

    def __call__(self, x: float) -> float:
        knots = self.x
        if x <= knots[0]:
            return self.y[0]
        if x >= knots[-1]:
            return self.y[-1]
        k = bisect_right(knots, x) - 1
        c3, c2, c1, c0 = self._pieces[k]
        d = x - knots[k]
        return ((c3 * d + c2) * d + c1) * d + c0


def constant(value: float) -> Curve:
    return Curve((0.0, 1.0), (value, value))


def stepped(*steps: tuple[float, float], width: float = 0.002) -> Curve:
    """(from this crush in m, the value) ...: constant in between, each change within `width` m, which the
    integrator resolves and a recording hardly does."""
    x, y = [steps[0][0]], [steps[0][1]]
    for start, value in steps[1:]:
        x += [start, start + width]
        y += [y[-1], value]
    return Curve((*x, x[-1] + 1.0), (*y, y[-1]))
