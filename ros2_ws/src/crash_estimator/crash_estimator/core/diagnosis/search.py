"""The search for what is missing: try the candidates, add the best, until nothing is left or nothing helps."""

from collections.abc import Mapping, Sequence

from ..effects.base import Effect
from .assess import assess
from .fit import GRADUALLY, fit
from .layout import Addition, make_layout
from .model import Model, fit_model
from .records import Record
from .rounds import Round, added, better, narrowed, one_round, share_removed
from .scales import Scales
from .trying import GAIN, Tried
from .two_at_once import two_at_once

SECOND_GAIN = 20.0
"""Nats for one more effect where those found leave white noise already."""

MOST_STEPS = 4

NEAR_THE_FLOOR = 2.0
"""Where the residual's mean square is within this factor of the noise's, a finer curve may be all that is missing."""

LEAST_SHARE = 0.15
"""Of what the model before it leaves above the floor: an addition that removes less of it, and still leaves more than
noise, is no explanation."""


def search(
    records: Sequence[Record], scales: Scales, effects: Mapping[str, Effect], present: Sequence[Addition] = ()
) -> tuple[list[Round], Model]:
    """All rounds, and the last model."""
    given = fit_model(scales.structure, records, scales, present)
    rounds, final = _one_by_one(records, scales, effects, given, [], len(present))
    if final.left.whiteness.white:
        return rounds, final
    pair = two_at_once(records, scales, effects, given, rounds[0].as_recorded)
    if pair is None:
        return rounds, final
    return _one_by_one(records, pair.scales, effects, pair.model, pair.rounds, len(present))


def _one_by_one(
    records: Sequence[Record], scales: Scales, effects: Mapping[str, Effect], model: Model, rounds: list[Round],
    present: int,
) -> tuple[list[Round], Model]:  # fmt: skip
    """The best candidate is added as long as there is one; rounds: those that have led to the model."""
    while True:
        done = one_round(records, scales, effects, model, rounds)
        rounds.append(done)
        fair = _without(scales, model, done.best) if done.best and done.before is model else model
        if better(fair, model):
            # the candidate's fit has shown a better one of the model without it
            model, rounds = fair, rounds[:-1]
            continue
        enough = SECOND_GAIN if model.additions[present:] and model.left.whiteness.white else GAIN
        if done.best is None or done.best.gain < enough or len(rounds) > MOST_STEPS:
            # where the noise had to be taken larger, the model before the round is the one fitted with it
            return without_the_superseded(records, scales, rounds, done.before, present)
        scales, larger = added(records, scales, model, done.best)
        if not larger.left.whiteness.white:
            after = larger.left, assess(done.best.fit, records)
            if max(share_removed(done.before.left, left) for left in after) < LEAST_SHARE:
                return rounds, done.before
        model = larger


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
    from_there = narrowed(layout, like.fit, records)
    fits = (fit(layout, records, from_there), fit(layout, records), fit(layout, records, refine=GRADUALLY))
    found = max(fits, key=lambda one: one.evidence)
    return Model(tuple(additions), found, assess(found, records, sharply=True), like.roughness, records)


def _round_again(round_: Round, before: Model, gain: float | None) -> Round:
    best, *others = round_.tried
    return round_._replace(before=before, tried=[best if gain is None else best._replace(gain=gain), *others])


def _without(scales: Scales, model: Model, tried: Tried) -> Model:
    """The model refitted from where a candidate's fit has ended."""
    layout = model.fit.layout
    theta, motions = narrowed(layout, tried.fit, model.records)
    found = fit(layout, model.records, (theta, motions), hopeless=model.fit.cost)
    return model._replace(fit=found, left=assess(found, model.records, sharply=True))
