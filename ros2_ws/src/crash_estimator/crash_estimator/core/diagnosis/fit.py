"""Output-error fit: the free-run motion closest to all measured outputs, with its evidence.

Trajectory and parameters are improved together (lifted Newton): the equations are linearised along a trajectory that
need not satisfy them yet, and one linear solve corrects both. It starts from the measured motion, along which most
forces are linear in their parameters, so that no good guess is needed. At first an observer pulls the
simulation towards the measured motion and the noise is taken larger than it is; both fade out. When it has
converged, the trajectory is the free-run simulation with the fitted parameters.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve, solve_triangular

from .layout import Layout
from .linearise import Equations
from .motion import measured_motion, motion_of
from .normal import FREE_RUN, Normal, Stage, may_diverge, normal_equations
from .propagate import respond
from .records import Record
from .trajectory import Trajectory

FADE = (Stage(200.0, 30.0, 16.0), Stage(80.0, 10.0, 8.0), Stage(30.0, 3.0, 4.0), Stage(0.0, 1.0, 2.0))
"""Stages of a fit that starts from the measured motion; then the observer is off and the noise as it is.

A force that jumps at separation is felt by the fit only while it jumps: blurred, it is drawn to the right instant."""

GRADUALLY = (
    *(Stage(pull, 1.5 * pull, blur) for pull, blur in zip(np.geomspace(200.0, 3.0, 16), np.geomspace(16.0, 2.0, 16))),
    Stage(0.0, 2.0, 6.0),
    Stage(0.0, 1.0, 2.0),
)
"""Where that has led nowhere, as a light body between stiff elements may: the observer is let go in small steps, and
less is believed at first, so that less is fitted to a motion that is still wrong."""

HOTTEST = tuple(stage._replace(inflate=100.0 * stage.inflate) for stage in FADE)
"""Where not even that leads anywhere, as with a measured motion that errs by far."""

REFINE = (Stage(0.0, 2.0, 6.0), Stage(0.0, 1.0, 2.0))
"""Stages of a fit that starts from a simulation."""

SLOWLY = tuple(Stage(0.0, 1.0, blur) for blur in (8.0, 8.0, 8.0, 4.0, 4.0, 4.0, 2.0, 2.0, 2.0))
"""Stages where a force that jumps at separation has stopped a fit short."""


MOST_ITERATIONS = 20
LEAST = 5
MOST_HALVINGS = 5
LONGEST_SHAPE_STEP = 0.35
"""Of the logarithm of a shape constant in one iteration."""

CONVERGED = 0.1
"""Change of the cost below which an iteration was the last ..."""

COARSE = 1e-3
"""... or as a share of what the cost exceeds that of a fit at the noise floor by: a misfit needs no precision."""

CIRCLES = 4
"""Iterations in which the cost finds no new least by as much: it goes around a kink of the forces."""


RIDGE = 1e-8
"""Share of a parameter's own precision."""


class Step(NamedTuple):
    delta: np.ndarray
    before: float  # cost with the prior
    after: float  # expected
    factor: tuple
    free: np.ndarray
    scale: np.ndarray


class Fit(NamedTuple):
    """A fitted model."""

    layout: Layout
    theta: np.ndarray  # (p,)
    covariance: np.ndarray  # (p, p)
    trajectories: tuple[Trajectory, ...]
    cost: float  # 2 x negative logarithm of the posterior at its maximum, less constants common to all models
    evidence: float  # nats: logarithm of the marginal likelihood, less constants common to all models
    iterations: int


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
    for _ in range(8):
        free = ~held
        target = vector - matrix @ np.where(held, delta, 0.0)
        kept = np.flatnonzero(free)
        small = matrix.take(kept, 0).take(kept, 1) * scale[kept] * scale[kept, None]
        factor = _cholesky(small)
        delta[free] = scale[free] * cho_solve(factor, scale[free] * target[free], check_finite=False)
        outside = free & ((delta < low - 1e-12 * np.abs(low)) | (delta > high + 1e-12 * np.abs(high)))
        if not outside.any():
            break
        delta[outside] = np.clip(delta[outside], low[outside], high[outside])
        held |= outside
    after = before - 2.0 * float(vector @ delta) + float(delta @ matrix @ delta)
    return Step(delta, before, after, factor, free, scale)


