"""One round of the search: all candidates for one more addition, in the sensors' noise or in a larger one."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..effects.base import ChannelError, Effect
from .assess import Left, assess
from .fit import GRADUALLY, HOTTEST, REFINE, Fit, fit
from .layout import Addition, Layout
from .model import Model, fit_model
from .motion import motion_of
from .normal import may_diverge
from .records import Record
from .scales import Scales, make_scales
from .screening import embedding
from .temper import tempered
from .trajectory import Trajectory
from .trying import GAIN, Tried, try_candidates

TEMPERINGS = 3
"""Times that the noise is taken as large as what the best candidate leaves."""


class Round(NamedTuple):
    """The model before it, and all candidates for one more addition, best first."""

    before: Model
    tried: list[Tried]
    as_recorded: Sequence[Tried] = ()  # in the sensors' noise, where `tried` is in a larger one

    @property
    def best(self) -> Tried | None:
        return self.tried[0] if self.tried and self.tried[0].fit and self.tried[0].gain > GAIN else None


def one_round(
    records: Sequence[Record], scales: Scales, effects: Mapping[str, Effect], model: Model,
    earlier: Sequence["Round"] = (),
) -> Round:  # fmt: skip
    """Candidates against the sensors' noise; where none leaves only that, against what the best of them leaves."""
    before = [tried for round_ in earlier for tried in round_.tried]
    tried = try_candidates(records, scales, effects, model, thorough=True, before=before)
    done = Round(model, tried, tried)
    if model.left.whiteness.white or (done.best and assess(done.best.fit, records).whiteness.white):
        return done
    for _ in range(TEMPERINGS):
        left = assess(done.best.fit, done.before.records) if done.best else done.before.left
        noisier = tempered(records, bounded(left.residual, records))
        before = fit_model(scales.structure, noisier, scales, model.additions)
        for start in [done.before.fit, *(one.fit for one in done.tried[:1] if one.fit)]:
            further = fitted_on(before, start)
            before = further if better(further, before) else before
        if before.left.whiteness.white:  # so it looks; the sensors' own noise decides
            there = fit(model.fit.layout, records, (before.fit.theta, before.fit.trajectories))
            decided = assess(there, records, sharply=True).whiteness
            before = before._replace(left=before.left._replace(whiteness=decided))
        done = Round(before, try_candidates(noisier, scales, effects, before, known=tried), tried)
    return done


def fitted_on(model: Model, start: Fit) -> Model:
    """The model fitted from another fit, of it or of more: one that begins with the measured motion may go astray."""
    found = fit(model.fit.layout, model.records, narrowed(model.fit.layout, start, model.records), refine=REFINE)
    return model._replace(fit=found, left=assess(found, model.records, sharply=True))


def narrowed(layout: Layout, wide: Fit, records: Sequence[Record]) -> tuple[np.ndarray, list[Trajectory]]:
    """Parameters and motions of a fit of more additions, without those that the layout has not."""
    theta = wide.theta[embedding(layout, wide.layout)]
    along = enumerate(zip(records, wide.trajectories))
    return theta, [motion_of(layout, record, r, theta, trajectory.a) for r, (record, trajectory) in along]


def better(one: Model, other: Model) -> bool:
    """Whether a fit of the same model in the same noise is a better one.

    The evidence counts what a motion that has not settled would leave, to first order; of one that never settles, that
    is less than it leaves itself. So both must say so.
    """
    return one.fit.evidence > other.fit.evidence + 1.0 and one.left.cost < other.left.cost


@may_diverge
def bounded(residuals: Sequence[np.ndarray], records: Sequence[Record]) -> list[np.ndarray]:
    """Residuals, and what was measured itself where a motion without bounds has left more."""
    pairs = zip(residuals, (record.measured for record in records))
    return [r if np.nanstd(r) < np.nanstd(measured) else measured for r, measured in pairs]


def added(records: Sequence[Record], scales: Scales, model: Model, best: Tried) -> tuple[Scales, Model]:
    """The model with a candidate that was tried, and the scales that it then has."""
    additions = [*model.additions, as_found(best)]

    def fitted(scales: Scales, start: Fit | None) -> tuple[Scales, Model]:
        model = fit_model(scales.structure, records, scales, additions, start)
        if model.left.whiteness.white:
            return scales, model
        for stages in (GRADUALLY, HOTTEST):  # the usual ones may have led astray
            anew = fit(model.fit.layout, records, refine=stages)
            anew = model._replace(fit=anew, left=assess(anew, records, sharply=True))
            model = anew if better(anew, model) else model
        return scales, model

    if not isinstance(best.addition.effect, ChannelError):
        return fitted(scales, best.fit)
    # the measured motion was wrong, and with it the crushes that the curves reach over
    mended = make_scales(scales.structure, records, scales.cells, best.fit.trajectories, scales.pulls)
    anew = fitted(mended, None)
    if anew[1].left.whiteness.white:
        return anew
    return min(anew, fitted(scales, best.fit), key=lambda one: one[1].left.cost)


def as_found(tried: Tried) -> Addition:
    """The addition, starting where its fit has ended."""
    theta = tried.fit.theta
    place = next(place for place in tried.fit.layout.places if place.addition is tried.addition)
    shapes = {name: float(np.exp(theta[p])) for name, p in place.shapes.items()}
    return replace(tried.addition, coefficient=float(theta[place.coefficient]), shapes=shapes)


def share_removed(before: Left, after: Left) -> float:
    """Of the mean square residual above that of the noise."""
    return (before.cost - after.cost) / max(before.cost - 1.0, 1e-9)
