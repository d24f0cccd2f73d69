"""Free bodies that a measured force pushes, observed by their displacement: an axis with dry friction, an oscillator.

The truth is simulated here: friction that sticks (Karnopp), in small steps, and an oscillator by scipy's integrator.
"""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.signal import TransferFunction, lsim

from crash_estimator.core.derived_motion import smoothed, with_accelerations
from crash_estimator.core.diagnosis import diagnose, predict
from crash_estimator.core.diagnosis.mechanics.linearization import linearise
from crash_estimator.core.diagnosis.mechanics.outputs import predicted
from crash_estimator.core.diagnosis.observation.grid import binned
from crash_estimator.core.diagnosis.observation.record import observe
from crash_estimator.core.diagnosis.output_error.normal_equations import whitened
from crash_estimator.core.diagnosis.output_error.problem import make_problem
from crash_estimator.core.diagnosis.output_error.simulation import simulate
from crash_estimator.core.diagnosis.parameterization.magnitudes import measure_magnitudes
from crash_estimator.core.diagnosis.selection import onset_search
from crash_estimator.core.diagnosis.selection.time_zero import Shift
from crash_estimator.core.fold import run
from crash_estimator.core.free_run import free_run
from crash_estimator.core.kinematics import Kinematics
from crash_estimator.core.methods import make_estimator
from crash_estimator.core.structure import ModelError
from crash_replay.recording import Channel, Recording, Test

AXIS = """
name: axis
bodies:
  axis: {mass: 40.0, applied: motor_fx, displacement: axis_x}
  frame: {fixed: true}
elements:
  guide: {between: [axis, frame], stiffness: 0.0, damping: {estimate: true, initial: 10.0, min: 0.0}}
"""
OSCILLATOR = """
name: oscillator
bodies:
  mass: {mass: 2.0, applied: shaker_fx, displacement: mass_x}
  ground: {fixed: true}
elements:
  spring:
    between: [mass, ground]
    stiffness: {estimate: true, initial: 1000.0, shape: constant}
    damping: {estimate: true, initial: 1.0, min: 0.0}
"""
BY_ACCELERATION = OSCILLATOR.replace("displacement: mass_x", "acceleration: mass_ax")
FRICTION, CUBIC, STIFFNESS, DAMPING = 12.0, 4.0e5, 3000.0, 6.0


def recording(name: str, time: np.ndarray, **channels: tuple[str, np.ndarray]) -> Recording:
    listed = tuple(Channel(key, quantity) for key, (quantity, _) in channels.items())
    values = np.stack([values for _, values in channels.values()], axis=1)
    return Recording(Test(name, listed), np.rint(time * 1e9).astype(np.int64), values)


