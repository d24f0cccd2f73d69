"""A first ranking of all candidates at once, from one linearisation along a trajectory of the model without them.

Every candidate is one column c of the derivative: the force per unit of its coefficient, or, where it changes an
element's own law, the change of force when its law takes the place of the present one. With the model's
parameters marginalised (their posterior precision H, the columns' products G = J'c), it gains

    b = c'r - G' H^-1 J'r,   s = c'c - G' H^-1 G,   gain = 1/2 b^2 / (s + 1/std^2) - 1/2 log(1 + s std^2)  nats.

Along the measured motion, and with the motion's own error propagated, this needs no fit before it; a fit of the
model without the effect would have absorbed part of it.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, cho_solve
from scipy.special import log_ndtr

from ..effects.base import Gap, UnloadingSlope
from .fit import Fit, equation_error_start, solve
from .layout import Addition, Layout, Link, make_layout
from .motion import motion_of
from .normal import may_diverge, normal_equations
from .records import DRIVEN_MODES, Record
from .scales import Scales


class Screened(NamedTuple):
    addition: Addition
    gain: float  # nats
    coefficient: float  # 0 to about 1 for one that changes a law
    std: float


def changes_law(addition: Addition) -> bool:
    return isinstance(addition.effect, (Gap, UnloadingSlope))


@may_diverge
def screen(
    records: Sequence[Record], scales: Scales, present: Sequence[Addition], additions: Sequence[Addition],
    roughness=None, fitted: Fit | None = None,
) -> list[Screened]:  # fmt: skip
    """All additions to a model that has those that are present; best first. Empty where the motion has no bounds.

    fitted: that model's fit, along whose trajectory to linearise instead of the measured motion.
    """
    additive = [addition for addition in additions if not changes_law(addition)]
    laws = [addition for addition in additions if changes_law(addition)]
    structure = scales.structure
    base = make_layout(structure, records, scales, present, roughness)
    wide = make_layout(structure, records, scales, [*present, *additive], roughness)
    where = embedding(base, wide)
    theta, along = (fitted.theta, fitted.trajectories) if fitted else equation_error_start(base, records)

    start = wide.start.copy()
    start[where] = theta
    by_id = {id(place.addition): place.coefficient for place in wide.places}
    coefficients = np.array([by_id[id(addition)] for addition in additive], dtype=int)
    start[coefficients] = 0.0
    switched = [_law(wide, addition) for addition in laws]
    moved = [motion_of(wide, record, r, start, motion.a) for r, (record, motion) in enumerate(zip(records, along))]
    normal, _ = normal_equations(wide, records, start, moved, switched=switched)

    small = normal._replace(matrix=normal.matrix[np.ix_(where, where)], vector=normal.vector[where])
    try:
        step = solve(base, small, theta)
    except LinAlgError:  # a fit that ended in a motion without bounds: nothing can be said along it
        return []
    factor, free = step.factor, step.free
    scale = step.scale[free]
    tried = np.concatenate([coefficients, wide.size + np.arange(len(laws))])
    cross = normal.matrix[np.ix_(where[free], tried)] * scale[:, None]
    inside = cho_solve(factor, cross, check_finite=False)
    prior = base.prior
    pull = (small.vector - prior.precision @ (theta - prior.mean))[free] * scale
    b = normal.vector[tried] - inside.T @ pull
    s = np.maximum(np.diagonal(normal.matrix)[tried] - (cross * inside).sum(axis=0), 0.0)
    std = np.concatenate([1.0 / np.sqrt(np.diagonal(wide.prior.precision)[coefficients]), np.ones(len(laws))])
    low = np.concatenate([wide.prior.low[coefficients], np.zeros(len(laws))])
    high = np.concatenate([wide.prior.high[coefficients], np.full(len(laws), np.inf)])
    precision = s + 1.0 / std**2
    found = np.clip(b / precision, low, high)
    # of a coefficient that cannot be negative, prior and posterior are halves of normal distributions
    half = np.where(low == 0.0, np.log(2.0) + log_ndtr(b / np.sqrt(precision)), 0.0)
    free = np.where(low == 0.0, b / precision, found)
    gain = b * free - 0.5 * precision * free**2 - 0.5 * np.log(precision * std**2) + half
    ranked = [
        Screened(*row) for row in zip([*additive, *laws], gain.tolist(), found.tolist(), (precision**-0.5).tolist())
    ]
    return sorted(ranked, key=lambda one: -one.gain)


def _law(layout: Layout, addition: Addition) -> Link:
    """The link with its gap or slope in the parameter after the layout's last."""
    link = next(link for link in layout.links if link.name == addition.target)
    which = "gap" if isinstance(addition.effect, Gap) else "slope"
    return replace(link, tension=False, trial=addition.coefficient, **{which: layout.size})


def embedding(base: Layout, wide: Layout) -> np.ndarray:
    """Where the base's parameters are in a layout that has additions beside them."""
    names = {name: wide.knots + k for k, name in reversed(list(enumerate(wide.names)))}
    found = [*range(base.knots), *(names[name] for name in base.names)]
    for r in range(len(base.offsets)):
        found += [wide.offsets[r] + q for q in range(len(base.outputs))]
        for body in base.modes[r]:
            found += [wide.modes[r][body] + j for j in range(DRIVEN_MODES + 1)]
    return np.array(found)
