"""Which candidates an update of the live ranking fits, and what it takes over from the updates before."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...effects.effect import Addition, Effect
from ..output_error import gauss_newton
from ..output_error.continuation import FROM_MEASURED_MOTION, FROM_SIMULATION
from ..output_error.gauss_newton import Fit, fit
from ..output_error.problem import make_problem
from ..parameterization.magnitudes import Magnitudes
from ..selection.candidate_fits import CandidateFit, start_from
from ..selection.candidates import candidates
from ..selection.fitted_model import Model
from ..selection.score_screening import Screened, screen, shortlist
from ..selection.selection_step import as_found
from ..selection.thresholds import THRESHOLDS
from .warm_start import carried_on

LEADERS = 2
"""Candidates fitted again at every other update, in between only the first of them; and one whose turn it is ..."""

SHORTLIST = 8
"""... of so many that the screening names first."""

MOST_ITERATIONS = gauss_newton.MOST_ITERATIONS // 2
"""Of a fit that begins: an update's time is short, and the next one goes on from there."""

ITERATIONS_ON = gauss_newton.PATIENCE
"""Of a fit that goes on from the last update's: what has not settled then does so at the next one."""

Key = tuple[str, str]


class OnlineState(NamedTuple):
    """What one update leaves for the next."""

    updates: int = 0
    leaders: tuple[Addition, ...] = ()  # as found, best first
    gains: Mapping[Key, float] = {}  # nats, when last fitted
    turns: Mapping[Key, int] = {}  # update at which it was last fitted
    screened: tuple[Screened, ...] = ()  # at every other update
    model: Fit | None = None  # without any candidate
    fits: Mapping[Key, Fit] = {}  # of candidates


def try_some(
    state: OnlineState,
    magnitudes: Magnitudes,
    effects: Mapping[str, Effect],
    before: Model,
    out_of_time: Callable[[], bool],
) -> tuple[OnlineState, list[CandidateFit]]:
    """All candidates, those that were fitted now first."""
    present = {addition.key for addition in before.additions}
    leaders = [addition for addition in state.leaders if addition.key not in present]
    screened, fewest = state.screened, 2  # the leader and one more, whatever time they take
    if state.updates % 2 == 0:
        screened, fewest, leaders = _screened(state, magnitudes, effects, before), 1, leaders[:1]
    waiting = [one for one in shortlist(screened, SHORTLIST) if one.addition.key not in {a.key for a in leaders}]
    turn = sorted(waiting, key=lambda one: state.turns.get(one.addition.key, -1))[:1]
    chosen: list[tuple[Addition, Screened | None]] = [(addition, None) for addition in leaders]
    place = 2 if state.updates % 4 == 3 else 1  # at the end is who is left out when time runs out
    chosen[place:place] = [(_variant(magnitudes, one.addition, state.updates), one) for one in turn]
    found: list[CandidateFit] = []
    for addition, one in chosen:
        if len(found) < fewest or not out_of_time():
            fitted = _fit(state, before, magnitudes, addition, one)
            found.append(CandidateFit(addition, fitted.evidence - before.fit.evidence, fitted))
    now = sorted((tried for tried in found if np.isfinite(tried.gain)), key=lambda tried: -tried.gain)
    gains = {**state.gains, **{tried.addition.key: tried.gain for tried in now}}
    turns = {**state.turns, **{tried.addition.key: state.updates for tried in found}}
    again = {tried.addition.key for tried in now}
    ahead = [as_found(tried) for tried in now] + [addition for addition in state.leaders if addition.key not in again]
    best = tuple(sorted(ahead, key=lambda addition: -gains[addition.key])[:LEADERS])
    fits = {tried.addition.key: tried.fit for tried in now}
    after = OnlineState(state.updates + 1, best, gains, turns, screened, before.fit, fits)
    return after, now + _rest(screened, now, gains)


def _screened(
    state: OnlineState, magnitudes: Magnitudes, effects: Mapping[str, Effect], before: Model
) -> tuple[Screened, ...]:
    """Along the measured motion, where a strong effect is seen as it is, or the model's own, where a weak one is."""
    additions = candidates(magnitudes, effects, before.additions)
    by_fit = before.white or state.updates % 4 == 2
    return tuple(screen(magnitudes, before.records, before.additions, additions, fitted=before.fit if by_fit else None))


def _variant(magnitudes: Magnitudes, addition: Addition, turn: int) -> Addition:
    """Of an unmodelled body, what it pushes differs from turn to turn."""
    variants = [addition, *addition.effect.extensions(magnitudes.structure, addition)]
    return variants[turn % len(variants)]


def _rest(screened: Sequence[Screened], now: Sequence[CandidateFit], gains: Mapping[Key, float]) -> list[CandidateFit]:
    """Those not fitted now: as they were when last fitted, the others below them; a screened gain is an estimate."""
    most = now[0].gain if now else np.inf
    least = max(min(gains.values(), default=np.inf), 0.0)
    fitted, rest = {tried.addition.key for tried in now}, []
    for one in shortlist(screened, len(screened)):
        if (key := one.addition.key) not in fitted:
            gain = min(gains[key], most) if key in gains else min(one.gain, least)
            rest.append(CandidateFit(one.addition, gain, None, one))
    return sorted(rest, key=lambda one: -one.gain)


def _fit(
    state: OnlineState, before: Model, magnitudes: Magnitudes, addition: Addition, screened: Screened | None
) -> Fit:
    """The first of the leaders goes on from its last fit; others, which may have been led astray, start from the
    measured motion, or from the model's own where that leaves little."""
    problem = make_problem(magnitudes, before.records, (*before.additions, addition))
    last = state.fits.get(addition.key)
    if last and addition is state.leaders[0]:
        on = fit(problem, carried_on(last, problem), most=ITERATIONS_ON)
        if np.isfinite(on.cost):
            return on
    start = start_from(before, problem, addition, screened) if before.white else None
    schedule = FROM_SIMULATION if start else FROM_MEASURED_MOTION
    return fit(problem, start, schedule, before.fit.cost + THRESHOLDS.hopeless, MOST_ITERATIONS)
