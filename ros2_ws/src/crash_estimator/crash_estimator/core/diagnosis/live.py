"""Which effect is missing, as far as the samples go: an answer every moment while a test is replayed.

Each update looks at all candidates in one linearisation and fits a few in full, in means over short bins with coarse
curves: those that led at the last update, and one whose turn it is. So an update costs little, and the ranking
ripens from update to update. After the last sample it is for `diagnose` to say what is so.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from crash_replay.recording import Recording, Test

from ..effects import EFFECTS
from ..effects.base import AttachedBody, Effect
from ..kinematics import Kinematics
from ..structure import EffectSpec, Structure
from .additions import additions_of
from .answer import ranking_of
from .assess import Left, assess, noise_floor, rms
from .candidates import candidates, touching
from .coarse import coarsened
from .fit import REFINE, Fit, fit
from .layout import Addition, Layout, make_layout
from .linearise import motion_of
from .live_answer import Change, LiveAnswer, curves
from .misfit import misfit_windows
from .records import FEWEST_SAMPLES, Record, make_record
from .scales import Scales, make_scales
from .screening import Screened, changes_law, embedding, screen
from .search import HOPELESS, Model, Round, Tried, as_found, shortlist

CELLS = 16
"""Of a free curve over its crush scale."""

LEADERS = 2
"""Candidates that are fitted again at every other update, in between only the first of them; and one whose turn it is ..."""

SHORTLIST = 8
"""... of so many that the screening names first."""

MOST_ITERATIONS = 10

Key = tuple[str, str]


class LiveState(NamedTuple):
    """What one update leaves for the next."""

    updates: int = 0
    leaders: tuple[Addition, ...] = ()  # as found, best first
    gains: Mapping[Key, float] = {}  # nats, when last fitted
    turns: Mapping[Key, int] = {}  # update at which it was last fitted
    screened: tuple[Screened, ...] = ()  # at every other update


@dataclass(frozen=True)
class LiveDiagnosis:
    """Of one test; `init` and `update` fold it. Raises ModelError or RecordingError where model and test do not fit."""

    structure: Structure
    test: Test
    others: Sequence[Recording] = ()  # of the same structure, at other speeds
    effects: Mapping[str, Effect] = field(default_factory=lambda: EFFECTS)

    def __post_init__(self):
        Kinematics(self.structure, self.test)
        object.__setattr__(self, "other_records", [make_record(self.structure, other) for other in self.others])

    def init(self) -> LiveState:
        return LiveState()

    def update(self, state: LiveState, recording: Recording) -> tuple[LiveState, LiveAnswer | None]:
        """The answer on the samples so far; None while they are too few, or where nothing fits them."""
        if np.count_nonzero(recording.time_ns >= 0) < FEWEST_SAMPLES:
            return state, None
        full = [make_record(self.structure, recording), *self.other_records]
        records = [coarsened(record) for record in full]
        scales = make_scales(self.structure, records, CELLS)
        given = _model(records, scales, additions_of(self.structure, scales, self.effects))
        if given is None:
            return state, None
        state, tried = _try_some(state, scales, self.effects, given)
        left = assess(tried[0].fit, records) if tried and tried[0].fit else given.left
        # what even the best leaves counts as noise
        done = Round(given, [one._replace(gain=one.gain / max(left.cost, 1.0)) for one in tried])
        best = done.best
        left = left if best else given.left
        layout, found = given.fit.layout, (_spec(best.addition),) if best else ()
        finely = [_finely(each, full, records) for each in ((given.left, left) if best else (given.left,))]
        answer = LiveAnswer(
            verdict="effect_missing" if best else "adequate" if given.left.whiteness.white else "unexplained",
            text="",
            ranking=ranking_of(done, len(records)),
            found=found,
            rms=Change(*(_rms(layout, full, each) for each in (finely[0], finely[-1]))),
            free_run=Change(np.nan, np.nan),
            noise_floor=noise_floor(layout, full),
            white=(given.left.whiteness, left.whiteness),
            misfit=misfit_windows(layout, records[:1], given.left),
            fits=tuple(curves(layout, full[0], each[0], found[:k]) for k, each in enumerate(finely)),
        )
        return state, answer._replace(text=_text(recording, answer))


def _model(records: Sequence[Record], scales: Scales, additions: Sequence[Addition]) -> Model | None:
    layout = make_layout(scales.structure, records, scales, additions)
    found = fit(layout, records, most=MOST_ITERATIONS)
    return Model(tuple(additions), found, assess(found, records), {}, records) if np.isfinite(found.cost) else None


def _try_some(state: LiveState, scales: Scales, effects: Mapping[str, Effect], before: Model) -> tuple[LiveState, list[Tried]]:
    """All candidates, those that were fitted now first."""
    present = {addition.key for addition in before.additions}
    leaders = [addition for addition in state.leaders if addition.key not in present]
    screened = state.screened
    if state.updates % 2 == 0:
        screened, leaders = _screened(state, scales, effects, before), leaders[:1]
    waiting = [one for one in shortlist(screened, SHORTLIST) if one.addition.key not in {a.key for a in leaders}]
    turn = sorted(waiting, key=lambda one: state.turns.get(one.addition.key, -1))[:1]
    found = [_tried(scales, before, addition, None) for addition in leaders]
    found += [_tried(scales, before, _variant(scales, one.addition, state.updates), one) for one in turn]
    now = sorted((tried for tried in found if np.isfinite(tried.gain)), key=lambda tried: -tried.gain)
    gains = {**state.gains, **{tried.addition.key: tried.gain for tried in now}}
    turns = {**state.turns, **{one.addition.key: state.updates for one in turn}}
    again = {tried.addition.key for tried in now}
    ahead = [as_found(tried) for tried in now] + [addition for addition in state.leaders if addition.key not in again]
    leaders = tuple(sorted(ahead, key=lambda addition: -gains[addition.key])[:LEADERS])
    return LiveState(state.updates + 1, leaders, gains, turns, screened), now + _rest(screened, now, gains)


def _screened(
    state: LiveState, scales: Scales, effects: Mapping[str, Effect], before: Model
) -> tuple[Screened, ...]:
    """Along the measured motion, where a strong effect is seen as it is, and along the model's own, where a weak one is."""
    additions = candidates(scales.structure, scales, effects, before.additions)
    by_fit = before.left.whiteness.white or state.updates % 4 == 2
    return tuple(screen(before.records, scales, before.additions, additions, None, before.fit if by_fit else None))


