"""A first ranking of all candidates at once, from one linearisation along a trajectory of the model without them.

Every candidate is one column c of the derivative: the force per unit of its coefficient, or, where it changes an
element's own law, the change of force when its law takes the place of the present one. With the model's
parameters marginalised (their posterior precision H, the columns' products G = J'c), it gains

    b = c'r - G' H^-1 J'r,   s = c'c - G' H^-1 G,   gain = 1/2 b^2 / (s + 1/std^2) - 1/2 log(1 + s std^2)  nats.

Along the measured motion, and with the motion's own error propagated, this needs no fit before it; a fit of the
model without the effect would have absorbed part of it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, cho_solve
from scipy.special import log_ndtr

from ...effects.effect import Addition
from ..mechanics.linearization import OtherLaw
from ..observation.record import ObservedRecord
from ..output_error.gauss_newton import Fit, equation_error_start, solve
from ..output_error.normal_equations import may_diverge, normal_equations
from ..output_error.problem import embedding, make_problem
from ..parameterization.layout import Layout
from ..parameterization.magnitudes import Magnitudes
from ..parameterization.terms import Term


class Screened(NamedTuple):
    addition: Addition
    gain: float  # nats
    coefficient: float  # 0 to about 1 for one that changes a law
    std: float


@may_diverge
def screen(
    magnitudes: Magnitudes, records: Sequence[ObservedRecord], present: Sequence[Addition],
    additions: Sequence[Addition], roughness: Mapping[str, np.ndarray] | None = None, fitted: Fit | None = None,
) -> list[Screened]:  # fmt: skip
    """All additions to a model that has those that are present; best first. Empty where the motion has no bounds.

    fitted: that model's fit, along whose trajectory to linearise instead of the measured motion.
    """
    additive = [addition for addition in additions if not addition.effect.changes_law]
    laws = [addition for addition in additions if addition.effect.changes_law]
    base = make_problem(magnitudes, records, present, roughness)
    wide = make_problem(magnitudes, records, [*present, *additive], roughness)
    where = embedding(base.layout, wide.layout)
    theta, along = fitted.point if fitted else equation_error_start(base)

    start = wide.layout.start.copy()
    start[where] = theta
    coefficients = np.array([term.coefficient for term in wide.layout.terms[len(present) :]], dtype=int)
    start[coefficients] = 0.0
    others = [_law(wide.layout, addition) for addition in laws]
    normal, _ = normal_equations(wide, wide.moved(start, along), others=others)

    small = normal._replace(matrix=normal.matrix[np.ix_(where, where)], vector=normal.vector[where])
    try:
        step = solve(base.layout, small, theta)
    except LinAlgError:  # a fit that ended in a motion without bounds: nothing can be said along it
        return []
    free, scale = step.free, step.scale[step.free]
    tried = np.concatenate([coefficients, wide.layout.size + np.arange(len(laws))])
    cross = normal.matrix[np.ix_(where[free], tried)] * scale[:, None]
    inside = cho_solve(step.factor, cross, check_finite=False)
    prior, wide_prior = base.layout.prior, wide.layout.prior
    pull = (small.vector - prior.precision @ (theta - prior.mean))[free] * scale
    b = normal.vector[tried] - inside.T @ pull
    s = np.maximum(np.diagonal(normal.matrix)[tried] - (cross * inside).sum(axis=0), 0.0)
    std = np.concatenate([1.0 / np.sqrt(np.diagonal(wide_prior.precision)[coefficients]), np.ones(len(laws))])
    low = np.concatenate([wide_prior.low[coefficients], np.zeros(len(laws))])
    high = np.concatenate([wide_prior.high[coefficients], np.full(len(laws), np.inf)])
    precision = s + 1.0 / std**2
    found = np.clip(b / precision, low, high)
    # of a coefficient that cannot be negative, prior and posterior are halves of normal distributions
    half = np.where(low == 0.0, np.log(2.0) + log_ndtr(b / np.sqrt(precision)), 0.0)
    peak = np.where(low == 0.0, np.minimum(b / precision, high), found)
    gain = b * peak - 0.5 * precision * peak**2 - 0.5 * np.log(precision * std**2) + half
    rows = zip([*additive, *laws], gain.tolist(), found.tolist(), (precision**-0.5).tolist(), strict=True)
    return sorted((Screened(*row) for row in rows), key=lambda one: -one.gain)


def shortlist(screened: Sequence[Screened], length: int) -> list[Screened]:
    """The best of the screened, with the best start each."""
    best: dict[tuple[str, str], Screened] = {}
    for one in screened:
        best.setdefault(one.addition.key, one)
        if len(best) == length:
            break
    return list(best.values())


def _law(layout: Layout, addition: Addition) -> OtherLaw:
    """The link's law with the addition's coefficient in the parameter after the layout's last."""
    link = layout.link(addition.target)
    terms = (*link.terms, Term(addition, layout.size, {}))
    tension = link.tension and not addition.effect.takes_tension_away(addition.variant)
    return OtherLaw(replace(link, tension=tension, terms=terms), addition.coefficient)
