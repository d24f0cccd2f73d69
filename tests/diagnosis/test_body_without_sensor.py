"""A free body that carries no sensor moves as its momentum says: an engine behind a barrier that feels all force.

Cab and engine hit the barrier; the truth is simulated here by scipy's integrator.
"""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from crash_estimator.core.derived_motion import with_accelerations
from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.diagnosis.observation.record import observe
from crash_estimator.core.diagnosis.parameterization.magnitudes import measure_magnitudes
from crash_estimator.core.diagnosis.selection.candidates import candidates
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.fold import run
from crash_estimator.core.free_run import free_run
from crash_estimator.core.kinematics import Kinematics
from crash_estimator.core.methods import make_estimator
from crash_estimator.core.structure import ModelError
from crash_estimator.report_page import write_report
from crash_replay.recording import Channel, Recording, Test

CAR = """
name: car
bodies:
  cab: {mass: 900.0, acceleration: cab_ax}
  engine: {mass: 300.0}
  barrier: {fixed: true, force: barrier_fx}
elements:
  front:
    between: [engine, barrier]
    tension: none
    stiffness: {estimate: true, initial: 5.0e5, shape: constant}
    damping: 4000.0
  mount:
    between: [cab, engine]
    stiffness: {estimate: true, initial: 5.0e5, shape: constant}
"""
CAB, ENGINE, SPEED = 900.0, 300.0, 12.0
FRONT, FRONT_DAMPING, MOUNT, MOUNT_DAMPING = 8.0e5, 4000.0, 1.2e6, 9000.0