def _cholesky(matrix: np.ndarray) -> tuple[np.ndarray, bool]:
    """Factor of a matrix with a unit diagonal; two columns that say the same may round to less than positive."""
    try:
        return cho_factor(matrix, lower=True, check_finite=False)
    except LinAlgError:
        return cho_factor(matrix + RIDGE * np.eye(len(matrix)), lower=True, check_finite=False)


@may_diverge
def advance(
    layout: Layout, record: Record, r: int, theta, delta, trajectory: Trajectory, equations: Equations
) -> Trajectory:
    """The trajectory of theta + delta, to first order."""
    change = respond(equations.linear, np.append(1.0, delta[equations.columns]))
    return motion_of(layout, record, r, theta + delta, trajectory.a + change)


def equation_error_start(
    layout: Layout, records: Sequence[Record], held: Sequence[int] = ()
) -> tuple[np.ndarray, list[Trajectory]]:
    """Parameters that fit the forces along the measured motion, and that motion; held: those that stay as they
    start."""
    theta, trajectories, step = _along_the_measured(layout, records, FADE[0].inflate, held)
    return theta + step.delta, trajectories


def equation_error(layout: Layout, records: Sequence[Record], inflate: float = 30.0) -> float:
    """What that fit leaves, in noise taken larger, for the motion's own errors weigh more; effects stay as they
    start."""
    try:
        return _along_the_measured(layout, records, inflate, [p.coefficient for p in layout.places])[2].after
    except LinAlgError:
        return np.inf


def _along_the_measured(layout: Layout, records: Sequence[Record], inflate: float, kept: Sequence[int] = ()):
    theta = layout.start.copy()
    trajectories = [measured_motion(layout, record, r, theta) for r, record in enumerate(records)]
    normal, _ = normal_equations(layout, records, theta, trajectories, follow=False)
    held = shape_parameters(layout)
    held[layout.common :] = True
    held[list(kept)] = True
    return theta, trajectories, solve(layout, normal, theta, inflate, held)


def shape_parameters(layout: Layout) -> np.ndarray:
    """(p,) True for the logarithms of shape constants."""
    found = np.zeros(layout.size, bool)
    for place in layout.places:
        found[list(place.shapes.values())] = True
    return found


class _Point(NamedTuple):
    theta: np.ndarray
    trajectories: list[Trajectory]


