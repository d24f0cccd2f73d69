"""A structure with some additions, fitted to recordings."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...effects.effect import Addition
from ..observation.record import ObservedRecord
from ..output_error.continuation import SLOW_CONTACT, SMALL_STEPS, Schedule
from ..output_error.gauss_newton import MOST_ITERATIONS, Fit, fit
from ..output_error.problem import OutputErrorProblem, Point, make_problem
from ..parameterization.free_curve import adapted_roughness
from ..parameterization.layout import Layout
from ..parameterization.magnitudes import Magnitudes
from ..parameterization.model_terms import number_of_additions
from ..residuals.residuals import Residuals, analyse
from .acceptance import better, cost_of_nothing, mean_square_of_nothing, settled

STRAIGHT = 1e-3
"""Roughness of a curve that is a line: its slope then changes by a thousandth of K over the whole crush.
Halved and doubled it changed nothing of 36 looked-at cases, in none of which a curve runs away."""

RUNS_AWAY = 4.0
"""Times the mean square of what was measured: a swing in the opposite phase leaves as much, a bounded one no more.
Halved and doubled it changed nothing of 36 looked-at cases."""


class Model(NamedTuple):
    """The structure with some additions, fitted."""

    additions: tuple[Addition, ...]
    fit: Fit
    residuals: Residuals
    roughness: Mapping[str, np.ndarray]

    @property
    def records(self) -> tuple[ObservedRecord, ...]:
        """With the noise that it was fitted with."""
        return self.fit.problem.records

    @property
    def given(self) -> tuple[Addition, ...]:
        """The additions that the structure had."""
        return self.additions[: number_of_additions(self.fit.layout.structure)]

    @property
    def found(self) -> tuple[Addition, ...]:
        """The others, in the order in which they were added."""
        return self.additions[len(self.given) :]

    @property
    def white(self) -> bool:
        """It leaves nothing but noise."""
        return self.residuals.white

    @property
    def untouched(self) -> list[str]:
        """Elements that are apart in all recordings."""
        of_each = zip(self.fit.layout.structure.elements, *self.residuals.links)
        return [element.name for element, *links in of_each if all(link.apart.all() for link in links)]

    def refitted(self, start: Point | None = None, schedule: Schedule = (), hopeless: float = np.inf) -> "Model":
        """The same model fitted another way."""
        found = fit(self.fit.problem, start, schedule, hopeless)
        return self._replace(fit=found, residuals=analyse(found, sharply=True))


def fit_model(
    magnitudes: Magnitudes, records: Sequence[ObservedRecord], additions: Sequence[Addition],
    start: Point | None = None, hopeless: float = np.inf,
) -> Model:  # fmt: skip
    """Fit, then let the curves fold where they were found to bend sharply, and fit again.

    hopeless: cost of which it is enough to know that the model leaves that.
    """
    problem = make_problem(magnitudes, records, additions)
    found = fit(problem, start, hopeless=hopeless)
    if hopeless < found.cost < np.inf:
        return Model(tuple(additions), found, analyse(found, sharply=True), {})
    if not found.cost < cost_of_nothing(records):
        found = fit(problem, schedule=SMALL_STEPS)
    curves = [link for link in problem.layout.links if link.curve is not None]
    roughness = {link.name: adapted_roughness(link.curve, found.theta) for link in curves}
    if roughness and np.isfinite(found.cost):
        problem = make_problem(magnitudes, records, additions, roughness)
        found = fit(problem, found.point)
    residuals = analyse(found, sharply=True)
    if not problem.noise_is_inflated:
        found, residuals = _with_more_care(problem, found, residuals)
    if roughness and not residuals.mean_square < RUNS_AWAY * mean_square_of_nothing(records):
        found, residuals = _with_straight_curves(magnitudes, problem, additions)
    return Model(tuple(additions), found, residuals, roughness)


def fit_given(magnitudes: Magnitudes, records: Sequence[ObservedRecord], additions: Sequence[Addition]) -> Model:
    """The better of two fits, where not all is noise: of one that has stopped elsewhere than at the least, every effect
    would seem to explain much."""
    model = fit_model(magnitudes, records, additions)
    if model.white:
        return model
    as_stated = fit(model.fit.problem.starting_as_stated(), hopeless=model.fit.cost)
    other = model.refitted(as_stated.point, hopeless=model.fit.cost)
    return other if better(other, model) else model


def _with_more_care(problem: OutputErrorProblem, found: Fit, residuals: Residuals) -> tuple[Fit, Residuals]:
    """Fitted on, where a jump of a force may have stopped the fit short, or anew, where the motion has not settled."""
    if forces_jump(problem.layout) and not residuals.white:
        slower = fit(problem, found.point, SLOW_CONTACT, most=2 * MOST_ITERATIONS)
        if slower.evidence > found.evidence:
            found, residuals = slower, analyse(slower, sharply=True)
    if not settled(found, residuals):
        anew = fit(problem, schedule=SMALL_STEPS)
        there = analyse(anew, sharply=True)
        if there.mean_square < residuals.mean_square:
            found, residuals = anew, there
    return found, residuals


def _with_straight_curves(
    magnitudes: Magnitudes, problem: OutputErrorProblem, additions: Sequence[Addition]
) -> tuple[Fit, Residuals]:
    """The best fit whose curves are straight lines, or the lines that a fit begins with, as one of the problem's own.

    A free curve that lacks what ends a long swing may be bent until the motion runs away, wherever a fit begins.
    """
    lines = {link.name: np.array(STRAIGHT) for link in problem.layout.links if link.curve is not None}
    straight = make_problem(magnitudes, problem.records, additions, lines)
    found = [fit(straight, schedule=schedule).point for schedule in ((), SMALL_STEPS)]
    found.append(straight.measured(straight.layout.start))
    held = [fit(problem, point, held=range(problem.layout.size)) for point in found]
    return min(((one, analyse(one, sharply=True)) for one in held), key=lambda found: found[1].mean_square)


def forces_jump(layout: Layout) -> bool:
    """Whether some force ends at separation other than by falling to zero."""
    one_way = [link for link in layout.links if not link.tension]
    return any(link.parallel or link.remembering or link.damping is not None or link.known_damping for link in one_way)
