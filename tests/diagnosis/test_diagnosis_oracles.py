"""The diagnosis against what owes it nothing: finite differences and scipy's solvers."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares, lsq_linear

from crash_estimator.core.diagnosis.mechanics.linearization import linearise
from crash_estimator.core.diagnosis.mechanics.outputs import predicted
from crash_estimator.core.diagnosis.observation.grid import binned
from crash_estimator.core.diagnosis.observation.record import observe
from crash_estimator.core.diagnosis.output_error.gauss_newton import fit, solve
from crash_estimator.core.diagnosis.output_error.normal_equations import normal_equations, whitened
from crash_estimator.core.diagnosis.output_error.problem import OutputErrorProblem, Point, make_problem
from crash_estimator.core.diagnosis.output_error.simulation import simulate
from crash_estimator.core.diagnosis.parameterization.magnitudes import measure_magnitudes
from crash_estimator.core.diagnosis.parameterization.model_terms import additions_of
from crash_estimator.core.diagnosis.selection.time_zero import Shift, coasting
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.structure import Body, Coefficient, EffectSpec, Element, Structure
from crash_replay.recording import Channel, Recording, Test

STRIKER, PLATE = 100.0, 60.0
"""kg."""
FOAM, MOUNT = (8.0e4, 300.0), (1.5e5, 900.0)
"""N/m and N s/m: between striker and plate, which may part, and between plate and wall."""
SPEED = 6.0
"""m/s: the foam is crushed by some 0.15 m, and the striker thrown back."""
RATE = 10_000.0


def structure(*effects: EffectSpec, stiffness: Coefficient | None = None) -> Structure:
    """A striker against a plate on a mount; the foam's stiffness known unless another one is given."""
    foam = Element(
        "foam", ("striker", "plate"), stiffness or Coefficient(FOAM[0], shape="constant"), Coefficient(FOAM[1]),
        tension=False,
    )  # fmt: skip
    mount = Element("mount", ("plate", "wall"), Coefficient(MOUNT[0], shape="constant"), Coefficient(MOUNT[1]))
    bodies = (
        Body("striker", STRIKER, ("striker_ax",)),
        Body("plate", PLATE, ("plate_ax",)),
        Body("wall", fixed=True, force="wall_fx"),
    )
    return Structure("striker_and_plate", bodies, (foam, mount), effects)


def motion(time: np.ndarray) -> np.ndarray:
    """(n, 5) acceleration of striker and plate, force on the wall, crush and rate of the foam; by scipy."""

    def forces(x1, v1, x2, v2):
        crush, rate = x1 - x2, v1 - v2
        foam = np.where(crush > 0.0, FOAM[0] * crush + FOAM[1] * rate, 0.0)
        return foam, MOUNT[0] * x2 + MOUNT[1] * v2, crush, rate

    def equations(_, y):
        foam, mount, *_ = forces(*y)
        return [y[1], -foam / STRIKER, y[3], (foam - mount) / PLATE]

    found = solve_ivp(equations, (0.0, time[-1]), [0.0, SPEED, 0.0, 0.0], "Radau", time, max_step=2e-5, rtol=1e-9)
    foam, mount, crush, rate = forces(*found.y)
    return np.stack([-foam / STRIKER, (foam - mount) / PLATE, mount, crush, rate], axis=1)


def recorded() -> Recording:
    """The first moves, with a sensor on the plate that no body of the model has."""
    before, after = np.arange(-200, 0), np.arange(0, 900)
    true = motion(after / RATE)[:, :3]
    values = np.concatenate([np.zeros((len(before), 3)), true])
    values = np.column_stack([values, 1.02 * values[:, 1]])
    values += np.random.default_rng(1).normal(size=values.shape) * np.array([2.0, 2.0, 50.0, 2.0])
    channels = (
        Channel("striker_ax", "acceleration", "striker", "x"),
        Channel("plate_ax", "acceleration", "plate", "x"),
        Channel("wall_fx", "force", "wall", "x"),
        Channel("box_ax", "acceleration", "box", "x"),
    )
    time_ns = (np.concatenate([before, after]) * 1e9 / RATE).astype(np.int64)
    return Recording(Test("striker", channels, initial_velocity={"striker": SPEED}), time_ns, values)


