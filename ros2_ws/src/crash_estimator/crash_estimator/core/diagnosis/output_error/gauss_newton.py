"""Output-error fit: the free-run motion closest to all measured outputs, with its evidence.

Trajectory and parameters are improved together (lifted Newton, Albersmeyer and Diehl 2010): the equations are
linearised along a trajectory that need not satisfy them yet, and one linear solve corrects both. It starts from the
measured motion, along which most forces are linear in their parameters, so that no good guess is needed, and goes
through the stages of `continuation`. When it has converged, the trajectory is the free-run simulation with the fitted
parameters.
"""

from collections.abc import Sequence
from contextvars import ContextVar
from itertools import count
from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, cho_solve

from ..mechanics.driven_motion import motion_of
from ..mechanics.linearization import Equations, force_along
from ..observation.trajectory import Trajectory
from ..parameterization.layout import Experiment, Layout
from .continuation import FREE_RUN, FROM_MEASURED_MOTION, Schedule
from .laplace_evidence import cholesky, log_prior, posterior
from .normal_equations import Normal, equation_error, may_diverge, normal_equations
from .problem import OutputErrorProblem, Point
from .sensitivity_equations import respond

MOST_ITERATIONS = 20
"""Of which the stages of `FROM_MEASURED_MOTION` are some; longer schedules come on top."""

PATIENCE = 5
"""Iterations: before a fit is given up as hopeless, and that halve a step which has made it worse, to a 32nd."""

LONGEST_SHAPE_STEP = 0.35
"""Of the logarithm of a shape constant in one iteration: its derivatives hold for a factor of 1.4, not for one of 3."""

CONVERGED = 0.1
"""Change of the cost below which an iteration was the last: a twentieth of a nat decides nothing ..."""

COARSE = 1e-3
"""... or as a share of what the cost exceeds that of a fit at the noise floor by: a misfit needs no precision."""

CIRCLES = 4
"""Iterations in which the cost finds no new least by as much: it goes around a kink of the forces. With five, one of a
bag's two unloading lines was told as hysteresis."""

_made: ContextVar[int] = ContextVar("iterations", default=0)


class Step(NamedTuple):
    """One linear solve."""

    delta: np.ndarray
    before: float  # cost with the prior
    after: float  # expected
    factor: tuple
    free: np.ndarray
    scale: np.ndarray


class Fit(NamedTuple):
    """A fitted model."""

    problem: OutputErrorProblem
    theta: np.ndarray  # (p,)
    covariance: np.ndarray  # (p, p)
    trajectories: tuple[Trajectory, ...]
    cost: float  # 2 x negative logarithm of the posterior at its maximum, less constants common to all models
    evidence: float  # nats: logarithm of the marginal likelihood, less constants common to all models

    @property
    def layout(self) -> Layout:
        return self.problem.layout

    @property
    def point(self) -> Point:
        return Point(self.theta, self.trajectories)

    def largest_force(self, element: str) -> float:
        """N, pushing or pulling."""
        each = zip(self.problem.experiments, self.trajectories, strict=True)
        return max(float(np.abs(force_along(element, one, self.theta, motion)).max()) for one, motion in each)

    def constant_stiffness(self, element: str) -> float | None:
        """N/m of a spring; None where it is a curve."""
        link = self.layout.link(element)
        if link.curve is not None:
            return None
        return link.known_stiffness if link.constant is None else float(self.theta[link.constant])


def iterations_made() -> int:
    """Of all fits so far, each a pass over all recordings: work that is the same on every machine, and grows with the
    samples as its time does."""
    return _made.get()


