"""How a fit ends, and what its residuals are counted by, on the short record of the oracles."""

from dataclasses import replace
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import LinAlgError
from test_diagnosis_oracles import PLATE, STRIKER, problem_of, structure
from test_diagnosis_oracles_in_short import short_record

from crash_estimator.core.diagnosis.mechanics.linearization import _steps, linearise
from crash_estimator.core.diagnosis.mechanics.masses import masses
from crash_estimator.core.diagnosis.mechanics.outputs import output_noise
from crash_estimator.core.diagnosis.observation.noise_inflation import with_inflated_noise
from crash_estimator.core.diagnosis.observation.record import observe
from crash_estimator.core.diagnosis.output_error import gauss_newton
from crash_estimator.core.diagnosis.output_error.gauss_newton import _half_way_back, fit
from crash_estimator.core.diagnosis.output_error.problem import make_problem
from crash_estimator.core.diagnosis.output_error.simulation import simulate
from crash_estimator.core.diagnosis.parameterization.magnitudes import measure_magnitudes
from crash_estimator.core.diagnosis.residuals.residuals import _absorbed, analyse
from crash_estimator.core.diagnosis.residuals.score_test import MODES, _accelerated, _with_motion
from crash_estimator.core.diagnosis.selection.score_screening import screen
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.effect import Addition
from crash_estimator.core.effects.kinds.element_force import ElementForce
from crash_estimator.core.structure import Coefficient, EffectSpec
from crash_replay.recording import Channel, Recording

RATE = 2500.0
"""Hz: each sample is a bin."""


@pytest.fixture(scope="module")
def recording() -> Recording:
    """From 160 ms before the impact."""
    return short_record(RATE, 400, 200, seed=2, speed=6.0)


@pytest.mark.parametrize("below", [np.inf, 500.0])
def test_the_true_model_leaves_a_mean_square_of_one_in_whatever_band_it_is_compared(recording, below):
    """In units of the noise, of the coefficients that are compared."""
    model = structure()
    record = observe(model, recording)
    records = [record if below == np.inf else record.in_band(below)]
    problem = make_problem(measure_magnitudes(model, records, 12), records, ())
    assert analyse(fit(problem)).mean_square == pytest.approx(1.0, abs=0.2)


def test_a_fit_ends_after_its_last_step_where_that_is_better(recording):
    """One iteration from a damper that is twice too strong takes most of the error away."""
    problem, _ = problem_of(structure(EffectSpec("viscous_damping", "foam", 0.0)), recording)
    term = problem.layout.terms[0].coefficient
    theta = problem.layout.start.copy()
    theta[term] += 300.0
    start = simulate(problem, theta, problem.measured(theta).trajectories)
    settled, once = fit(problem, start), fit(problem, start, most=1)
    assert abs(once.theta[term] - settled.theta[term]) < 0.1 * abs(theta[term] - settled.theta[term])
    assert once.theta[term] != theta[term]


def test_a_fit_begins_as_its_problem_does_where_no_forces_can_be_fitted_along_the_measured_motion(
    recording, monkeypatch
):
    problem, _ = problem_of(structure(EffectSpec("viscous_damping", "foam", 200.0)), recording)
    nothing_finite = gauss_newton.equation_error(problem, problem.measured(problem.layout.start))
    nothing_finite = nothing_finite._replace(matrix=np.full_like(nothing_finite.matrix, np.nan))
    monkeypatch.setattr(gauss_newton, "equation_error", lambda problem, point: nothing_finite)
    start = gauss_newton.equation_error_start(problem)
    assert_allclose(start.theta, problem.layout.start, rtol=0.0)
    assert fit(problem).cost < np.inf


def test_a_step_after_which_nothing_is_finite_is_halved_until_a_thirty_second_is_left(recording, monkeypatch):
    problem, _ = problem_of(structure(EffectSpec("viscous_damping", "foam", 0.0)), recording)
    term = problem.layout.terms[0].coefficient
    theta = problem.layout.start.copy()
    theta[term] += 300.0
    start = simulate(problem, theta, problem.measured(theta).trajectories)
    asked, of_the_start = [], gauss_newton.normal_equations

    def only_at_the_start(problem, point, stage):
        asked.append(point.theta[term])
        if len(asked) > 1:
            raise LinAlgError
        return of_the_start(problem, point, stage)

    monkeypatch.setattr(gauss_newton, "normal_equations", only_at_the_start)
    assert fit(problem, start).cost == np.inf
    way = np.array(asked[1:]) - asked[0]
    assert_allclose(way / way[0], [1.0, 1 / 2, 1 / 4, 1 / 8, 1 / 16, 1 / 32])