@pytest.fixture(scope="module")
def recording() -> Recording:
    return recorded()


EVERY_EFFECT = (
    EffectSpec("viscous_damping", "foam", 200.0),
    EffectSpec("viscous_damping", "foam", 200.0, {"rebound": 0.3}, variant="uneven"),
    EffectSpec("viscous_damping", "foam", 200.0, {"exponent": 1.5}, variant="hunt_crossley"),
    EffectSpec("viscous_damping", "foam", 200.0, {"power": 0.6}, variant="power"),
    EffectSpec("quadratic_damping", "foam", 60.0),
    EffectSpec("quadratic_damping", "foam", 60.0, {"rebound": 0.3}, variant="uneven"),
    EffectSpec("coulomb_friction", "mount", 400.0, {"speed": 0.3}),
    EffectSpec("coulomb_friction", "foam", 400.0, {"speed": 0.3}, variant="sliding"),
    EffectSpec("hysteresis", "foam", 1500.0, {"yield_crush": 0.01, "exponent": 2.0}),
    EffectSpec("hysteresis", "foam", 1500.0, {"yield_crush": 0.01, "exponent": 1.5}, variant="dahl"),
    EffectSpec("maxwell_element", "foam", 2.0e4, {"relaxation_time": 0.01}),
    EffectSpec("gas_cushion", "foam", 900.0, {"length": 0.2, "leak": 30.0}),
    EffectSpec("rate_hardening", "foam", 40.0, {"exponent": 2.0}),
    EffectSpec("rate_hardening", "foam", 40.0, {"reference_rate": 0.5}, variant="logarithmic"),
    EffectSpec("rate_hardening", "foam", 40.0, {"exponent": 2.0, "rebound": 0.6}, variant="uneven"),
    EffectSpec("rate_hardening", "foam", 40.0, {"reference_rate": 0.05, "rebound": 0.6}, variant="uneven_logarithmic"),
    EffectSpec("added_stiffness", "foam", 2.0e4),
    EffectSpec("cubic_stiffness", "foam", 2.0e6),
    EffectSpec("clearance", "foam", 0.02),
    EffectSpec("clearance", "mount", 0.005, variant="play"),
    EffectSpec("bottoming_out", "foam", 8.0e4, {"stop": 0.08}),
    EffectSpec("yielding", "foam", 3.0e4, {"yield_crush": 0.05}),
    EffectSpec("yielding", "foam", 5.0e4, {"yield_crush": 0.05}, variant="plastic"),
    EffectSpec("yielding", "foam", 4.0e4, {"fading_crush": 0.06}, variant="smooth"),
    EffectSpec("plastic_unloading", "foam", 2.5e5),
    EffectSpec("load_path", "striker-wall", 1.0e4),
    EffectSpec("load_path", "striker-wall", 4.0e4, {"gap": 0.08}, variant="late"),
    EffectSpec("added_mass", "plate", 8.0),
    EffectSpec("added_mass", "plate", -2.0),
    EffectSpec("constant_force", "striker", 900.0),
    EffectSpec("constant_force", "striker", 900.0, {"rise": 0.011}, variant="rising"),
    EffectSpec("guide_friction", "striker", 400.0, {"speed": 0.3}),
    EffectSpec("gravity", "striker", 9.8),
    EffectSpec("initial_velocity", "striker", 0.03),
    EffectSpec("unmodelled_body", "box_ax", 6.0, host="plate"),
    EffectSpec("channel_delay", "plate_ax", 2.5e-4),
    EffectSpec("channel_gain", "plate_ax", 0.04),
    EffectSpec("channel_offset", "striker_ax", 5.0),
    EffectSpec("channel_offset", "striker_ax", 5.0, variant="drift"),
    EffectSpec("force_offset", "wall_fx", 300.0),
)


def test_every_effect_of_the_vocabulary_is_looked_at():
    assert {effect.type for effect in EVERY_EFFECT} == set(EFFECTS)


