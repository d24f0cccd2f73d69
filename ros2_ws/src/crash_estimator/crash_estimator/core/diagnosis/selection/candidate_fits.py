"""All candidates for one more addition: screened, the likely ones fitted, harder where none leaves only noise."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...effects.effect import Addition, Effect
from ..output_error.continuation import FROM_MEASURED_MOTION, FROM_SIMULATION, SLOW_CONTACT, SMALL_STEPS, Schedule
from ..output_error.gauss_newton import MOST_ITERATIONS, Fit, fit, start_along
from ..output_error.problem import OutputErrorProblem, Point, make_problem
from ..output_error.profile_likelihood import closer, profile
from ..parameterization.magnitudes import Magnitudes
from ..residuals.residuals import analyse
from .acceptance import among_variants, coefficient, cost_of_noise, odds_against
from .candidates import candidates
from .fitted_model import Model
from .score_screening import Screened, screen, shortlist
from .search_limit import search_is_over
from .thresholds import THRESHOLDS


class CandidateFit(NamedTuple):
    """A candidate, and the model with it."""

    addition: Addition
    gain: float  # nats
    fit: Fit | None  # None: only screened
    screened: Screened | None = None


def screen_candidates(magnitudes: Magnitudes, effects: Mapping[str, Effect], model: Model) -> list[CandidateFit]:
    """All candidates, likeliest first, one for each effect and target; none is fitted."""
    additions = candidates(magnitudes, effects, model.additions)
    screened = screen(magnitudes, model.records, model.additions, additions, model.roughness, model.fit)
    return _Search(magnitudes, model, screened).ranking()


def fit_candidates(
    magnitudes: Magnitudes, effects: Mapping[str, Effect], model: Model, thorough: bool = False,
    in_other_noise: Sequence[CandidateFit] = (), least: float = np.inf,
) -> list[CandidateFit]:  # fmt: skip
    """All candidates, best first; one for each effect and target.

    thorough: fit the best of them harder, where none of the most likely ones leaves white noise. in_other_noise, where
    not thorough: what was found with other noise, best first; its best fits are gone on from, and of what a real
    structure leaves the best ones are fitted anew: a fit ends there in one of several minima, and which one it was
    decided, with the last digit of a sample, what led. least: as of `begin`.
    """
    search = begin(magnitudes, effects, model, least)
    if thorough:
        fit_harder(search, model, beside=bool(model.found))
    else:
        search.go_on_from(in_other_noise)
        if model.residuals.mean_square >= THRESHOLDS.real_structure:
            search.anew()
    return search.ranking()


def begin(magnitudes: Magnitudes, effects: Mapping[str, Effect], model: Model, least: float = np.inf) -> "_Search":
    """The likeliest candidates fitted; least: cost that another explanation leaves; what stays far above it is not
    fitted to the end."""
    additions = candidates(magnitudes, effects, model.additions)
    given = magnitudes, model.records, model.additions, additions, model.roughness
    by_fit = screen(*given, model.fit)
    by_motion = [] if model.white else screen(*given)
    search = _Search(magnitudes, model, by_fit, least)
    search.from_motion(shortlist(by_motion, THRESHOLDS.shortlist))
    search.from_model(shortlist([one for one in by_fit if one.gain > 0.0], THRESHOLDS.shortlist))
    search.remembered_otherwise()
    return search


def fit_harder(search: "_Search", model: Model, beside: bool = False) -> None:
    """Go on with a search that has begun; beside: what was found, where only what explains most is fitted harder."""
    nothing_left = model.white and beside  # to stand for what was added, it would have had to explain all alone
    if model.residuals.mean_square < THRESHOLDS.near_floor and not nothing_left:
        search.from_motion(search.bending())
    if not model.white:
        ways = search.along, search.slowly, search.other_variants, search.anew, search.profile
        # what explains little of less than a real structure leaves is fitted neither in other ways nor anew
        of_little = ways if model.residuals.mean_square >= THRESHOLDS.real_structure else (ways[1], ways[-1])
        for harder in ways:
            if search_is_over() or search.reached_the_floor() or not search.found:
                break
            if search.explains_most():
                if search.out_of_reach():
                    break
            elif beside or harder not in of_little:
                continue
            harder()
    if not search_is_over() and search.reached_the_floor():
        search.hardly_screened()
        if not model.white:
            search.along()


class _Search:
    """The best fit of each effect and target so far."""

    def __init__(self, magnitudes: Magnitudes, model: Model, screened: Sequence[Screened], least: float = np.inf):
        """screened: along the model's fit."""
        self.magnitudes, self.model, self.screened = magnitudes, model, screened
        self.least = min(model.fit.cost, least)
        # the additions are kept: another one may get the id of one that is gone
        self.done: dict[tuple[int, Schedule], Addition] = {}
        self.found: dict[tuple[str, str], CandidateFit] = {}
        for one in screened:
            self.found.setdefault(one.addition.key, CandidateFit(one.addition, one.gain, None, one))

    def from_motion(self, chosen: Iterable[Screened]) -> None:
        """Fit candidates from the measured motion."""
        for one in chosen:
            self._fit(one.addition)
            if one.addition.effect.extensions(self.magnitudes.structure, one.addition):
                self._extended(one.addition)

    def from_model(self, chosen: Iterable[Screened]) -> None:
        """Fit candidates from the fit of the model without them."""
        for one in chosen:
            self._fit(one.addition, one, FROM_SIMULATION)

    def bending(self) -> Iterable[Screened]:
        """Errors that bend the motion that all curves are fitted to: no linearisation tells what those would gain."""
        bodies = self.magnitudes.structure.bodies
        driven = {channel for body in bodies if body.driven for channel in body.acceleration}
        return (one for one in self.screened if one.addition.effect.distorts and one.addition.target in driven)

    def go_on_from(self, found: Iterable[CandidateFit]) -> None:
        """Fit the best candidates from where their fits in another noise have ended."""
        for one in [one for one in found if one.fit][: THRESHOLDS.shortlist]:
            self._note(one.addition, fit(self._problem(one.addition), one.fit.point))

    def other_variants(self) -> None:
        """Fit the best ones in the other ways in which they may act on their targets."""
        best = {one.addition.key for one in self._best()}
        ways = [one for one in self.screened if len(one.addition.effect.variants) > 1 or one.addition.recording]
        self.from_motion(one for one in ways if one.addition.key in best)

    def remembered_otherwise(self) -> None:
        """Fit the best one, if it is a force that remembers, in its other forms from where its fit has ended: to a
        screening they are much the same."""
        best = self.ranking()[0] if self.found else None
        if best is None or best.fit is None or not best.addition.effect.remembers:
            return
        for form in (one for one in best.addition.effect.variants if one != best.addition.variant):
            addition = replace(best.addition, variant=form)
            problem = self._problem(addition)
            self._note(addition, fit(problem, problem.moved(*best.fit.point)))

    def _extended(self, addition: Addition) -> None:
        """With what an unmodelled body pushes: the rest of its balance may go to any body that it may touch."""
        hosts: dict[str, Addition] = {addition.host: addition}
        for one in self.screened:
            if one.addition.key == addition.key:
                hosts.setdefault(one.addition.host, one.addition)
        for host in list(hosts.values())[: THRESHOLDS.few]:
            for variant in host.effect.extensions(self.magnitudes.structure, host):
                self._fit(variant)
        best = self.found[addition.key].addition
        if best.taken_from:
            self._fit(replace(best, taken_from=None))

    def slowly(self) -> None:
        """Fit the best ones on, with care for forces that jump."""
        for one in self._best():
            on = fit(one.fit.problem, one.fit.point, SLOW_CONTACT, most=2 * MOST_ITERATIONS)
            self._note(one.addition, on)

    def anew(self) -> None:
        """Fit the best ones from the measured motion in small steps."""
        for one in self._best():
            self._fit(one.addition, None, SMALL_STEPS)

    def profile(self) -> None:
        """Fit one that has a constant which says when its force ends, on the target of the best one, or else the
        likeliest: as the others are, then over that constant. Of 32 looked-at side impacts that lack such a constant
        30 are told right; 28 where that was looked at only behind a force that remembers."""
        best, profiled = self.ranking()[0].addition, [o.addition for o in self.ranking() if o.addition.effect.profiled]
        on_target = [one for one in profiled if one.target == best.target]
        for chosen in on_target or profiled[: THRESHOLDS.few]:
            starts = [one.addition for one in self.screened if one.addition.key == chosen.key]
            self._fit(starts[0])
            if not self.reached_the_floor():
                self._over_its_constant(starts, best)
            if self.reached_the_floor():
                break

    def _over_its_constant(self, starts: Sequence[Addition], best: Addition) -> None:
        """With care behind a force that remembers, as such forces follow it first; closer, where it takes away about as
        much as the best one."""
        followed = best.effect.remembers and best.target == starts[0].target
        lacks, gained = self.model.fit.cost, self.model.fit.cost - self.least
        look = profile(
            self._problem(starts[0]), starts[0], [addition.coefficient for addition in starts],
            SMALL_STEPS if followed else FROM_MEASURED_MOTION, hopeless=lacks - THRESHOLDS.most * gained,
        )  # fmt: skip
        if lacks - look.fit.cost > THRESHOLDS.nearly_all * gained:
            self._note(look.addition, closer(look))

    def hardly_screened(self) -> None:
        """Fit what enters no force in proportion, a constant of the law that the best one adds to, or a delay: a
        screening, which takes it for small, may see nothing of one that explains as much."""
        best = self.ranking()[0].addition
        kin = [o for o in self.screened if o.addition.effect.changes_law and o.addition.target == best.target]
        delays = shortlist([o for o in self.screened if o.addition.effect.distorts == "delay"], THRESHOLDS.few)
        new = [o for o in [*kin, *delays] if self.found[o.addition.key].fit is None]
        self.from_motion(shortlist(new, len(new)))

    def along(self) -> None:
        """Fit other laws on the same target along the motion that the best one has found: where that leaves hardly more
        than noise, another one that leaves as little is near its own best there, however the usual fits were led
        astray. Where it leaves no more than noise, only those that come near it."""
        fitted, lacked = [one for one in self.ranking() if one.fit], self.model.fit.cost
        hardly_more = min(lacked, THRESHOLDS.near_floor * cost_of_noise(self.model.records))
        if not fitted or fitted[0].fit.cost > hardly_more:
            return
        best, *others = fitted
        least = THRESHOLDS.nearly_all if self.reached_the_floor() else 0.0
        near = lacked - least * (lacked - best.fit.cost)
        rivals = {o.addition.key for o in others if o.addition.target == best.addition.target and o.fit.cost < near}
        for addition in (one.addition for one in self.screened if one.addition.key in rivals):
            problem = self._untrusting(addition)
            start = start_along(problem, best.fit.trajectories)
            self._note(addition, fit(problem, start, hopeless=self.least + THRESHOLDS.hopeless))

    def _best(self) -> list[CandidateFit]:
        return [one for one in self.ranking() if one.fit][: THRESHOLDS.few]

    def _fit(
        self, addition: Addition, screened: Screened | None = None, schedule: Schedule = FROM_MEASURED_MOTION
    ) -> None:
        if (id(addition), schedule) in self.done or search_is_over():
            return
        self.done[id(addition), schedule] = addition
        problem = self._problem(addition)
        start = start_from(self.model, problem, addition, screened) if screened else None
        hopeless = self.model.fit.cost if self.model.white else self.least + THRESHOLDS.hopeless
        self._note(addition, fit(problem, start, schedule, hopeless))

    def _note(self, addition: Addition, found: Fit) -> None:
        shapes = found.layout.term(addition).shapes_at(found.theta)
        c = coefficient(addition, found)
        if addition.effect.is_doubt(self.magnitudes, addition, c, shapes, found):
            return
        self.least = min(self.least, found.cost)
        gain = found.evidence - self.model.fit.evidence - odds_against(addition, found)
        before = self.found.get(addition.key)
        if (
            before is None
            or before.fit is None
            or among_variants(addition, gain) > among_variants(before.addition, before.gain)
        ):
            self.found[addition.key] = CandidateFit(addition, gain, found)

    def _problem(self, addition: Addition) -> OutputErrorProblem:
        return self._untrusting(addition).starting_as_found(self.model.fit.layout, self.model.fit.theta)

    def _untrusting(self, addition: Addition) -> OutputErrorProblem:
        """Where constant stiffnesses start as the measured motion shows them."""
        model = self.model
        return make_problem(self.magnitudes, model.records, [*model.additions, addition], model.roughness)

    def reached_the_floor(self) -> bool:
        """The best so far leaves nothing but noise."""
        best = next(iter(self.ranking()), None)
        if best is None or best.fit is None or best.gain <= THRESHOLDS.gain:
            return False
        return analyse(best.fit, sharply=True).white

    def explains_most(self) -> bool:
        """The best so far takes a large share of the misfit away."""
        return self.least < (1.0 - THRESHOLDS.most) * self.model.fit.cost

    def out_of_reach(self) -> bool:
        """What is left is so much more than noise that nothing makes noise of it."""
        return self.least > THRESHOLDS.out_of_reach * cost_of_noise(self.model.records)

    def ranking(self) -> list[CandidateFit]:
        return ranked(self.found.values())


def ranked(found: Iterable[CandidateFit]) -> list[CandidateFit]:
    """Fitted ones first: a screened gain is an estimate, and does not rank above a fit that has gained anything."""
    best_first = sorted(found, key=lambda one: -one.gain)
    fitted, rest = [one for one in best_first if one.fit], [one for one in best_first if not one.fit]
    least = min((one.gain for one in fitted if one.gain > 0.0), default=0.0 if fitted else float("inf"))
    return fitted + [one._replace(gain=min(one.gain, least)) for one in rest]


def start_from(model: Model, problem: OutputErrorProblem, addition: Addition, screened: Screened | None) -> Point:
    """Where the model without the addition has ended, with the coefficient that its screening estimates."""
    theta = problem.widened(model.fit.layout, model.fit.theta)
    if screened and not addition.effect.changes_law:
        theta[problem.layout.term(addition).coefficient] = screened.coefficient
    return problem.moved(theta, model.fit.trajectories)