@may_diverge
def solve(
    layout: Layout, normal: Normal, theta: np.ndarray, inflate: float = 1.0, held: np.ndarray | None = None
) -> Step:
    """Minimum of the quadratic model with the prior, inside the limits (an active set).

    inflate: factor on the noise; held (p,): parameters that stay. Raises LinAlgError where nothing is finite.
    """
    prior, weight = layout.prior, 1.0 / inflate**2
    matrix = weight * normal.matrix + prior.precision
    off = theta - prior.mean
    vector = weight * normal.vector - prior.precision @ off
    if not (np.isfinite(matrix).all() and np.isfinite(vector).all()):
        raise LinAlgError("the simulation diverged")
    before = weight * normal.cost + float(off @ prior.precision @ off)
    scale = 1.0 / np.sqrt(np.diagonal(matrix))
    low, high = prior.low - theta, prior.high - theta
    held = np.zeros(layout.size, bool) if held is None else held.copy()
    delta = np.zeros(layout.size)
    for _ in range(8):  # each holds at least one more at its limit; the next linearisation may let it go again
        free = ~held
        target = vector - matrix @ np.where(held, delta, 0.0)
        moving = np.flatnonzero(free)
        small = matrix.take(moving, 0).take(moving, 1) * scale[moving] * scale[moving, None]
        factor = cholesky(small)
        delta[free] = scale[free] * cho_solve(factor, scale[free] * target[free], check_finite=False)
        # by more than a rounding error
        outside = free & ((delta < low - 1e-12 * np.abs(low)) | (delta > high + 1e-12 * np.abs(high)))
        if not outside.any():
            break
        delta[outside] = np.clip(delta[outside], low[outside], high[outside])
        held |= outside
    after = before - 2.0 * float(vector @ delta) + float(delta @ matrix @ delta)
    return Step(delta, before, after, factor, free, scale)


@may_diverge
def advance(
    experiment: Experiment, theta: np.ndarray, delta: np.ndarray, trajectory: Trajectory, equations: Equations
) -> Trajectory:
    """The trajectory of theta + delta, to first order."""
    change = respond(equations.linear, np.append(1.0, delta[equations.columns]))
    return motion_of(experiment, theta + delta, trajectory.a + change)


def equation_error_start(problem: OutputErrorProblem, held: Sequence[int] = ()) -> Point:
    """The measured motion, and parameters that fit the forces along it; held: they stay as they start."""
    stays = np.isin(np.arange(problem.layout.size), held)
    stays[problem.layout.common :] = True
    return _fitting_along(
        problem, problem.measured(problem.layout.start.copy()), FROM_MEASURED_MOTION[0].inflate, stays
    )


def start_along(problem: OutputErrorProblem, trajectories: Sequence[Trajectory]) -> Point:
    """The motions that another model has found, and parameters that fit the forces along them."""
    along = problem.moved(problem.layout.start.copy(), trajectories)
    return _fitting_along(problem, along, 1.0, np.zeros(problem.layout.size, bool))


def _fitting_along(problem: OutputErrorProblem, point: Point, inflate: float, stays: np.ndarray) -> Point:
    """As they start, where forces along such a motion are beyond all bounds."""
    stays = stays | shape_parameters(problem.layout)
    try:
        step = solve(problem.layout, equation_error(problem, point), point.theta, inflate, stays)
    except LinAlgError:
        return point
    return Point(point.theta + step.delta, point.trajectories)


def shape_parameters(layout: Layout) -> np.ndarray:
    """(p,) True for the logarithms of shape constants."""
    found = np.zeros(layout.size, bool)
    for term in layout.terms:
        found[list(term.shapes.values())] = True
    return found


