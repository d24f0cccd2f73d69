"""The search for what is missing: try the candidates, add the best, until nothing is left or nothing helps."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..effects.base import ChannelError, Effect
from .assess import Left, assess
from .fit import HOTTER, Fit, fit
from .layout import Addition, Layout, make_layout
from .model import Model, fit_model
from .motion import motion_of
from .records import Record
from .scales import Scales, make_scales
from .screening import embedding
from .temper import tempered
from .trajectory import Trajectory
from .trying import GAIN, Tried, try_candidates

SECOND_GAIN = 20.0
"""Nats for one more effect where those found leave white noise already."""

TEMPERINGS = 3
"""Times that the noise is taken as large as what the best candidate leaves."""

MOST_STEPS = 4

FIRST_ONES = 3
"""Candidates that are tried with a second one at once."""

MOST_LEFT = 100.0
"""Mean square in units of the noise that the first one leaves: of a real structure no second one takes that."""

PAIR_GAIN = 100.0
"""Nats that each of two must gain that are found at once: there are thousands of pairs, and some mimic anything
small."""

LEAST_SHARE = 0.15
"""Of what the model before it leaves above the floor: an addition that removes less of it, and still leaves more than
noise, is no explanation."""


class Round(NamedTuple):
    """The model before it, and all candidates for one more addition, best first."""

    before: Model
    tried: list[Tried]
    as_recorded: Sequence[Tried] = ()  # in the sensors' noise, where `tried` is in a larger one

    @property
    def best(self) -> Tried | None:
        return self.tried[0] if self.tried and self.tried[0].fit and self.tried[0].gain > GAIN else None


def search(
    records: Sequence[Record], scales: Scales, effects: Mapping[str, Effect], present: Sequence[Addition] = ()
) -> tuple[list[Round], Model]:
    """All rounds, and the last model."""
    given = fit_model(scales.structure, records, scales, present)
    rounds, final = _one_by_one(records, scales, effects, given, [], len(present))
    if final.left.whiteness.white:
        return rounds, final
    pair = two_at_once(records, scales, effects, given, rounds[0].as_recorded)
    return _one_by_one(records, *pair, len(present)) if pair else (rounds, final)


def _one_by_one(
    records: Sequence[Record], scales: Scales, effects: Mapping[str, Effect], model: Model, rounds: list[Round],
    present: int,
) -> tuple[list[Round], Model]:  # fmt: skip
    """The best candidate is added as long as there is one; rounds: those that have led to the model."""
    while True:
        done = one_round(records, scales, effects, model)
        rounds.append(done)
        enough = SECOND_GAIN if model.additions[present:] and model.left.whiteness.white else GAIN
        if done.best is None or done.best.gain < enough or len(rounds) > MOST_STEPS:
            # where the noise had to be taken larger, the model before the round is the one fitted with it
            return without_the_superseded(records, scales, rounds, done.before, present)
        fair = _without(scales, model, done.best)
        if fair.fit.evidence > model.fit.evidence + 1.0 and done.before is model:
            # the candidate's fit has shown a better one of the model without it
            model, rounds = fair, rounds[:-1]
            continue
        scales, larger = _with(records, scales, model, done.best)
        if not larger.left.whiteness.white:
            after = larger.left, assess(done.best.fit, records)
            if max(share_removed(done.before.left, left) for left in after) < LEAST_SHARE:
                return rounds, done.before
        model = larger


def _with(records: Sequence[Record], scales: Scales, model: Model, best: Tried) -> tuple[Scales, Model]:
    start = best.fit
    if isinstance(best.addition.effect, ChannelError):
        # the measured motion was wrong, and with it the crushes that the curves reach over
        scales, start = make_scales(scales.structure, records, scales.cells, start.trajectories), None
    return scales, fit_model(scales.structure, records, scales, [*model.additions, as_found(best)], start)


def two_at_once(
    records: Sequence[Record], scales: Scales, effects: Mapping[str, Effect], model: Model, tried: Sequence[Tried]
):
    """Where no effect counts for itself in noise as large as what it leaves: two that leave only the sensors'.

    The likeliest first ones, as recorded, each with the best second one -> what `_one_by_one` goes on from, or None.
    """
    found = []
    likely = [one for one in tried if one.fit and one.gain > PAIR_GAIN][:FIRST_ONES]
    for first in [one for one in likely if assess(one.fit, records).cost < MOST_LEFT]:
        wider, larger = _with(records, scales, model, first)
        seconds = try_candidates(records, wider, effects, larger)
        if not seconds or not seconds[0].fit or seconds[0].gain < PAIR_GAIN:
            continue
        widest, both = _with(records, wider, larger, seconds[0])
        if both.left.whiteness.white:
            others = [one for one in tried if one is not first]
            rounds = [Round(model, [first, *others]), Round(larger, seconds)]
            found.append((widest, effects, both, rounds))
    return max(found, key=lambda one: one[2].fit.evidence, default=None)


def without_the_superseded(
    records: Sequence[Record], scales: Scales, rounds: list[Round], final: Model, present: int
) -> tuple[list[Round], Model]:
    """An effect added first may have stood for one that was found later: what the evidence can spare goes again."""
    number = present
    while final.left.whiteness.white and number < len(final.additions) - 1:
        fewer = final.additions[:number] + final.additions[number + 1 :]
        smaller = _refitted(scales, records, fewer, final)
        if not smaller.left.whiteness.white or smaller.fit.evidence < final.fit.evidence - GAIN:
            number += 1
            continue
        kept = rounds[: number - present] + rounds[number - present + 1 :]
        models = [_refitted(scales, records, fewer[: present + k], final) for k in range(len(kept) - 1)] + [smaller]
        gains = [b.fit.evidence - a.fit.evidence for a, b in zip(models, models[1:])] + [None]
        rounds = [_round_again(*each) for each in zip(kept, models, gains)]
        final = smaller
    return rounds, final


def _refitted(scales: Scales, records: Sequence[Record], additions: Sequence[Addition], like: Model) -> Model:
    """Fitted with the other, larger model's hyperparameters, so that evidences compare; from where that one has ended,
    and, as it may have been led astray, from the measured motion."""
    layout = make_layout(scales.structure, records, scales, additions, like.roughness)
    from_there = _narrowed(layout, like.fit, records)
    fits = (fit(layout, records, from_there), fit(layout, records), fit(layout, records, refine=HOTTER))
    found = max(fits, key=lambda one: one.evidence)
    return Model(tuple(additions), found, assess(found, records, sharply=True), like.roughness, records)


def _narrowed(layout: Layout, wide: Fit, records: Sequence[Record]) -> tuple[np.ndarray, list[Trajectory]]:
    """Parameters and motions of a fit of more additions, without those that the layout has not."""
    theta = wide.theta[embedding(layout, wide.layout)]
    along = enumerate(zip(records, wide.trajectories))
    return theta, [motion_of(layout, record, r, theta, trajectory.a) for r, (record, trajectory) in along]


def _round_again(round_: Round, before: Model, gain: float | None) -> Round:
    best, *others = round_.tried
    return round_._replace(before=before, tried=[best if gain is None else best._replace(gain=gain), *others])


def share_removed(before: Left, after: Left) -> float:
    """Of the mean square residual above that of the noise."""
    return (before.cost - after.cost) / max(before.cost - 1.0, 1e-9)


def as_found(tried: Tried) -> Addition:
    """The addition, starting where its fit has ended."""
    theta = tried.fit.theta
    place = next(place for place in tried.fit.layout.places if place.addition is tried.addition)
    shapes = {name: float(np.exp(theta[p])) for name, p in place.shapes.items()}
    return replace(tried.addition, coefficient=float(theta[place.coefficient]), shapes=shapes)


def _without(scales: Scales, model: Model, tried: Tried) -> Model:
    """The model refitted from where a candidate's fit has ended."""
    layout = model.fit.layout
    theta, motions = _narrowed(layout, tried.fit, model.records)
    found = fit(layout, model.records, (theta, motions))
    return model._replace(fit=found, left=assess(found, model.records, sharply=True))


