"""Parameters of a fit, collected one by one with their priors, limits and starts."""

from typing import NamedTuple

import numpy as np

from .free_curve import Curve, prior_precision

LEAST_STD = 1e-9
"""SI: what is known exactly, as the zero of a channel without noise, keeps a precision that can be computed with."""


class Prior(NamedTuple):
    mean: np.ndarray  # (p,)
    precision: np.ndarray  # (p, p)
    low: np.ndarray  # (p,)
    high: np.ndarray  # (p,)


class Parameter(NamedTuple):
    name: str
    start: float
    std: float
    mean: float
    low: float
    high: float


class Builder:
    """Collects parameters one by one."""

    def __init__(self):
        self.parameters: list[Parameter] = []
        self.blocks: list[tuple[np.ndarray, np.ndarray]] = []

    def add(self, name: str, start: float, std: float, mean=0.0, low=-np.inf, high=np.inf) -> int:
        self.parameters.append(Parameter(name, start, max(std, LEAST_STD), mean, low, high))
        return len(self.parameters) - 1

    def curve(
        self, name: str, knots: np.ndarray, crush: float, force: float, roughness: np.ndarray | float, start=1.0
    ) -> Curve:
        """start: share of the straight line to the force scale that it begins with."""
        inner = knots != 0.0
        column = np.full(len(knots), -1)
        column[inner] = [self.add(name, start * force * x / crush, np.inf) for x in knots[inner]]
        curve = Curve(knots, column, crush, force)
        self.blocks.append((column[inner], prior_precision(curve, roughness)[np.ix_(inner, inner)]))
        return curve

    def prior(self) -> Prior:
        each = [(one.std, one.mean, one.low, one.high) for one in self.parameters]
        std, mean, low, high = np.array(each).T.copy()
        precision = np.diag(1.0 / std**2)
        for columns, block in self.blocks:
            precision[np.ix_(columns, columns)] += block
        return Prior(mean, precision, low, high)