def fit(
    problem: OutputErrorProblem, start: Point | None = None, schedule: Schedule = (), hopeless: float = np.inf,
    most: int = MOST_ITERATIONS, held: Sequence[int] = (),
) -> Fit:  # fmt: skip
    """Fit from the measured motion, or from a given point.

    schedule: stages before the free run, `FROM_MEASURED_MOTION` where none are given and the fit starts from that;
    hopeless: cost above which, after PATIENCE iterations, it is not worth going on; most: iterations; held: parameters
    that stay as they start.
    """
    layout = problem.layout
    stages = list(schedule or (() if start else FROM_MEASURED_MOTION))
    most += max(len(stages) - len(FROM_MEASURED_MOTION), 0)
    point = start or equation_error_start(problem, (*held, *layout.trusted))
    shapes = shape_parameters(layout)
    stays, trusted = (np.isin(np.arange(layout.size), which) for which in (held, layout.trusted))
    last_good: tuple[Point, Step] | None = None
    least: tuple[Point, Step, Normal] | None = None
    halvings, last, circles = 0, np.inf, 0
    for iteration in count(1):
        _made.set(iterations_made() + 1)
        stage = stages.pop(0) if stages else FREE_RUN
        try:
            normal, equations = normal_equations(problem, point, stage)
            # a shape constant fitted to a motion that is still wrong goes astray
            fixed = stays | shapes if stage.inflate > 1.0 else stays
            fixed = fixed | trusted if stage.observer > 0.0 else fixed
            step = solve(layout, normal, point.theta, stage.inflate, fixed)
        except LinAlgError:
            step = None
        worse = step is None or (last_good is not None and step.before > last_good[1].before + 1.0)
        if worse and last_good is not None and halvings < PATIENCE:
            halvings += 1
            point = _half_way_back(problem, last_good[0], point)
            continue
        if step is None:
            return _failed(problem, point)
        last_good = (point, step) if stage == FREE_RUN else None
        halvings = 0
        # 1.3: so near the noise a fit is at its floor, where every nat counts; with 1.15 and 1.6 none of 60 looked-at
        # cases was told otherwise
        enough = max(CONVERGED, COARSE * (step.after - 1.3 * normal.samples))
        if stage == FREE_RUN:
            circles = 0 if least is None or step.before < least[1].before - enough else circles + 1
            if least is None or step.before < least[1].before:
                least = point, step, normal
        delta = step.delta * _shorten(step.delta, shapes)
        moved = [
            advance(experiment, point.theta, delta, trajectory, each)
            for experiment, trajectory, each in zip(problem.experiments, point.trajectories, equations, strict=True)
        ]
        point = Point(point.theta + delta, moved)
        change, last = abs(last - step.after) if stage == FREE_RUN else np.inf, step.after
        if stage == FREE_RUN and (change < enough or (iteration >= PATIENCE and step.after - change > hopeless)):
            break
        if circles >= CIRCLES or iteration >= most:
            break
    cost = step.after
    if least is not None and not 0.0 < cost <= least[1].before:
        # it went astray at a kink of the forces; or so far that nothing but rounding is left of the cost
        (point, _, normal), cost = least, least[1].before
    cost += normal.grown
    try:
        covariance, log_determinant = posterior(normal.matrix + layout.prior.precision)
    except LinAlgError:
        return _failed(problem, point)
    evidence = -0.5 * cost - 0.5 * log_determinant + 0.5 * log_prior(layout)
    return Fit(problem, point.theta, covariance, tuple(point.trajectories), cost, evidence)


def _failed(problem: OutputErrorProblem, point: Point) -> Fit:
    """A simulation that diverges, whatever is tried: infinitely unlikely."""
    unknown = np.full_like(problem.layout.prior.precision, np.nan)
    return Fit(problem, point.theta, unknown, tuple(point.trajectories), np.inf, -np.inf)


def _shorten(delta: np.ndarray, shapes: np.ndarray) -> float:
    return LONGEST_SHAPE_STEP / max(LONGEST_SHAPE_STEP, float(np.abs(delta[shapes]).max(initial=0.0)))


def _half_way_back(problem: OutputErrorProblem, good: Point, bad: Point) -> Point:
    pairs = zip(good.trajectories, bad.trajectories, strict=True)
    between = [old._replace(a=np.where(np.isfinite(new.a), 0.5 * (old.a + new.a), old.a)) for old, new in pairs]
    return problem.moved(good.theta + 0.5 * (bad.theta - good.theta), between)