def _variant(scales: Scales, addition: Addition, turn: int) -> Addition:
    """Of an unmodelled body, what it pushes differs from turn to turn."""
    if not isinstance(addition.effect, AttachedBody):
        return addition
    variants = [addition, *touching(scales.structure, addition)]
    return variants[turn % len(variants)]


def _tried(scales: Scales, before: Model, addition: Addition, screened: Screened | None) -> Tried:
    fitted = _fit(before, scales, addition, screened)
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


def _fit(before: Model, scales: Scales, addition: Addition, screened: Screened | None) -> Fit:
    """From the measured motion; from the model's own where that leaves little."""
    layout = make_layout(scales.structure, before.records, scales, (*before.additions, addition))
    start = _start(before, layout, addition, screened) if before.left.whiteness.white else None
    return fit(layout, before.records, start, before.fit.cost + HOPELESS, MOST_ITERATIONS, REFINE)


def _start(before: Model, layout: Layout, addition: Addition, screened: Screened | None):
    theta = layout.start.copy()
    theta[embedding(before.fit.layout, layout)] = before.fit.theta
    if screened and not changes_law(addition):
        theta[next(place.coefficient for place in layout.places if place.addition is addition)] = screened.coefficient
    motions = zip(before.records, before.fit.trajectories)
    return theta, [motion_of(layout, record, r, theta, motion.a) for r, (record, motion) in enumerate(motions)]


def _finely(left: Left, full: Sequence[Record], records: Sequence[Record]) -> list[np.ndarray]:
    """What is predicted of all samples: a straight line between the bins' centres."""
    finely = []
    for every, record, predicted in zip(full, records, left.predicted):
        time, centre = every.time[every.at], record.time[record.at]
        finely.append(np.stack([np.interp(time, centre, column) for column in predicted.T], axis=1))
    return finely


def _rms(layout: Layout, full: Sequence[Record], predicted: Sequence[np.ndarray]) -> float:
    return rms(layout, [every.measured - output for every, output in zip(full, predicted)])


def _spec(addition: Addition) -> EffectSpec:
    """Without coefficient and shape constants: they ripen."""
    return EffectSpec(
        *addition.key,
        host=addition.host,
        touches=addition.touches,
        taken_from=addition.taken_from,
        variant=addition.variant,
    )


def _text(recording: Recording, answer: LiveAnswer) -> str:
    so_far = f"up to {recording.time_ns[-1] * 1e-6:.1f} ms: "
    floor = f"noise floor {answer.noise_floor:.3g}"
    before, after = answer.rms
    if answer.verdict == "adequate":
        return so_far + f"nothing significant is missing (residual RMS {before:.3g} m/s^2, {floor})"
    if answer.verdict == "unexplained":
        return so_far + f"unexplained: residual RMS {before:.3g} m/s^2, {floor}; no candidate explains it yet"
    best = answer.ranking[0]
    rivals = f", not yet told from {', '.join(best.confounded_with)}" if best.confounded_with else ""
    return so_far + (
        f"effect missing: {best.name}, {best.coefficient:.4g} +- {best.std:.2g} {best.unit}{rivals}; "
        f"residual RMS {before:.3g} -> {after:.3g} m/s^2, {floor}"
    )