def forces(mount_damping: float, push: float = 0.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times (n,) s from the impact on, and N in the front and in the mount."""

    def both(x_cab, x_engine, v_cab, v_engine):
        front = np.where(x_engine > 0.0, np.maximum(FRONT * x_engine + FRONT_DAMPING * v_engine, 0.0), 0.0)
        return front, MOUNT * (x_cab - x_engine) + mount_damping * (v_cab - v_engine)

    def slope(t, state):
        front, mount = both(*state)
        return state[2], state[3], (push - mount) / CAB, (mount - front) / ENGINE

    time = np.arange(0.0, 0.12, 1e-4)
    state = solve_ivp(slope, (0.0, time[-1]), (0.0, 0.0, SPEED, SPEED), "LSODA", time, rtol=1e-9, atol=1e-10).y
    return time, *both(*state)


def crashed(mount_damping: float, seed: int, push: float = 0.0, loud: float = 1.0) -> Recording:
    """120 ms at 10 kHz from 30 ms before the impact: 0.3 g of noise on the cab, 1 kN on the barrier, times `loud`."""
    time, front, mount = forces(mount_damping, push)
    rest = np.zeros((300, 2))
    true = np.concatenate([rest, np.stack([(push - mount) / CAB, front], axis=1)])
    noise = np.random.default_rng(seed).normal(0.0, loud, true.shape) * [0.3 * 9.80665, 1000.0]
    channels = Channel("cab_ax", "acceleration", "cab"), Channel("barrier_fx", "force", "barrier")
    test = Test("car", channels, initial_velocity={"cab": SPEED, "engine": SPEED})
    time_ns = np.rint(np.arange(-300, len(time)) * 1e5).astype(np.int64)
    return Recording(test, time_ns, true + noise)


def test_momentum_says_how_it_moves(model):
    structure, (record,) = with_accelerations(model(CAR), [crashed(0.0, 1, loud=0.0)])
    engine = structure.bodies[structure.body_index["engine"]]
    assert engine.acceleration == ("engine_derived_acceleration",) and engine.derived
    _, front, mount = forces(0.0)
    found = record.column("engine_derived_acceleration")
    assert_allclose(found[record.time_ns >= 0], (mount - front) / ENGINE, atol=1e-6)
    assert_allclose(found[record.time_ns < 0], 0.0, atol=1e-6)


def test_it_gives_no_equation_of_its_own(model):
    structure, _ = with_accelerations(model(CAR), [crashed(0.0, 1)])
    assert [structure.bodies[k].name for k in structure.equations] == ["cab", "barrier"]


@pytest.mark.parametrize("method", ["mrls", "constrained_kalman"])
def test_estimators_find_the_stiffness_behind_it(model, method):
    structure, (record,) = with_accelerations(model(CAR), [crashed(0.0, 2)])
    estimator = make_estimator(structure, record.test, method)
    estimates = run(estimator, record.samples())
    found = dict(zip(estimator.description.parameters, estimates[-1].parameters, strict=True))
    assert found["mount.stiffness"] == pytest.approx(MOUNT, rel=0.05)
    simulated = free_run(structure, estimator.description, estimates, recording=record)
    errors = simulated.measured[:, 0] - simulated.predicted[:, 0]
    assert np.std(errors) < 0.2 * np.std(simulated.measured[:, 0])


def test_no_masses_are_found_from_a_motion_that_they_gave(model):
    structure, (record,) = with_accelerations(model(CAR), [crashed(0.0, 2)])
    with pytest.raises(ModelError, match="body engine has no acceleration channel"):
        make_estimator(structure, record.test, "effective_mass")


def test_an_effect_whose_force_nobody_measured_is_refused(model):
    pushed = CAR + "effects:\n  - {type: constant_force, body: cab, coefficient: 100.0}\n"
    structure, (record,) = with_accelerations(model(pushed), [crashed(0.0, 2)])
    with pytest.raises(ModelError, match="the force of cab.constant_force on cab is not measured"):
        make_estimator(structure, record.test, "mrls")


def test_a_report_says_why_it_does_not_estimate_what_was_found(model, tmp_path):
    page = write_report(crashed(0.0, 9, push=3.0e4), model(CAR), ["mrls"], tmp_path / "page", markdown=True)
    said = page.with_suffix(".md").read_text()
    assert "constant_force on cab" in said and "follows is of the model as given, without what was found: " in said


def test_a_damper_that_its_mount_lacks_is_named(model):
    found = diagnose(model(CAR), [crashed(MOUNT_DAMPING, 3), crashed(MOUNT_DAMPING, 4)])
    assert (found.verdict, found.complete) == ("effect_missing", True), found.text
    assert [(step.effect, step.target) for step in found.steps] == [("viscous_damping", "mount")]
    assert found.steps[0].coefficient == pytest.approx(MOUNT_DAMPING, rel=0.05)


def test_with_nothing_missing_nothing_is_named(model):
    found = diagnose(model(CAR), [crashed(0.0, 5), crashed(0.0, 6)])
    assert (found.verdict, found.complete) == ("adequate", True), found.text


def test_a_spring_that_nothing_but_a_damper_stands_for_is_named(model):
    mount = CAR.index("    between: [cab, engine]")
    damper = "    between: [cab, engine]\n    stiffness: 0.0\n    damping: {estimate: true, initial: 9.0}\n"
    found = diagnose(model(CAR[:mount] + damper), [crashed(MOUNT_DAMPING, 7), crashed(MOUNT_DAMPING, 8)])
    assert found.verdict == "effect_missing", found.text
    assert (found.steps[0].effect, found.steps[0].target) == ("load_path", "cab-engine")
    assert found.steps[0].coefficient == pytest.approx(MOUNT, rel=0.05)


@pytest.mark.parametrize(
    "changed, lacks",
    [
        (("force: barrier_fx", ""), r"the force on barrier is not measured \(`force: CHANNEL`\)"),
        ((", acceleration: cab_ax", ""), "engine has none either"),
        (("between: [engine, barrier]", "between: [cab, barrier]"), "no element leads to it"),
    ],
)
def test_what_momentum_lacks_is_said(model, changed, lacks):
    text = CAR.replace(*changed)
    if "no element" in lacks:
        text = text.replace("[cab, engine]", "[cab, barrier]")
    with pytest.raises(ModelError, match="names no channel for its motion, and momentum does not say it: .*" + lacks):
        model(text)


@pytest.mark.parametrize(("of", "offered"), [("engine", False), ("gearbox", True)])
def test_a_channel_of_its_own_that_the_model_does_not_use_makes_no_second_body_of_it(model, of, offered):
    one = crashed(0.0, 1)
    channel = Channel("further_ax", "acceleration", of, axis="x")
    channels = (*(replace(each, axis="x") for each in one.test.channels), channel)
    values = np.column_stack([one.values, one.values[:, 0]])
    recording = Recording(replace(one.test, channels=channels), one.time_ns, values)
    structure, recordings = with_accelerations(model(CAR), [recording])
    magnitudes = measure_magnitudes(structure, [observe(structure, each) for each in recordings])
    found = {one.key for one in candidates(magnitudes, EFFECTS)}
    assert (("unmodelled_body", "further_ax") in found) == offered


def test_sample_by_sample_it_is_refused(model):
    with pytest.raises(ModelError, match="body engine of model car has no sensor.*acceleration channel is needed"):
        Kinematics(model(CAR), crashed(0.0, 1).test)