def problem_of(model: Structure, recording: Recording, impact_std: float = 0.0) -> tuple[OutputErrorProblem, Point]:
    """The problem of a model, and its simulation with the coefficients that it states."""
    records = [observe(model, recording)._replace(impact_std=impact_std)]
    magnitudes = measure_magnitudes(model, records, 12)
    problem = make_problem(magnitudes, records, additions_of(magnitudes, EFFECTS))
    start = problem.layout.start
    return problem, simulate(problem, start, problem.measured(start).trajectories)


def outputs(problem: OutputErrorProblem, point: Point) -> np.ndarray:
    """(n, q) at the samples."""
    (experiment,) = problem.experiments
    rows = linearise(experiment, point.theta, point.trajectories[0]).rows
    return predicted(experiment, point.theta, rows, point.trajectories[experiment.index])[experiment.record.at]


def test_the_simulation_is_that_of_an_ode_solver(recording):
    problem, point = problem_of(structure(), recording)
    true = motion(recording.time[recording.time_ns >= 0])[:, :3]
    found = outputs(problem, point)
    assert_allclose(found[1:], true[1:], atol=2e-3 * np.abs(true).max(axis=0).min(), rtol=2e-3)


CUBIC, STOP = EffectSpec("cubic_stiffness", "foam", 2.0e6), EffectSpec("bottoming_out", "foam", 8.0e4, {"stop": 0.08})
YIELDS = EffectSpec("yielding", "foam", 3.0e4, {"yield_crush": 0.05})
ON_A_LINE = [
    *((effect, what) for effect in (CUBIC, STOP) for what in ("springs", "all")),
    *((replace(effect, variant="in_curve"), what) for effect in (CUBIC, STOP, YIELDS) for what in ("nothing", "all")),
    (EffectSpec("yielding", "foam", 4.0e4, {"fading_crush": 0.06}, variant="smooth"), "all"),
    (EVERY_EFFECT[3], "all"),
]
"""Effects on a foam that unloads along a line of its own, and what acts on where it is spent."""


def on_a_line(effect: EffectSpec, what: str) -> Structure:
    """The striker thrown back from the wall itself, by a foam that comes back over a third of its crush."""
    model = structure(effect)
    foam = replace(model.elements[0], between=("striker", "wall"), unloading=4.0e5, acts_when_spent=what)
    return replace(model, bodies=(model.bodies[0], model.bodies[2]), elements=(foam,))


def shown(what) -> str | None:
    return what.type + what.variant if isinstance(what, EffectSpec) else None


NEAR = dict.fromkeys(EFFECTS, 0.03) | {"rate_hardening": 0.1}
"""Share of the derivative's norm: where a contact opens within a step, and, for the power below 1 of rate hardening,
where the rate passes through zero: its slope there is infinite, and a mean over 2 mm/s stands for it."""


@pytest.mark.parametrize("effect", EVERY_EFFECT, ids=shown)
def test_the_derivatives_of_the_outputs_are_their_finite_differences(effect, recording):
    assert_derivatives_agree(structure(effect), recording, NEAR[effect.type])


@pytest.mark.parametrize("effect, what", ON_A_LINE, ids=shown)
def test_so_they_are_where_the_spring_is_spent(effect, what, recording):
    assert_derivatives_agree(on_a_line(effect, what), recording, NEAR[effect.type])


def test_so_they_are_by_a_stiffness_that_is_also_a_line_s_slope(recording):
    open_ = Coefficient(FOAM[0], estimated=True, shape="constant")
    bent = EffectSpec("yielding", "foam", 5.0e4, {"yield_crush": 0.05}, variant="plastic")
    assert_derivatives_agree(structure(bent, stiffness=open_), recording, NEAR["yielding"])


def test_so_they_are_by_when_bodies_touch_that_coast_until_then(recording):
    """Without a damper: a force that jumps would do so at another sample."""
    foam, mount = structure().elements
    model = replace(structure(), elements=(replace(foam, damping=Coefficient(0.0)), mount))
    coasts = coasting(recording, Shift(0, "striker", 0.0, 5e-4, 1e-4))
    problem, point = problem_of(model, coasts, impact_std=5e-4)
    (late,) = problem.layout.late
    assert_derivative_agrees(problem, point, late, 1e-5, 0.03)


