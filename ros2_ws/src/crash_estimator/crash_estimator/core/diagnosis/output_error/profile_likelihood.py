"""A law's constant by its profile: the least cost of all other parameters, over values at which it is held.

Where a force jumps at separation, the instant of the jump moves with the constant of the law that ends it, and each
sample that it passes adds to the cost: that has the shape of a V, at whose point no quadratic step arrives. With the
constant held, the fit of all the others is smooth, and converges from the measured motion.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...effects.effect import Addition
from .continuation import SLOW_CONTACT, SMALL_STEPS, Schedule
from .gauss_newton import Fit, fit
from .problem import OutputErrorProblem, Point

STEP = 0.5
"""Of the constant's logarithm, in the coarse look, and what `closer` searches on either side of its best: the point of
a V is within a step of the least value beside it. Halved and doubled it changed nothing of 34 looked-at cases."""

PRECISION = 1e-3
"""Of the logarithm: a thousandth of the slope. Halved and doubled it changed nothing of those cases."""


class Profile(NamedTuple):
    """A coarse look at the profile over the coefficient of an addition, which has a lower limit above zero."""

    addition: Addition
    problem: OutputErrorProblem
    coefficient: int
    lowest: float  # logarithm of the least that is admitted
    at: float  # logarithm of the coefficient where the cost is least
    fit: Fit  # there


def profile(
    problem: OutputErrorProblem, addition: Addition, starts: Sequence[float], schedule: Schedule = SMALL_STEPS,
    hopeless: float = np.inf,
) -> Profile:  # fmt: skip
    """starts: of the coefficient; from the best of them on as long as the cost falls. schedule, hopeless: as `fit`."""
    layout = problem.layout
    coefficient = layout.term(addition).coefficient
    tried: dict[float, Fit] = {}

    def cost(logarithm: float) -> float:
        start = layout.start.copy()
        start[coefficient] = np.exp(logarithm)
        tried[logarithm] = fit(problem.starting_at(start), None, schedule, hopeless, held=(coefficient,))
        return tried[logarithm].cost

    lowest = float(np.log(layout.prior.low[coefficient]))
    best = first = min(np.log(starts), key=cost)
    for step in (STEP, -STEP):
        if best == first:
            while (beyond := max(best + step, lowest)) not in tried and cost(beyond) < tried[best].cost:
                best = beyond
    return Profile(addition, problem, coefficient, lowest, best, tried[best])


def closer(look: Profile) -> Fit:
    """The fit at the least of the profile, then with the coefficient free."""
    from scipy.optimize import minimize_scalar  # long to import, and seldom needed

    best = look.fit

    def cost(logarithm: float) -> float:
        nonlocal best
        start = best.theta.copy()
        start[look.coefficient] = np.exp(logarithm)
        found = fit(look.problem, Point(start, best.trajectories), SLOW_CONTACT, held=(look.coefficient,))
        best = min(best, found, key=lambda one: one.cost)
        return min(found.cost, 10.0 * look.fit.cost)  # finite; any factor above 1 does

    bounds = max(look.at - STEP, look.lowest), look.at + STEP
    minimize_scalar(cost, bounds=bounds, method="bounded", options={"xatol": PRECISION})
    return fit(look.problem, best.point)