def pushed_axis(friction: float, pulses: float = 0.0) -> Recording:
    """6 s at 1 kHz, to and fro; an encoder of 1 um steps.

    pulses: N that come twice a second for 50 ms, which a drive passes on with a ringing of its own at 25 Hz.
    """
    fine, mass, damping = 1e-4, 40.0, 80.0
    time = np.arange(0.0, 6.0, fine)
    force = 45.0 * np.sin(2.0 * np.pi * 0.7 * time) + 20.0 * np.sin(2.0 * np.pi * 1.9 * time)
    force += pulses * (np.mod(time, 0.5) > 0.45)
    x, v, shown = 0.0, 0.0, np.empty(len(time))
    for k, push in enumerate(force):
        shown[k] = x
        rest = push - damping * v
        sticks = abs(v) < 1e-4 and abs(rest) <= friction
        v = 0.0 if sticks else v + fine * (rest - friction * np.sign(v or rest)) / mass
        x += fine * v
    noise = np.random.default_rng(11).normal(0.0, 0.3, len(time) // 10)
    if pulses:
        own = 2.0 * np.pi * 25.0
        drive = TransferFunction([1.0 / mass], [1.0, 0.2 * own, own**2])
        shown += lsim(drive, pulses * (np.mod(time, 0.5) > 0.45), time)[1]
    measured = np.round(shown[::10] * 1e6) * 1e-6
    return recording("axis", time[::10], axis_x=("displacement", measured), motor_fx=("force", force[::10] + noise))


def shaken(cubic: float, acceleration: bool = False, until: float = 5.0, seed: int = 5) -> Recording:
    """At 500 Hz of an oscillator at 6 Hz, shaken from 2 to 12 Hz."""
    time = np.arange(0.0, until, 2e-3)
    rng = np.random.default_rng(seed)
    lines = np.arange(2.0, 12.0, 0.25)
    force = sum(np.cos(2.0 * np.pi * (f * time + rng.random())) for f in lines) * 6.0
    at = CubicSpline(time, force)

    def slope(t, state):
        x, v = state
        return v, (at(t) - STIFFNESS * x - DAMPING * v - cubic * x**3) / 2.0

    x, v = solve_ivp(slope, (0.0, time[-1]), (0.0, 0.0), "DOP853", time, rtol=1e-9, atol=1e-12).y
    if acceleration:
        shown = ("acceleration", slope(time, (x, v))[1] + rng.normal(0.0, 0.05, len(x)))
        return recording("shaken", time, mass_ax=shown, shaker_fx=("force", force))
    shown = ("displacement", x + rng.normal(0.0, 2e-5, len(x)))
    return recording("shaken", time, mass_x=shown, shaker_fx=("force", force))


@pytest.mark.parametrize("pulses", [0.0, 20.0])
def test_dry_friction_of_an_axis_that_a_motor_pushes_is_named(model, pulses):
    """Though of all that is sampled what its drive rings with after pulses is more of the misfit than friction."""
    found = diagnose(model(AXIS), [pushed_axis(FRICTION, pulses)])
    assert found.verdict == "effect_missing", found.text
    first = found.steps[0]
    assert (first.effect, first.target) == ("coulomb_friction", "guide")
    assert first.coefficient == pytest.approx(FRICTION, rel=0.05)


def test_an_axis_that_runs_away_without_a_force_that_holds_it_lacks_something(model):
    """Its motor works against 8 N that the model lacks: the acceleration tells next to nothing of it, and at the speed
    that the model settles at the axis leaves all that it was seen to move by."""
    held = pushed_axis(0.0)
    held.values[:, held.test.index("motor_fx")] += 8.0
    found = diagnose(model(AXIS), [held])
    assert (found.verdict, found.complete) == ("unexplained", False)
    assert found.left.astray == ["axis_x"] and "axis_x runs away" in found.text
    assert diagnose(model(AXIS), [pushed_axis(0.0)]).verdict == "adequate"


@pytest.mark.parametrize(
    ("thrown", "sought"), [("{mass: 40.0, acceleration: block_ax}", True), ("{fixed: true}", False)]
)
def test_no_onset_is_sought_where_measured_forces_push_all_free_bodies(model, monkeypatch, thrown, sought):
    structure = model(AXIS.replace("  frame:", f"  block: {thrown}\n  frame:"))
    onset = Shift(0, "axis", 5e-3, 1e-4, 1e-4)
    monkeypatch.setattr(onset_search, "onsets", lambda recordings: (onset,))
    monkeypatch.setattr(onset_search._Search, "as_stated", [SimpleNamespace(onset_early=0.0)])
    assert onset_search._Search(structure, (), {}).begins == ((onset,) if sought else ())


def test_a_cubic_spring_of_a_shaken_body_is_named(model):
    found = diagnose(model(OSCILLATOR), [shaken(CUBIC)])
    assert found.verdict == "effect_missing", found.text
    first = found.steps[0]
    assert (first.effect, first.target) == ("cubic_stiffness", "spring")
    assert first.coefficient == pytest.approx(CUBIC, rel=0.05)
    other = shaken(CUBIC, seed=6)
    told = predict(found, other)
    assert told.channels == ("mass_x",)
    assert told.error(after=2.0)[0] < 0.02 * np.std(other.column("mass_x")), "of a recording that it was not fitted to"


def test_a_linear_one_lacks_nothing(model):
    found = diagnose(model(OSCILLATOR), [shaken(0.0)])
    assert found.verdict == "adequate", found.text


@pytest.mark.parametrize("method", ["rls", "mrls", "kalman", "constrained_kalman"])
def test_estimators_know_the_applied_force(model, method):
    """Over 1.5 s: what accelerations leave of a displacement, integrated twice, drifts off after that."""
    structure, record = model(BY_ACCELERATION), shaken(0.0, acceleration=True, until=1.5)
    estimator = make_estimator(structure, record.test, method)
    estimates = run(estimator, record.samples())
    found = dict(zip(estimator.description.parameters, estimates[-1].parameters))
    assert found["spring.stiffness"] == pytest.approx(STIFFNESS, rel=0.05)
    with pytest.raises(ModelError, match="pushed by shaker_fx: a free run needs the recording"):
        free_run(structure, estimator.description, estimates)
    simulated = free_run(structure, estimator.description, estimates, recording=record)
    errors = simulated.measured[:, 0] - simulated.predicted[:, 0]
    assert np.std(errors) < 0.2 * np.std(simulated.measured[:, 0])


@pytest.mark.parametrize("observed", ["displacement: mass_x", "velocity: mass_v"])
def test_the_derivatives_of_motion_outputs_are_their_finite_differences(model, observed):
    """By the stiffness, the damping, the sensor's zero and the velocity that the body starts with."""
    record = shaken(0.0, until=1.0)
    if "mass_v" in observed:
        v = np.gradient(record.column("mass_x"), record.time)
        record = recording(
            "shaken", record.time, mass_v=("velocity", v), shaker_fx=("force", record.column("shaker_fx"))
        )
    structure, (record,) = with_accelerations(model(OSCILLATOR.replace("displacement: mass_x", observed)), [record])
    observed_record = observe(structure, record)
    problem = make_problem(measure_magnitudes(structure, [observed_record], 12), [observed_record], ())
    theta = problem.layout.start.copy()
    theta[:2] = STIFFNESS, DAMPING
    point = simulate(problem, theta, problem.measured(theta).trajectories)
    (experiment,), motion = problem.experiments, point.trajectories[0]
    equations = linearise(experiment, theta, motion)
    found = whitened(experiment, theta, motion, equations)[:, 0, 1:]
    for parameter in range(problem.layout.size):
        step = 1e-4 * max(abs(theta[parameter]), 1e-2)
        moved = []
        for sign in (1.0, -1.0):
            other = theta.copy()
            other[parameter] += sign * step
            there = simulate(problem, other, point.trajectories).trajectories[0]
            rows = linearise(experiment, other, there).rows
            moved.append(predicted(experiment, other, rows, there))
        slope = equations.sampling.weight * (moved[0] - moved[1]) / (2.0 * step)
        expected = binned(observed_record.bin, slope, observed_record.bins)[:, 0]
        column = found[:, list(equations.columns).index(parameter)]
        assert np.linalg.norm(expected) > 0.0
        assert np.linalg.norm(column - expected) < 0.01 * np.linalg.norm(expected), parameter


def test_sample_by_sample_a_displacement_alone_is_refused(model):
    with pytest.raises(ModelError, match="body axis of model axis is observed by axis_x alone.*acceleration channel"):
        Kinematics(model(AXIS), pushed_axis(0.0).test)


def test_the_whole_recording_gives_the_acceleration(model):
    structure, (record,) = with_accelerations(model(AXIS), [pushed_axis(0.0)])
    assert structure.bodies[0].acceleration == ("axis_x_derived_acceleration",) and structure.bodies[0].derived
    force, a = record.column("motor_fx"), record.column("axis_x_derived_acceleration")
    v = np.cumsum(a) * 1e-3
    assert_allclose(a[100:-100], ((force - 80.0 * v) / 40.0)[100:-100], atol=0.06)


def test_a_derivative_follows_what_moves_and_leaves_the_noise():
    time = np.arange(0.0, 2.0, 1e-3)
    rng = np.random.default_rng(3)
    found = smoothed(np.sin(10.0 * time) + rng.normal(0.0, 1e-4, len(time)), 1e-3)
    inner = slice(70, -70)
    assert np.std((found.value - np.sin(10.0 * time))[inner]) < 5e-5
    assert np.std((found.first - 10.0 * np.cos(10.0 * time))[inner]) < 0.05
    assert np.std((found.second + 100.0 * np.sin(10.0 * time))[inner]) < 3.0


@pytest.mark.parametrize(
    "channel, valid, said",
    [
        ("axis_x", 0, "axis_x has no valid sample"),
        ("motor_fx", 0, "motor_fx has no valid sample"),
        ("motor_fx", 5, "needs two valid samples"),  # means over some of them, of which the first is none
    ],
)
def test_a_channel_without_samples_is_one_line(model, channel, valid, said):
    record = pushed_axis(0.0)
    record.values[valid:, record.test.index(channel)] = np.nan
    with pytest.raises(ModelError, match=said) as caught:
        diagnose(model(AXIS), [record])
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "body, said",
    [
        ("{fixed: true, applied: motor_fx}", "`applied` belongs to a free body"),
        ("{motion: axis_ax, displacement: axis_x}", "`displacement` belongs to a free body"),
        ("{mass: 40.0, acceleration: axis_ax, force: motor_fx}", "call it `applied` where it pushes a free body"),
    ],
)
def test_which_bodies_take_which_channels_is_said(model, body, said):
    with pytest.raises(Exception, match=said):
        model(AXIS.replace("{mass: 40.0, applied: motor_fx, displacement: axis_x}", body))