def assert_derivatives_agree(model: Structure, recording: Recording, near: float) -> None:
    problem, point = problem_of(model, recording)
    (term,) = problem.layout.terms
    constants = [link.constant for link in problem.layout.links if link.constant is not None]
    for parameter in (term.coefficient, *term.shapes.values(), *constants):
        step = 1e-4 * max(abs(point.theta[parameter]), 1e-6)
        assert_derivative_agrees(problem, point, parameter, step, near)


def assert_derivative_agrees(problem: OutputErrorProblem, point: Point, parameter: int, step: float, near: float):
    (experiment,) = problem.experiments
    equations = linearise(experiment, point.theta, point.trajectories[0])
    by_equations = whitened(experiment, point.theta, point.trajectories[0], equations)[:, :, 1:]
    record, moved = experiment.record, []
    for sign in (1.0, -1.0):
        theta = point.theta.copy()
        theta[parameter] += sign * step
        moved.append(outputs(problem, simulate(problem, theta, point.trajectories)))
    slope = np.zeros((len(record.time), moved[0].shape[1]))
    slope[record.at] = (moved[0] - moved[1]) / (2.0 * step)
    expected = binned(record.bin, equations.sampling.weight * slope, record.bins)
    found = by_equations[:, :, list(equations.columns).index(parameter)]
    assert np.linalg.norm(expected) > 0.0
    assert np.linalg.norm(found - expected) < near * np.linalg.norm(expected), parameter


def test_a_step_is_the_bounded_least_squares_solution(recording):
    """`solve` goes through an active set of its own; scipy's through another."""
    problem, point = problem_of(structure(EffectSpec("viscous_damping", "foam", 200.0)), recording)
    layout = problem.layout
    normal, _ = normal_equations(problem, point)
    term = layout.terms[0]
    tight = layout.prior._replace(
        low=np.where(np.arange(layout.size) == term.coefficient, point.theta - 1.0, layout.prior.low),
    )
    bounded = layout._replace(prior=tight)
    step = solve(bounded, normal, point.theta)
    assert step.delta[term.coefficient] == pytest.approx(-1.0), "the limit binds: else this shows less"
    root = np.linalg.cholesky(normal.matrix + tight.precision + 1e-12 * np.diag(np.diag(tight.precision))).T
    pull = normal.vector - tight.precision @ (point.theta - tight.mean)
    scale = 1.0 / np.sqrt(np.diagonal(normal.matrix + tight.precision))
    limits = (
        np.clip((tight.low - point.theta) / scale, -1e12, None),
        np.clip((tight.high - point.theta) / scale, None, 1e12),
    )
    best = lsq_linear(root * scale, np.linalg.solve(root.T, pull), limits, method="bvls", tol=1e-14)
    assert_allclose(step.delta / scale, best.x, atol=1e-5 * np.abs(best.x).max())


def test_a_fit_ends_where_scipys_least_squares_does(recording):
    """Stiffness of the foam and nuisances: the same posterior mode from another start by another method."""
    model = structure(stiffness=Coefficient(1.0, estimated=True, min=0.0, shape="constant"))
    records = [observe(model, recording)]
    problem = make_problem(measure_magnitudes(model, records, 12), records, ())
    found = fit(problem)
    (experiment,), prior = problem.experiments, problem.layout.prior
    root = np.linalg.cholesky(prior.precision).T
    scale = np.sqrt(np.diagonal(found.covariance))

    def residuals(u: np.ndarray) -> np.ndarray:
        theta = found.theta + scale * u
        point = simulate(problem, theta, found.trajectories)
        left = whitened(experiment, theta, point.trajectories[0], linearise(experiment, theta, point.trajectories[0]))
        return np.concatenate([left[:, :, 0].ravel(), root @ (theta - prior.mean)])

    start = np.full(problem.layout.size, 1.5)
    best = least_squares(residuals, start, x_scale="jac", diff_step=1e-4)
    assert found.cost == pytest.approx(2.0 * best.cost, abs=0.05)
    assert np.abs(best.x).max() < 0.1, "in standard deviations of the fit's own covariance"
