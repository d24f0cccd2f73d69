"""One round of the search: all candidates screened, the likely ones fitted, harder where none leaves only noise."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..effects.base import AttachedBody, ChannelError, Effect, PairSpring, UnloadingSlope
from .assess import assess
from .candidates import candidates, touching
from .fit import FADE, GRADUALLY, HOTTEST, MOST_ITERATIONS, REFINE, SLOWLY, Fit, Stage, equation_error, fit
from .layout import Addition, Layout, make_layout
from .model import Model
from .motion import motion_of
from .prior_odds import against_a_mass, against_a_share
from .profile import closer, profile
from .records import Record
from .scales import Scales
from .screening import Screened, changes_law, embedding, screen
from .trajectory import Trajectory

GAIN = 6.0
"""Nats from which a candidate counts as found; below it, the smaller model is preferred."""

SHORTLIST = 4
"""Candidates from each of the two screenings that are fitted in full ..."""

LONG_LIST = 10
"""... and where none of them leaves white noise."""

MOST_HOSTS = 3
"""Bodies that an unmodelled one is tried on, with a curve to each neighbour."""

NEAR_THE_FLOOR = 2.0
"""Mean square of what the model leaves, in units of the noise, below which a driven channel's error may be all that is
missing: it bends the motion that all curves are fitted to, so that no linearisation tells what it would gain."""

SLOW = 3
"""Candidates that are then fitted on with more care."""

MOST_PROFILES = 4
"""Slopes on which an element may unload that are looked at over their value."""

WORTH_FITTING = 1.0
"""Nats of a screened gain."""

HOPELESS = 400.0
"""A candidate whose cost stays this far above the best one's is not fitted to the end; where the model leaves only
noise, nor is one that does not come below the model's own."""

OFFSETS, OFFSET_STARTS = 10, 2
"""An offset bends the measured motion itself, from which fits start: so many are looked at, so many are fitted from."""


class Tried(NamedTuple):
    """A candidate, and the model with it."""

    addition: Addition
    gain: float  # nats
    fit: Fit | None  # None: only screened
    screened: Screened | None


def try_candidates(
    records: Sequence[Record], scales: Scales, effects: Mapping[str, Effect], model: Model, thorough: bool = False,
    known: Sequence[Tried] = (), before: Sequence[Tried] = (),
) -> list[Tried]:  # fmt: skip
    """All candidates for one more addition, best first; one for each effect and target.

    thorough: try more of them, and harder, where none of the most likely ones leaves white noise. known: what was
    found in another noise, best first; its best fits are taken up. before: what was found in the rounds before.
    """
    additions = candidates(scales.structure, scales, effects, model.additions)
    by_fit = screen(records, scales, model.additions, additions, model.roughness, model.fit)
    by_motion = (
        [] if model.left.whiteness.white else screen(records, scales, model.additions, additions, model.roughness)
    )
    worth = [one for one in by_fit if one.gain > WORTH_FITTING]
    search = _Search(records, scales, model, by_fit)
    search.from_motion(shortlist(by_motion, SHORTLIST))
    search.from_model(shortlist(worth, SHORTLIST))
    search.taken_up([tried for tried in known if tried.fit][:SHORTLIST])
    if thorough and model.left.cost < NEAR_THE_FLOOR:
        bend = [a for a in additions if _bends_driven_motion(scales, a)]
        if model.left.whiteness.white:  # to stand for what was added, one would have had to explain all alone
            fitted = {tried.addition.key for tried in before if tried.fit}
            bend = [a for a in bend if a.key not in fitted]
        search.from_motion(Screened(a, 0.0, 0.0, 1.0) for a in bend)
    if thorough and not model.left.whiteness.white:
        offsets = [a for a in additions if isinstance(a.effect, ChannelError) and a.effect.role == "offset"]
        for harder in (
            search.slowly,
            search.other_ways,
            lambda: search.anew(GRADUALLY),
            lambda: search.from_motion(shortlist(by_motion, SHORTLIST) + shortlist(worth, SHORTLIST), GRADUALLY),
            lambda: search.from_model(shortlist(by_motion, SHORTLIST) + shortlist(worth, LONG_LIST)),
            lambda: search.from_motion(shortlist(worth, SHORTLIST) + shortlist(by_motion, LONG_LIST)),
            search.profile,
            lambda: search.from_motion([start for a in offsets for start in offset_starts(records, scales, model, a)]),
            search.slowly,
            lambda: search.anew(HOTTEST),
        ):
            if search.reached_the_floor():
                break
            harder()
    return search.ranking()