def one_round(records: Sequence[Record], scales: Scales, effects: Mapping[str, Effect], model: Model) -> Round:
    """Candidates against the sensors' noise; where none leaves only that, against what the best of them leaves."""
    tried = try_candidates(records, scales, effects, model, thorough=True)
    done = Round(model, tried, tried)
    if model.left.whiteness.white or (done.best and assess(done.best.fit, records).whiteness.white):
        return done
    for _ in range(TEMPERINGS):
        left = assess(done.best.fit, done.before.records) if done.best else done.before.left
        noisier = tempered(records, bounded(left.residual, records))
        before = fit_model(scales.structure, noisier, scales, model.additions)
        if before.left.whiteness.white:  # so it looks; the sensors' own noise decides
            there = fit(model.fit.layout, records, (before.fit.theta, before.fit.trajectories))
            decided = assess(there, records, sharply=True).whiteness
            before = before._replace(left=before.left._replace(whiteness=decided))
        done = Round(before, try_candidates(noisier, scales, effects, before), tried)
    return done


def bounded(residuals: Sequence[np.ndarray], records: Sequence[Record]) -> list[np.ndarray]:
    """Residuals, and what was measured itself where a motion without bounds has left more."""
    pairs = zip(residuals, (record.measured for record in records))
    return [r if np.nanstd(r) < np.nanstd(measured) else measured for r, measured in pairs]
