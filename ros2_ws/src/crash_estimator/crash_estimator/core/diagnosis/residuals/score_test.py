"""Whether what a model leaves hangs on time: no effect of the vocabulary does, so that none of them explains it.

A mass that grows, a push at some instant, an element that breaks, a sensor that turns: two effects of the vocabulary
can together come so close to one of these that their residual is white in every band. A score test (Rao 1948) looks
where it would show. For each free body, each element and each output let

    its mass be m (1 + s(t)),   a force s(t) push it,   its force be F (1 + s(t)),   its sensor show (1 + s(t)) a,

s(t) = sum of c_j cos(j pi t / T), j = 1 ... MODES; one of these at a time. With the whitened outputs' derivative D by
the c_j, J by the model's parameters, whose prior has the precision L about mu, their residual r, and H = J'J + L, where
all c_j are zero

    u = D'r - D'J H^-1 (J'r - L (theta - mu)),   S = D'D - D'J H^-1 J'D,   u' S^-1 u has chi^2 of MODES.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, cho_solve
from scipy.special import chdtrc

from ..mechanics.linearization import Equations, linearise
from ..mechanics.outputs import predicted
from ..observation.grid import binned
from ..observation.trajectory import Trajectory
from ..output_error.gauss_newton import Fit, solve
from ..output_error.normal_equations import Normal, may_diverge, nothing_yet, whitened
from ..parameterization.layout import FREE, Experiment
from .band_test import of_any

MODES = 6
"""Of time: the last one's half period is a sixth of the record, what rises faster shows in the bands of `band_test`."""

SIGNIFICANT = 1e-5
"""Probability that a right model fails anywhere, were all linear and every curve a draw from its prior. As they are not
quite, one in a hundred right models came below 0.001 (developed on simulated cases); what mimics a growing mass is
mostly beyond 1e-6."""

TOLD = 0.01
"""Share of a direction that the model's parameters must leave: the little that they leave of others, a curve's prior
decides, which is no more than a good guess."""

TOLD_APART = 12.0
"""Difference of u' S^-1 u: six nats, as much as a candidate gains that counts as found (`Thresholds.gain`)."""

MOST_NAMED = 3
"""Things that may vary and are named: the line says where to look, and more is no hint."""


class Drift(NamedTuple):
    """What the residual goes along with most, of all that may vary with time."""

    constant: bool  # nothing varies significantly
    probability: float  # that a right model looks as bad, over all that was looked at
    what: str  # in words; several things where they cannot be told apart
    share: float  # of the residual's square above that of noise, that it takes away


def cosine(j: np.ndarray | int, longest: float, time: np.ndarray) -> np.ndarray:
    """cos(j pi t / T); longest, time: T and t, s."""
    return np.cos(np.pi * j * (time / longest))


def drift_of(fitted: Fit) -> Drift:
    """The test of one fit, in the noise of its records."""
    layout = fitted.layout
    free = np.array([k for k, kind in enumerate(layout.kind) if kind == FREE], int)  # none where all are driven
    names = [f"the mass of {layout.bodies[k]}" for k in free]
    names += [f"a force on {layout.bodies[k]}" for k in free]
    names += [f"the stiffness of {link.name}" for link in layout.links]
    names += [f"the gain of {output.channel}" for output in layout.outputs]
    normal = _normal_equations(fitted, free)
    try:
        score, information = _marginal(fitted, normal)
    except LinAlgError:  # a motion without bounds: nothing can be said of it
        return Drift(True, 1.0, names[0], 0.0)
    blocks = [slice(first, first + MODES) for first in range(0, len(score), MODES)]
    found = [(*_statistic(score[b], information[b, b]), name) for b, name in zip(blocks, names)]
    square, freedom, _ = max(found)
    least = min(float(chdtrc(f, s)) for s, f, _ in found)
    probability = of_any(least, len(found))
    alike = [name for s, _, name in sorted(found, reverse=True) if s > square - TOLD_APART][:MOST_NAMED]
    share = (square - freedom) / max(normal.cost - normal.samples, 1.0)
    return Drift(probability > SIGNIFICANT, probability, " or ".join(alike), float(np.clip(share, 0.0, 1.0)))