def test_a_force_whose_zero_a_short_rest_tells_is_not_taken_for_another_force(model):
    """Its 20 samples at rest say the zero to 0.007 N, which pushes the axis by more than the noise of its velocity."""
    rng, mass, damping, rest = np.random.default_rng(8), 40.0, 80.0, 20
    time = np.arange(-rest, 2000) * 1e-3
    force = np.where(time >= 0.0, 30.0 * np.sin(2.0 * np.pi * 1.1 * time), 0.0)
    at = CubicSpline(time, force)
    way = solve_ivp(
        lambda t, v: (at(t) - damping * v) / mass, (0.0, time[-1]), [0.0], "DOP853", time[rest:], rtol=1e-9, atol=1e-12
    )
    velocity = np.concatenate([np.zeros(rest), way.y[0]]) + rng.normal(0.0, 1e-4, len(time))
    noise = rng.normal(0.0, 0.03, len(time))
    noise[:rest] += 0.0134 - noise[:rest].mean()  # two standard deviations of that mean
    given = recording("axis", time, axis_v=("velocity", velocity), motor_fx=("force", force + noise))
    found = diagnose(model(AXIS.replace("displacement: axis_x", "velocity: axis_v")), [given])

    assert found.verdict == "adequate", found.text
    assert all(one.evidence < 6.0 for one in found.ranking if one.effect == "constant_force")