@pytest.mark.parametrize("dt", [(0.0, 2e-4), (0.0, 2e-4, 1e-4)])
def test_the_first_instant_stands_for_as_long_a_step_as_the_next(dt):
    assert_allclose(_steps(SimpleNamespace(dt=np.array(dt))), [2e-4, *dt[1:]] if len(dt) == 2 else 2e-4)


@pytest.mark.parametrize(
    ("stiffness", "unloading", "sought"),
    [
        (Coefficient(1e5, estimated=True, shape="curve"), None, False),  # the curve contains it
        (Coefficient(1e5, estimated=True, shape="curve"), 4e5, True),  # not where it unloads
        (Coefficient(1e5, estimated=True, shape="constant"), None, True),
        (Coefficient(1e5, shape="constant"), None, True),
        (Coefficient(1e5, shape="curve"), None, True),  # known: a curve that no fit is free to bend
    ],
)
def test_a_force_of_the_crush_alone_is_sought_where_no_free_curve_contains_it(stiffness, unloading, sought):
    effect = ElementForce("bump", "N", force=lambda motion: motion.crush**2, size=1.0, of_crush_only=True)
    element = SimpleNamespace(name="spring", stiffness=stiffness, unloading=unloading, unloads=unloading is not None)
    magnitudes = SimpleNamespace(strained_elements=lambda: [element], element=lambda name: 0)
    assert bool(list(effect.candidates(SimpleNamespace(), magnitudes))) == sought


@pytest.mark.parametrize("delay", [1.0e-4, 2.5e-4, 5.0e-4])
def test_the_noise_of_a_measured_inertia_grows_with_its_mass_and_its_channel_s_delay(recording, delay):
    """As its derivative says; a sample lasts 0.4 ms, of which a delay takes a part."""
    channels = (*recording.test.channels, Channel("box_ax", "acceleration", "box", "x"))
    values = np.column_stack([recording.values, 1.02 * recording.values[:, 1]])
    with_box = Recording(replace(recording.test, channels=channels), recording.time_ns, values)
    late = EffectSpec("channel_delay", "plate_ax", delay)
    box = EffectSpec("unmodelled_body", "box_ax", 30.0, host="plate")
    problem, _ = problem_of(structure(late, box), with_box)
    (experiment,), theta = problem.experiments, problem.layout.start
    growth = output_noise(experiment, theta).growth
    assert {p for _, p, _ in growth} == {term.coefficient for term in problem.layout.terms}
    for q, parameter, slope in growth:
        step = 1e-4 * theta[parameter] * (np.arange(len(theta)) == parameter)
        up, down = (np.log(output_noise(experiment, theta + s * step).std[q]) for s in (1.0, -1.0))
        assert slope == pytest.approx((up - down) / (2.0 * step[parameter]), rel=1e-5)


def test_what_a_fit_has_absorbed_is_looked_at_in_bins_of_its_record(recording):
    problem, _ = problem_of(structure(EffectSpec("viscous_damping", "foam", 0.0)), recording)
    fitted = fit(problem)
    (experiment,) = problem.experiments
    equations = linearise(experiment, fitted.theta, fitted.trajectories[0])
    for one in _absorbed(fitted, experiment, equations):
        assert len(one.residual) * one.period == pytest.approx(experiment.record.time[-1], rel=1e-9)


def test_what_is_left_in_one_band_counts_as_noise_as_strong_as_it_is_there(recording):
    """A cosine at 69 Hz in the first output's bins of 4 ms: of the 20 frequencies 10 lie with it, from 60 to 125 Hz."""
    record, size = observe(structure(), recording), 30.0
    nothing = np.zeros_like(record.measured)
    (as_binned,) = with_inflated_noise([record], [nothing])
    bins, at = as_binned.bins, as_binned.bin[record.at]
    assert bins == 20
    z = size * np.cos(np.pi * 11 * (np.arange(bins) + 0.5) / bins)
    left = nothing.copy()
    left[:, 0] = z[at] * record.noise[0] / np.sqrt(np.bincount(at, minlength=bins))[at]
    (found,) = with_inflated_noise([record], [left])
    variance = np.linalg.inv(found.whitener.T @ found.whitener)
    assert_allclose(
        variance, np.diag([1.0 + np.sum(z**2) / 10, 1.0, 1.0]), rtol=0.01, atol=1e-6
    )  # the last bin is not full


def test_a_body_without_a_mass_counts_as_1_kg(recording):
    """Of a fixed one the equation is its force's."""
    problem, _ = problem_of(structure(EffectSpec("added_mass", "plate", 8.0)), recording)
    assert_allclose(masses(problem.layout, problem.layout.start), [STRIKER, PLATE + 8.0, 1.0])