def _marginal(fitted: Fit, normal: Normal) -> tuple[np.ndarray, np.ndarray]:
    """u and S of all directions, each direction scaled to length one."""
    layout, p = fitted.layout, fitted.layout.size
    step = solve(layout, normal._replace(matrix=normal.matrix[:p, :p], vector=normal.vector[:p]), fitted.theta)
    inside, scale = np.flatnonzero(step.free), step.scale[step.free]
    size = np.sqrt(np.maximum(np.diagonal(normal.matrix)[p:], np.finfo(float).tiny))
    cross = normal.matrix[inside, p:] * scale[:, None] / size
    solved = cho_solve(step.factor, cross, check_finite=False)
    pull = normal.vector[:p] - layout.prior.precision @ (fitted.theta - layout.prior.mean)
    score = normal.vector[p:] / size - solved.T @ (pull[inside] * scale)
    return score, normal.matrix[p:, p:] / np.outer(size, size) - cross.T @ solved


def _statistic(score: np.ndarray, information: np.ndarray) -> tuple[float, int]:
    """u' S^-1 u and its degrees of freedom: of directions that the model's parameters leave."""
    values, vectors = np.linalg.eigh(information)
    told = values > TOLD
    return float(((vectors.T @ score)[told] ** 2 / values[told]).sum()), max(int(np.count_nonzero(told)), 1)


@may_diverge
def _normal_equations(fitted: Fit, free: np.ndarray) -> Normal:
    """The fit's own, and after its parameters the directions of `drift_of`, in its order."""
    layout = fitted.layout
    size = layout.size + (2 * len(free) + len(layout.links) + len(layout.outputs)) * MODES
    found = nothing_yet(size)
    longest = max(float(record.time[-1]) for record in fitted.problem.records)
    for experiment, trajectory in zip(fitted.problem.experiments, fitted.trajectories, strict=True):
        modes = cosine(np.arange(1, MODES + 1), longest, experiment.record.time[:, None])
        equations = linearise(experiment, fitted.theta, trajectory)
        equations = _with_motion(equations, _accelerated(equations, free), modes.T, layout.size)
        out = whitened(experiment, fitted.theta, trajectory, equations, in_time=False)
        out = np.concatenate([out, _of_sensors(experiment, fitted.theta, trajectory, equations, modes)], axis=2)
        columns = np.concatenate([equations.columns, size + np.arange(-len(layout.outputs) * MODES, 0)])
        found = found.with_more(columns, out)
    return found


def _accelerated(equations: Equations, free: np.ndarray) -> list[dict[int, np.ndarray]]:
    """What each mass, each force on a body and each element accelerates, where s is one: (g,) by body; of a fixed one
    the force on it."""
    rows, inverse = equations.rows, equations.linear.inverse_mass
    masses = [{k: -rows[:, k]} for k in free]
    forces = [{k: np.full(len(rows), np.abs(rows[:, k]).max())} for k in free]
    pairs = zip(equations.linear.ends.tolist(), equations.links, strict=True)
    elements = [{a: -inverse[a] * link.force, b: inverse[b] * link.force} for (a, b), link in pairs]
    return [*masses, *forces, *elements]


def _with_motion(
    equations: Equations, accelerated: Sequence[Mapping[int, np.ndarray]], modes: np.ndarray, first: int
) -> Equations:
    """With a column more for each mode (MODES, g) of each of those; first: parameter of the first such column."""
    linear, others = equations.linear, equations.linear.others
    more = np.arange(len(accelerated) * MODES)
    acting = [(n, body, values) for n, bodies in enumerate(accelerated) for body, values in bodies.items()]
    wider = linear._replace(
        start=np.pad(linear.start, ((0, 0), (0, 0), (0, len(more)))),
        others=others + len(more),
        column=np.concatenate([linear.column, *(others + more[n * MODES :][:MODES] for n, _, _ in acting)]),
        body=np.concatenate([linear.body, np.repeat([body for _, body, _ in acting], MODES)]),
        acts=np.concatenate([linear.acts, *(values * modes for _, _, values in acting)]),
    )
    return equations._replace(linear=wider, columns=np.insert(equations.columns, others - 1, first + more))


def _of_sensors(
    experiment: Experiment, theta: np.ndarray, trajectory: Trajectory, equations: Equations, modes: np.ndarray
) -> np.ndarray:
    """(bins, q, q MODES) whitened derivative of the outputs by their gains' modes."""
    record = experiment.record
    shown = predicted(experiment, theta, equations.rows, trajectory)
    q = shown.shape[1]
    found = np.zeros((record.bins, q, q, MODES))
    for n in range(q):
        column = (equations.sampling.weight[:, n] * shown[:, n])[:, None] * modes
        found[:, n, n] = binned(record.bin, column, record.bins)
    return record.whitened(found.reshape(record.bins, q, -1), in_time=False)
