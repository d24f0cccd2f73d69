"""How far an estimate that runs away is drawn, so that a few wild samples do not squash a plot.

Limits follow from the data so far. Residuals and the table of errors are never limited: there it must show.
"""

import numpy as np

from .blocks import ForceBlock, ParameterBlock, ResidualBlock

PREDICTION = 2.5
"""Times the largest measurement: a prediction beyond it runs along this limit."""
PARAMETER = 5.0
"""Times what a parameter has been for all but a twentieth of the time that it was known to better than its half.

Beyond it a gap is left: a secant stiffness at the end of the rebound is 0 / 0. Before it is known so well, what
counts is the first value with its standard deviation.
"""
FEW = 20
FORCE = 2.0
"""Times the sum of mass times largest acceleration of the bodies: what no element of the structure can carry."""
KEPT = 2000


class Limits:
    """Remembers what the limits need, by estimator and name."""

    def __init__(self) -> None:
        self._largest: dict[tuple[str, str], float] = {}
        self._first: dict[tuple[str, str], float] = {}  # value and standard deviation to begin with, added up
        self._thinned: dict[tuple[str, str], tuple[np.ndarray, int]] = {}  # known sizes, every how manyth

    def predicted(self, block: ResidualBlock, k: int) -> np.ndarray:
        """(n,) predictions of equation k as they are drawn."""
        limit = PREDICTION * self._largest_of(block.estimator, block.name[k], block.measured[:, k])
        return np.clip(block.predicted[:, k], -limit, limit)

    def parameter(self, block: ParameterBlock, k: int) -> np.ndarray:
        """(n,) values of parameter k as they are drawn."""
        key, value, std = (block.estimator, block.name[k]), block.value[:, k], block.std[:, k]
        self._first.setdefault(key, abs(value[0]) + std[0])
        history, stride = self._thinned.get(key, (np.empty(0), 1))
        size = np.abs(value[::stride])
        history = np.append(history, size[std[::stride] < 0.5 * size])
        if len(history) > KEPT:
            history, stride = history[::2], 2 * stride
        self._thinned[key] = history, stride
        usual = np.quantile(history, 0.95) if len(history) * stride >= FEW else self._first[key]
        return np.where(np.abs(value) <= PARAMETER * usual, value, np.nan)

    def force(self, block: ForceBlock) -> float:
        """N, what an element may carry by the accelerations measured so far; infinite where none is measured."""
        limit = 0.0
        for k, (body, mass) in enumerate(zip(block.body, block.mass)):
            if mass > 0:  # not NaN
                limit += mass * self._largest_of(block.estimator, f"{body}'s acceleration", block.acceleration[:, k])
        return FORCE * float(limit) or np.inf

    def _largest_of(self, estimator: str, name: str, values: np.ndarray) -> float:
        key = (estimator, name)
        largest = float(np.fmax.reduce(np.abs(values), initial=self._largest.get(key, 0.0)))
        self._largest[key] = largest
        return largest
