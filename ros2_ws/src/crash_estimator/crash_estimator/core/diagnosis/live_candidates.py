"""Which candidates an update of the live ranking fits, and what it takes over from the updates before."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..effects.base import AttachedBody, Effect
from .candidates import candidates, touching
from .fit import FADE, REFINE, Fit, fit
from .layout import Addition, Layout, make_layout
from .live_start import carried_on
from .model import Model
from .motion import motion_of
from .records import Record
from .rounds import as_found
from .scales import Scales
from .screening import Screened, changes_law, embedding, screen
from .trying import HOPELESS, Tried, shortlist

LEADERS = 2
"""Candidates fitted again at every other update, in between only the first of them; and one whose turn it is ..."""

SHORTLIST = 8
"""... of so many that the screening names first."""

MOST_ITERATIONS = 10
ITERATIONS_ON = 5
"""Of a fit that goes on from the last update's: what has not settled then does so at the next one."""

Key = tuple[str, str]


class LiveState(NamedTuple):
    """What one update leaves for the next."""

    updates: int = 0
    leaders: tuple[Addition, ...] = ()  # as found, best first
    gains: Mapping[Key, float] = {}  # nats, when last fitted
    turns: Mapping[Key, int] = {}  # update at which it was last fitted
    screened: tuple[Screened, ...] = ()  # at every other update
    records: Sequence[Record] = ()  # that it was made on
    model: Fit | None = None  # without any candidate
    fits: Mapping[Key, Fit] = {}  # of candidates, to these records


def try_some(
    state: LiveState, scales: Scales, effects: Mapping[str, Effect], before: Model, out_of_time: Callable[[], bool]
) -> tuple[LiveState, list[Tried]]:
    """All candidates, those that were fitted now first."""
    present = {addition.key for addition in before.additions}
    leaders = [addition for addition in state.leaders if addition.key not in present]
    screened, fewest = state.screened, 2  # the leader and one more, whatever time they take
    if state.updates % 2 == 0:
        screened, fewest, leaders = _screened(state, scales, effects, before), 1, leaders[:1]
    waiting = [one for one in shortlist(screened, SHORTLIST) if one.addition.key not in {a.key for a in leaders}]
    turn = sorted(waiting, key=lambda one: state.turns.get(one.addition.key, -1))[:1]
    chosen = [(addition, None) for addition in leaders]
    place = 2 if state.updates % 4 == 3 else 1  # at the end is who is left out when time runs out
    chosen[place:place] = [(_variant(scales, one.addition, state.updates), one) for one in turn]
    found: list[Tried] = []
    for addition, one in chosen:
        if len(found) < fewest or not out_of_time():
            found.append(_tried(state, scales, before, addition, one))
    now = sorted((tried for tried in found if np.isfinite(tried.gain)), key=lambda tried: -tried.gain)
    gains = {**state.gains, **{tried.addition.key: tried.gain for tried in now}}
    turns = {**state.turns, **{tried.addition.key: state.updates for tried in found}}
    again = {tried.addition.key for tried in now}
    ahead = [as_found(tried) for tried in now] + [addition for addition in state.leaders if addition.key not in again]
    leaders = tuple(sorted(ahead, key=lambda addition: -gains[addition.key])[:LEADERS])
    fits = {tried.addition.key: tried.fit for tried in now}
    after = LiveState(state.updates + 1, leaders, gains, turns, screened, before.records, before.fit, fits)
    return after, now + _rest(screened, now, gains)


def _screened(state: LiveState, scales: Scales, effects: Mapping[str, Effect], before: Model) -> tuple[Screened, ...]:
    """Along the measured motion, where a strong effect is seen as it is, or the model's own, where a weak one is."""
    additions = candidates(scales.structure, scales, effects, before.additions)
    by_fit = before.left.whiteness.white or state.updates % 4 == 2
    return tuple(screen(before.records, scales, before.additions, additions, None, before.fit if by_fit else None))


def _variant(scales: Scales, addition: Addition, turn: int) -> Addition:
    """Of an unmodelled body, what it pushes differs from turn to turn."""
    if not isinstance(addition.effect, AttachedBody):
        return addition
    variants = [addition, *touching(scales.structure, addition)]
    return variants[turn % len(variants)]


def _tried(state: LiveState, scales: Scales, before: Model, addition: Addition, screened: Screened | None) -> Tried:
    fitted = _fit(state, before, scales, addition, screened)
    return Tried(addition, fitted.evidence - before.fit.evidence, fitted, None)


def _rest(screened: Sequence[Screened], now: Sequence[Tried], gains: Mapping[Key, float]) -> list[Tried]:
    """Those not fitted now: as they were when last fitted, the others below them; a screened gain is an estimate."""
    most = now[0].gain if now else np.inf
    least = max(min(gains.values(), default=np.inf), 0.0)
    rest = {tried.addition.key: None for tried in now}
    for one in screened:
        key = one.addition.key
        if key not in rest:
            rest[key] = Tried(one.addition, min(gains[key], most) if key in gains else min(one.gain, least), None, one)
    return sorted((tried for tried in rest.values() if tried), key=lambda tried: -tried.gain)


def _fit(state: LiveState, before: Model, scales: Scales, addition: Addition, screened: Screened | None) -> Fit:
    """The first of the leaders goes on from its last fit; others, which may have been led astray, start from the
    measured motion, or from the model's own where that leaves little."""
    layout = make_layout(scales.structure, before.records, scales, (*before.additions, addition))
    last = state.fits.get(addition.key)
    if last and addition is state.leaders[0]:
        start = carried_on(last, state.records, layout, before.records)
        again = fit(layout, before.records, start, most=ITERATIONS_ON)
        if np.isfinite(again.cost):
            return again
    start = _start(before, layout, addition, screened) if before.left.whiteness.white else None
    stages = REFINE if start else FADE
    return fit(layout, before.records, start, before.fit.cost + HOPELESS, MOST_ITERATIONS, stages)


def _start(before: Model, layout: Layout, addition: Addition, screened: Screened | None):
    theta = layout.start.copy()
    theta[embedding(before.fit.layout, layout)] = before.fit.theta
    if screened and not changes_law(addition):
        theta[next(place.coefficient for place in layout.places if place.addition is addition)] = screened.coefficient
    motions = zip(before.records, before.fit.trajectories)
    return theta, [motion_of(layout, record, r, theta, motion.a) for r, (record, motion) in enumerate(motions)]