class _Search:
    """Candidates of one round, the best start of each effect and target."""

    def __init__(self, records: Sequence[Record], scales: Scales, model: Model, screened: Sequence[Screened]):
        self.records, self.scales, self.model = records, scales, model
        self.screened = screened
        self.least = model.fit.cost
        self.done: set[tuple[int, Sequence[Stage]]] = set()
        self.found: dict[tuple[str, str], Tried] = {}
        for one in screened:
            self.found.setdefault(one.addition.key, Tried(one.addition, one.gain, None, one))

    def from_motion(self, chosen: Iterable[Screened], stages: Sequence[Stage] = FADE) -> None:
        """Fit candidates from the measured motion."""
        for one in chosen:
            self._fit(one.addition, None, stages)
            if isinstance(one.addition.effect, AttachedBody):
                self._touching(one.addition)

    def from_model(self, chosen: Iterable[Screened]) -> None:
        """Fit candidates from the fit of the model without them."""
        for one in chosen:
            self._fit(one.addition, one)

    def taken_up(self, known: Iterable[Tried]) -> None:
        """Fit candidates from where their fits in another noise have ended."""
        for one in known:
            layout = self._layout(one.addition)
            self._note(one.addition, fit(layout, self.records, (one.fit.theta, one.fit.trajectories)))

    def other_ways(self) -> None:
        """Fit the best load paths in the other ways in which they may carry."""
        best = {t.addition.key for t in [t for t in self.ranking() if t.fit][:SLOW]}
        ways = [one for one in self.screened if isinstance(one.addition.effect, PairSpring)]
        self.from_motion(one for one in ways if one.addition.key in best)

    def _touching(self, addition: Addition) -> None:
        """What an unmodelled body pushes: the rest of its balance may go to any of the bodies that it may touch."""
        hosts: dict[str, Addition] = {addition.host: addition}
        for one in self.screened:
            if one.addition.key == addition.key:
                hosts.setdefault(one.addition.host, one.addition)
        for host in list(hosts.values())[:MOST_HOSTS]:
            for variant in touching(self.scales.structure, host):
                self._fit(variant, None)
        best = self.found[addition.key].addition
        if best.taken_from:
            self._fit(replace(best, taken_from=None), None)

    def profile(self) -> None:
        """Fit the likeliest of the slopes on which an element may unload, which say when its force ends, over them."""
        slopes: dict[tuple[str, str], list[Addition]] = {}
        for one in self.screened:
            if isinstance(one.addition.effect, UnloadingSlope):
                slopes.setdefault(one.addition.key, []).append(one.addition)
        looks = []
        for first, *others in list(slopes.values())[:MOST_PROFILES]:
            starts = [addition.coefficient for addition in (first, *others)]
            looks.append(profile(self._layout(first), self.records, first, starts))
        best = min(looks, key=lambda look: look.fit.cost, default=None)
        if best and best.fit.cost < self.model.fit.cost:
            self._note(best.addition, closer(best, self.records))

    def slowly(self) -> None:
        """Fit the best ones on, with care for forces that jump."""
        for tried in [t for t in self.ranking() if t.fit][:SLOW]:
            start = tried.fit.theta, tried.fit.trajectories
            self._note(
                tried.addition, fit(tried.fit.layout, self.records, start, refine=SLOWLY, most=2 * MOST_ITERATIONS)
            )

    def anew(self, stages: Sequence[Stage]) -> None:
        """Fit the best ones from the measured motion by other stages."""
        for tried in [t for t in self.ranking() if t.fit][:SLOW]:
            self._fit(tried.addition, None, stages)

    def _fit(self, addition: Addition, screened: Screened | None, stages: Sequence[Stage] = FADE) -> None:
        stages = REFINE if screened else stages
        if (id(addition), stages) in self.done:
            return
        self.done.add((id(addition), stages))
        layout = self._layout(addition)
        start = self._start(layout, addition, screened) if screened else None
        hopeless = self.model.fit.cost if self.model.left.whiteness.white else self.least + HOPELESS
        self._note(addition, fit(layout, self.records, start, hopeless, refine=stages))

    def _note(self, addition: Addition, found: Fit) -> None:
        self.least = min(self.least, found.cost)
        gain = found.evidence - self.model.fit.evidence - against_a_mass(self.scales.structure, addition)
        before = self.found.get(addition.key)
        if (
            before is None
            or before.fit is None
            or gain - against_a_share(addition) > before.gain - against_a_share(before.addition)
        ):
            self.found[addition.key] = Tried(addition, gain, found, None)

    def _layout(self, addition: Addition) -> Layout:
        model, scales = self.model, self.scales
        return make_layout(scales.structure, self.records, scales, [*model.additions, addition], model.roughness)

    def _start(self, layout: Layout, addition: Addition, screened: Screened) -> tuple[np.ndarray, list[Trajectory]]:
        theta = layout.start.copy()
        theta[embedding(self.model.fit.layout, layout)] = self.model.fit.theta
        if not changes_law(addition):
            place = next(place for place in layout.places if place.addition is addition)
            theta[place.coefficient] = screened.coefficient
        motions = [
            motion_of(layout, record, r, theta, trajectory.a)
            for r, (record, trajectory) in enumerate(zip(self.records, self.model.fit.trajectories))
        ]
        return theta, motions

    def reached_the_floor(self) -> bool:
        """The best so far leaves nothing but noise."""
        best = next(iter(self.ranking()), None)
        if best is None or best.fit is None or best.gain <= GAIN:
            return False
        return assess(best.fit, self.records, sharply=True).whiteness.white

    def ranking(self) -> list[Tried]:
        """Fitted ones first: a screened gain is an estimate, and does not rank above a fit."""
        fitted = sorted((t for t in self.found.values() if t.fit), key=lambda t: -t.gain)
        rest = sorted((t for t in self.found.values() if not t.fit), key=lambda t: -t.gain)
        least = max(fitted[-1].gain, 0.0) if fitted else np.inf
        return fitted + [t._replace(gain=min(t.gain, least)) for t in rest]


def offset_starts(records: Sequence[Record], scales: Scales, model: Model, addition: Addition) -> list[Screened]:
    """No offset yet, and the values with which the forces along the measured motion fit best."""
    low, high = addition.effect.low, addition.effect.high
    step = (high - low) / OFFSETS
    shifted = [replace(addition, coefficient=low + step * (k + 0.5)) for k in range(OFFSETS)]

    def misfit(one: Addition) -> float:
        layout = make_layout(scales.structure, records, scales, [*model.additions, one], model.roughness)
        return equation_error(layout, records)

    starts = [addition, *sorted(shifted, key=misfit)[:OFFSET_STARTS]]
    return [Screened(one, 0.0, one.coefficient or 0.0, 1.0) for one in starts]


def _bends_driven_motion(scales: Scales, addition: Addition) -> bool:
    driven = [channel for body in scales.structure.bodies if body.driven for channel in body.acceleration]
    return isinstance(addition.effect, ChannelError) and addition.target in driven


def shortlist(screened: Sequence[Screened], length: int) -> list[Screened]:
    """The best of the screened, with the best start each."""
    best: dict[tuple[str, str], Screened] = {}
    for one in screened:
        best.setdefault(one.addition.key, one)
        if len(best) == length:
            break
    return list(best.values())
