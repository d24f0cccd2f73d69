"""A law's constant by its profile: the least cost of all other parameters, over values at which it is held.

Where a force jumps at separation, the instant of the jump moves with the constant of the law that ends it, and each
sample that it passes adds to the cost: that has the shape of a V, at whose point no quadratic step arrives. With the
constant held, the fit of all the others is smooth, and converges from the measured motion.
"""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import minimize_scalar

from .fit import SLOWLY, Fit, fit
from .layout import Addition, Layout
from .records import Record

STEP = 0.3
"""Of the constant's logarithm: a coarse look, a step beyond where the search starts on either side."""

PRECISION = 1e-3
"""Of the logarithm."""

LEAST = 1e-9
"""Of a constant, in its unit: of a gap, nothing."""


def profiled(
    layout: Layout, records: Sequence[Record], addition: Addition, starts: Sequence[float], hopeless: float
) -> Fit:
    """The fit at the least of the profile over the addition's coefficient, which is positive.

    starts: of the coefficient; hopeless: cost above which, after a coarse look, it is not worth a closer one.
    """
    coefficient = next(place.coefficient for place in layout.places if place.addition is addition)
    tried: dict[float, Fit] = {}

    def coarsely(logarithm: float) -> float:
        start = layout.start.copy()
        start[coefficient] = np.exp(logarithm)
        tried[logarithm] = fit(layout._replace(start=start), records, held=(coefficient,))
        return tried[logarithm].cost

    def closely(logarithm: float) -> float:
        nearest = min(tried.values(), key=lambda one: one.cost)
        start = nearest.theta.copy()
        start[coefficient] = np.exp(logarithm)
        tried[logarithm] = fit(layout, records, (start, nearest.trajectories), refine=SLOWLY, held=(coefficient,))
        return min(tried[logarithm].cost, hopeless)

    lowest = np.log(max(layout.prior.low[coefficient], LEAST))
    low, high = max(np.log(min(starts)) - STEP, lowest), np.log(max(starts)) + STEP
    best = min(np.linspace(low, high, 1 + int(np.ceil((high - low) / STEP))), key=coarsely)
    while best == max(tried) and coarsely(best + STEP) < tried[best].cost:
        best = max(tried)
    if tried[best].cost < hopeless:
        bounds = max(best - STEP, lowest), best + STEP
        minimize_scalar(closely, bounds=bounds, method="bounded", options={"xatol": PRECISION})
    least = min(tried.values(), key=lambda one: one.cost)
    return fit(layout, records, (least.theta, least.trajectories))