def fit(
    layout: Layout, records: Sequence[Record], start: tuple[np.ndarray, Sequence[Trajectory]] | None = None,
    hopeless: float = np.inf, most: int = MOST_ITERATIONS, refine: Sequence[Stage] = (), held: Sequence[int] = (),
) -> Fit:  # fmt: skip
    """Fit from the measured motion, or from given parameters and trajectories.

    hopeless: cost above which, after LEAST iterations, it is not worth going on; most: iterations, of which FADE's
    stages are some, and further ones are not; refine: stages before the free run, FADE where none are given and the
    fit starts from the measured motion; held: parameters that stay as they start.
    """
    stages = list(refine or (() if start else FADE))
    most += max(len(stages) - len(FADE), 0)
    point = _Point(*(start or equation_error_start(layout, records, held)))
    shapes, stays = shape_parameters(layout), np.isin(np.arange(layout.size), held)
    kept: tuple[_Point, Step] | None = None
    least: tuple[_Point, Step, Normal] | None = None
    halvings, last, iteration, circles = 0, np.inf, 0, 0
    while True:
        iteration += 1
        stage = stages.pop(0) if stages else FREE_RUN
        try:
            normal, equations = normal_equations(layout, records, *point, stage=stage)
            stay = stays | shapes if stage.inflate > 1.0 else stays
            step = solve(layout, normal, point.theta, stage.inflate, stay)
        except LinAlgError:
            step = None
        worse = step is None or (kept is not None and step.before > kept[1].before + 1.0)
        if worse and kept is not None and halvings < MOST_HALVINGS:
            halvings += 1
            point = _between(layout, records, kept[0], point)
            continue
        if step is None:
            return _failed(layout, point, iteration)
        kept = (point, step) if stage == FREE_RUN else None
        halvings = 0
        enough = max(CONVERGED, COARSE * (step.after - 1.3 * normal.samples))
        if stage == FREE_RUN:
            circles = 0 if least is None or step.before < least[1].before - enough else circles + 1
            if least is None or step.before < least[1].before:
                least = point, step, normal
        delta = step.delta * _shorten(step.delta, shapes)
        moved = [
            advance(layout, record, r, point.theta, delta, trajectory, eq)
            for r, (record, trajectory, eq) in enumerate(zip(records, point.trajectories, equations))
        ]
        point = _Point(point.theta + delta, moved)
        change, last = abs(last - step.after) if stage == FREE_RUN else np.inf, step.after
        if stage == FREE_RUN and (change < enough or (iteration >= LEAST and step.after - change > hopeless)):
            break
        if circles >= CIRCLES or iteration >= most:
            break
    cost = step.after
    if least is not None and not 0.0 <= cost <= least[1].before:
        # it went astray at a kink of the forces; or so far that nothing but rounding is left of the cost
        (point, _, normal), cost = least, least[1].before
    cost += normal.grown
    try:
        covariance, log_determinant = _posterior(normal.matrix + layout.prior.precision)
    except LinAlgError:
        return _failed(layout, point, iteration)
    evidence = -0.5 * cost - 0.5 * log_determinant + 0.5 * log_prior(layout)
    return Fit(layout, point.theta, covariance, tuple(point.trajectories), cost, evidence, iteration)


def _failed(layout: Layout, point: _Point, iteration: int) -> Fit:
    """A simulation that diverges, whatever is tried: infinitely unlikely."""
    unknown = np.full_like(layout.prior.precision, np.nan)
    return Fit(layout, point.theta, unknown, tuple(point.trajectories), np.inf, -np.inf, iteration)


def _shorten(delta: np.ndarray, shapes: np.ndarray) -> float:
    longest = float(np.abs(delta[shapes]).max(initial=0.0))
    return min(1.0, LONGEST_SHAPE_STEP / longest) if longest > 0.0 else 1.0


def _between(layout: Layout, records: Sequence[Record], good: _Point, bad: _Point) -> _Point:
    """Half way back."""
    theta = good.theta + 0.5 * (bad.theta - good.theta)
    moved = []
    for r, (record, old, new) in enumerate(zip(records, good.trajectories, bad.trajectories)):
        a = np.where(np.isfinite(new.a), 0.5 * (old.a + new.a), old.a)
        moved.append(motion_of(layout, record, r, theta, a))
    return _Point(theta, moved)


def _posterior(matrix: np.ndarray) -> tuple[np.ndarray, float]:
    """Covariance (p, p) and the logarithm of the precision's determinant.

    A parameter held at its limit counts like any other: it was free to be elsewhere.
    """
    scale = 1.0 / np.sqrt(np.diagonal(matrix))
    factor = _cholesky(matrix * np.outer(scale, scale))[0]
    inner = solve_triangular(factor, np.eye(len(factor)), lower=True, check_finite=False)
    log_determinant = 2.0 * float(np.log(np.diagonal(factor)).sum() - np.log(scale).sum())
    return (inner.T @ inner) * np.outer(scale, scale), log_determinant


def log_prior(layout: Layout) -> float:
    """Logarithm of the determinant of the prior's precision, and what limits add: half a normal is twice as dense."""
    prior = layout.prior
    scale = 1.0 / np.sqrt(np.diagonal(prior.precision))
    value = float(np.linalg.slogdet(prior.precision * np.outer(scale, scale))[1] - 2.0 * np.log(scale).sum())
    return value + 2.0 * np.log(2.0) * np.count_nonzero((prior.low == 0.0) & (prior.mean == 0.0))
