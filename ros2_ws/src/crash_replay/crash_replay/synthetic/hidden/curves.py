"""Random element characteristics: static force over crush."""

import numpy as np

from ..curves import Curve

CORNER = 0.003
"""m: an abrupt change of slope happens within twice this, or within 40 % of the shortest stretch."""

ABRUPT_SLOPES = (-0.3, 0.03, 3.0)
"""What one stretch's slope is multiplied with where a structure folds, yields or meets the next one."""


def straight(stiffness: float) -> Curve:
    """F = K X."""
    return Curve((0.0, 10.0), (0.0, 10.0 * stiffness))


def random_curve(rng: np.random.Generator, stiffness: float, crush: float) -> Curve:
    """A rising force that is `stiffness` times `crush` (m) there and goes on at its mean slope; smooth or abrupt."""
    parts = int(rng.integers(3, 7))
    lengths = rng.uniform(0.5, 1.5, parts)
    slopes = np.exp(rng.normal(0.0, 0.45, parts))
    abrupt = rng.random() < 0.5
    if abrupt:
        slopes[rng.integers(1, parts)] *= rng.choice(ABRUPT_SLOPES)
    x = np.concatenate([[0.0], np.cumsum(lengths)])
    heights = [0.0]
    for rise in slopes * lengths:
        heights.append(max(heights[-1] + rise, 0.5 * heights[-1]))
    y = np.array(heights)
    x, y = np.append(x / x[-1], 4.0) * crush, np.append(y / y[-1], 4.0) * stiffness * crush
    if abrupt:
        half = min(CORNER, 0.2 * float(np.min(np.diff(x))))
        corners = (x[1:-1, None] + np.array([-half, half])).ravel()
        knots = np.concatenate([[0.0], corners, x[-1:]])
        x, y = knots, np.interp(knots, x, y)
    return Curve(x, y)


def steepest(curve: Curve, crush: float) -> float:
    """N/m, the largest slope up to `crush` (m)."""
    x = np.linspace(0.0, crush, 600)
    return float(np.max(np.diff([curve(u) for u in x.tolist()]) / np.diff(x)))