def test_what_an_effect_gains_by_the_screening_is_what_its_fit_gains_where_it_acts_linearly(recording):
    """A damper on the mount, which never parts: the evidence of the model with it, less that of the one without, which
    knows all but 20 of the mount's 900 N s/m."""
    whole = structure()
    foam, mount = whole.elements
    model = replace(whole, elements=(foam, replace(mount, damping=Coefficient(880.0))))
    records = [observe(model, recording)]
    magnitudes = measure_magnitudes(model, records, 12)
    damper = Addition(EFFECTS["viscous_damping"], "mount")
    without, with_it = (fit(make_problem(magnitudes, records, found)) for found in ((), (damper,)))
    (screened,) = screen(magnitudes, records, (), [damper], fitted=without)
    (term,) = with_it.layout.terms
    assert screened.gain == pytest.approx(with_it.evidence - without.evidence, abs=0.1)
    assert screened.coefficient == pytest.approx(with_it.theta[term.coefficient], rel=0.02, abs=0.5)
    assert screened.std == pytest.approx(np.sqrt(with_it.covariance[term.coefficient, term.coefficient]), rel=0.02)


class Columns(NamedTuple):
    """Of the linearised equations what directions are put beside."""

    start: np.ndarray
    others: int
    column: np.ndarray
    body: np.ndarray
    acts: np.ndarray
    ends: np.ndarray
    inverse_mass: np.ndarray


class Rows(NamedTuple):
    linear: Columns
    rows: np.ndarray
    columns: np.ndarray
    links: list[SimpleNamespace]


def test_directions_of_masses_forces_and_elements_stand_after_the_parameters_and_before_the_knots():
    """Two parameters and two knots; each mode once for the free body's mass, once for the force on it, and once for the
    element before it, which pushes both its ends."""
    force, row = np.array([0.0, 6.0, 4.0, 2.0]), np.array([1.0, -3.0, 2.0, 0.0])
    linear = Columns(
        np.ones((2, 2, 3)), 3, np.array([0, 1]), np.array([0, 1]), np.zeros((2, 4)), np.array([[0, 1]]),
        np.array([0.5, 1.0]),
    )  # fmt: skip
    links = [SimpleNamespace(force=force)]
    equations = Rows(linear, np.stack([row, np.full(4, 9.0)], axis=1), np.array([0, 1, 30, 31]), links)
    modes = np.cos(np.pi * np.arange(1, MODES + 1)[:, None] * (np.arange(4) / 4.0))
    found = _with_motion(equations, _accelerated(equations, [0]), modes, first=40)
    assert found.columns.tolist() == [0, 1, *range(40, 40 + 3 * MODES), 30, 31]
    assert found.linear.others == 3 + 3 * MODES
    assert found.linear.start.tolist() == [[[1.0] * 3 + [0.0] * 3 * MODES] * 2] * 2  # they change no body's start
    element = range(3 + 2 * MODES, 3 + 3 * MODES)
    assert found.linear.column.tolist() == [0, 1, *range(3, 3 + 3 * MODES), *element]
    assert found.linear.body.tolist() == [0, 1] + [0] * 3 * MODES + [1] * MODES
    acts = found.linear.acts[2:].reshape(4, MODES, 4)
    assert_allclose(acts, [-row * modes, 3.0 * modes, -0.5 * force * modes, force * modes])


def test_half_way_back_is_half_of_each_acceleration(recording):
    """Where the other one is finite; what is not stays as it was."""
    problem, good = problem_of(structure(EffectSpec("viscous_damping", "foam", 0.0)), recording)
    (trajectory,) = good.trajectories
    far = trajectory.a + 8.0
    far[5, 0] = np.inf
    (found,) = _half_way_back(problem, good, good._replace(trajectories=(trajectory._replace(a=far),))).trajectories
    free = [0, 1]  # striker and plate
    expected = trajectory.a[:, free] + 4.0
    expected[5, 0] -= 4.0
    assert_allclose(found.a[:, free], expected)


@pytest.mark.parametrize(("stated", "estimated"), [
    (Coefficient(5.0e4, shape="constant"), False), (Coefficient(5.0e4, estimated=True, shape="constant"), True),
    (Coefficient(5.0e4, estimated=True), None),
])  # fmt: skip
def test_a_spring_s_stiffness_is_told_as_stated_or_fitted_unless_it_is_a_curve(recording, stated, estimated):
    fitted = fit(problem_of(structure(stiffness=stated), recording)[0])
    if estimated is None:
        assert fitted.constant_stiffness("foam") is None
    elif estimated:
        (parameter,) = [link.constant for link in fitted.layout.links if link.name == "foam"]
        assert fitted.constant_stiffness("foam") == fitted.theta[parameter] != 5.0e4
    else:
        assert fitted.constant_stiffness("foam") == 5.0e4
