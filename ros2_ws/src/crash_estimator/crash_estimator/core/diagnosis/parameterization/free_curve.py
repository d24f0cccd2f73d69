"""Free characteristics: a piecewise-linear F(X) with a prior that slopes change little from knot to knot.

The slope is a random walk in crush (an integrated Wiener process, the Gaussian-process prior of a cubic smoothing
spline): between knots a distance d apart its change has the variance (ROUGHNESS K)^2 d / X_scale, with K the scale
F_scale / X_scale of the element's stiffness. F(0) = 0.
"""

from typing import NamedTuple

import numpy as np

FIRST_SLOPE = 5.0
"""Prior standard deviation of the slope at the origin, in K: wide. With half and twice of it none of 36 looked-at cases
of the second simulator was told otherwise."""

ROUGHNESS = 4.0
"""Standard deviation of the slope's change over the whole crush scale, in K; see `adapted_roughness`. With half and
twice of it one of those cases was told otherwise, a clipped one, and with both of them rightly."""

TAIL = 3.0
"""Degrees of freedom of the Student-t prior of `adapted_roughness`: the fewest whole number with a finite variance."""


class Curve(NamedTuple):
    """Knots (n,) in m, and for each its parameter's number (n,), -1 for the one at the origin; scales in m and N."""

    knots: np.ndarray
    column: np.ndarray
    crush_scale: float
    force_scale: float

    def forces(self, theta: np.ndarray) -> np.ndarray:
        """(n,) N at the knots."""
        return np.where(self.column >= 0, theta[self.column], 0.0)


def make_knots(lowest: float, highest: float, scale: float, cells: int, tension: bool) -> np.ndarray:
    """Even knots over the crushes met and one cell beyond, with one at 0."""
    step = scale / cells
    first = int(np.floor(min(lowest, 0.0) / step)) - 1 if tension else 0
    last = max(int(np.ceil(max(highest, 0.0) / step)), 1) + 1
    return np.arange(first, last + 1) * step


def value(curve: Curve, theta: np.ndarray, crush: np.ndarray) -> np.ndarray:
    """(g,) N: the curve at crush (g,) m; straight on beyond the last knots."""
    forces = curve.forces(theta)
    cell = np.searchsorted(curve.knots[1:-1], crush, side="right")
    right = (crush - curve.knots[cell]) / np.diff(curve.knots)[cell]
    low, high = forces[cell], forces[cell + 1]
    return low + right * (high - low)


def slope_changes(curve: Curve) -> tuple[np.ndarray, np.ndarray]:
    """(n - 1, n) the slope at the origin and the changes of slope at the inner knots, of forces at knots; and their
    prior standard deviations (n - 1,) for a roughness of 1."""
    knots, n = curve.knots, len(curve.knots)
    slopes = np.diff(np.eye(n), axis=0) / np.diff(knots)[:, None]
    first = slopes[int(np.clip(np.searchsorted(knots, 0.0), 0, n - 2))]
    apart = 0.5 * (knots[2:] - knots[:-2])
    std = np.concatenate([[FIRST_SLOPE], np.sqrt(apart / curve.crush_scale)])
    return np.vstack([first, np.diff(slopes, axis=0)]), curve.force_scale / curve.crush_scale * std


def prior_precision(curve: Curve, roughness: np.ndarray | float) -> np.ndarray:
    """(n, n) precision of the forces at the knots; the origin's row is to be left out.

    roughness: one number, or one for each inner knot (n - 2,).
    """
    rows, std = slope_changes(curve)
    scaled = rows / std[:, None]
    scaled[1:] /= np.broadcast_to(roughness, len(curve.knots) - 2)[:, None]
    return scaled.T @ scaled


def adapted_roughness(curve: Curve, theta: np.ndarray) -> np.ndarray:
    """Roughness (n - 2,) for each inner knot after a fit: larger where the curve was found to bend sharply.

    One step towards a Student-t prior of TAIL degrees of freedom: gentle bends stay gentle, folds may fold.
    """
    rows, std = slope_changes(curve)
    bend = (rows @ curve.forces(theta))[1:] / std[1:]
    return np.sqrt((TAIL * ROUGHNESS**2 + bend**2) / (TAIL + 1.0))
