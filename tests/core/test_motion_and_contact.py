"""Integration of the measured motion, and the loading / unloading / apart logic of the elements."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from crash_estimator.core.contact import Contact
from crash_estimator.core.estimate import ElementState
from crash_estimator.core.fold import run
from crash_estimator.core.kinematics import Kinematics
from crash_estimator.core.methods import make_estimator
from crash_estimator.core.structure import Body, Coefficient, Element, ModelError, Structure
from crash_replay.recording import Channel, Recording, RecordingError, Sample, Test

V0 = 12.0


def wall_structure(tension=True, unloading=None, channels=("car_ax",), stiffness=Coefficient(1e5)):
    return Structure(
        "wall",
        (Body("car", 1000.0, channels), Body("barrier", fixed=True, force="barrier_fx")),
        (Element("front", ("car", "barrier"), stiffness, tension=tension, unloading=unloading),),
    )


def wall_test(*names):
    accelerometers = tuple(Channel(name, "acceleration", "car", "x") for name in names or ("car_ax",))
    channels = (*accelerometers, Channel("barrier_fx", "force", "barrier", "x"))
    return Test("wall", channels, initial_velocity={"car": V0}, initial_displacement={"car": -0.02})


def motions(recording, structure):
    kinematics = Kinematics(structure, recording.test)
    state, found = kinematics.init(), []
    for sample in recording.samples():
        state, motion = kinematics.step(state, sample)
        found.append(motion)
    return found


def test_a_linear_acceleration_is_integrated_exactly_and_the_offset_removed():
    time_ns = np.arange(-100, 500, dtype=np.int64) * 100_000
    t = time_ns * 1e-9
    offset, slope = 3.0, -400.0
    acceleration = offset + np.where(t > 0, slope * t, 0.0)
    recording = Recording(wall_test(), time_ns, np.column_stack([acceleration, np.zeros_like(t)]))
    last = motions(recording, wall_structure())[-1]
    assert_allclose(last.velocity[0], V0 + slope * t[-1] ** 2 / 2, rtol=1e-12)
    assert_allclose(last.displacement[0], -0.02 + V0 * t[-1] + slope * t[-1] ** 3 / 6, rtol=1e-12)
    assert_allclose(last.crush, last.displacement[:1])


def test_before_the_impact_the_body_moves_at_its_initial_velocity():
    time_ns = np.array([-2_000_000, -1_000_000, 0], dtype=np.int64)
    recording = Recording(wall_test(), time_ns, np.zeros((3, 2)))
    found = motions(recording, wall_structure())
    assert_allclose([m.displacement[0] for m in found], [-0.02 - 0.002 * V0, -0.02 - 0.001 * V0, -0.02])
    assert_allclose([m.velocity[0] for m in found], V0)


def test_the_step_of_time_comes_from_the_stamps():
    time_ns = np.array([0, 1_000_000, 1_500_000, 4_000_000], dtype=np.int64)
    recording = Recording(wall_test(), time_ns, np.full((4, 2), -50.0) * [1, 0])
    last = motions(recording, wall_structure())[-1]
    assert_allclose(last.velocity[0], V0 - 50.0 * 4e-3, rtol=1e-12)
    assert_allclose(last.displacement[0], -0.02 + V0 * 4e-3 - 25.0 * 16e-6, rtol=1e-12)


def test_several_accelerometers_are_averaged_and_one_may_drop_out():
    time_ns = np.arange(0, 10, dtype=np.int64) * 1_000_000
    values = np.column_stack([np.full(10, -10.0), np.full(10, -30.0), np.zeros(10)])
    values[5:, 1] = np.nan
    recording = Recording(wall_test("left_ax", "right_ax"), time_ns, values)
    found = motions(recording, wall_structure(channels=("left_ax", "right_ax")))
    assert_allclose([m.acceleration[0] for m in found], [-20.0] * 5 + [-10.0] * 5)


def test_a_missing_or_mismatched_channel_is_named():
    with pytest.raises(RecordingError, match="no channel 'car_ay'.*body car.*car_ax"):
        Kinematics(wall_structure(channels=("car_ay",)), wall_test())
    with pytest.raises(ModelError, match="acceleration.*barrier_fx.*force"):
        Kinematics(wall_structure(channels=("barrier_fx",)), wall_test())


def state_at(contact, crushes, stiffness=1e5):
    """Fold a sequence of crushes (m) -> for each (state, force of the spring)."""
    structure_motion = Kinematics(wall_structure(), wall_test())
    _, motion = structure_motion.step(structure_motion.init(), Sample(0, 0, np.zeros(2)))
    state, last, found = contact.init(), 0.0, []
    for crush in crushes:
        at = motion._replace(crush=np.array([crush]), rate=np.array([crush - last]))
        state, law, _ = contact.step(state, at, np.array([stiffness]))
        found.append((ElementState(state.state[0]), float(stiffness * law.lever[0] + law.shift[0])))
        last = crush
    return found


def test_figure_6_5_loading_unloading_reloading_and_separation():
    contact = Contact(wall_structure(tension=False, unloading=4e5))
    found = state_at(contact, [-0.01, 0.1, 0.2, 0.19, 0.16, 0.14, 0.16, 0.2, 0.21, 0.0])
    apart, loading, unloading = ElementState.APART, ElementState.LOADING, ElementState.UNLOADING
    assert [state for state, _ in found] == [
        apart, loading, loading, unloading, unloading, apart, unloading, loading, loading, apart,
    ]  # fmt: skip
    # 20 kN at 200 mm, down along 400 kN/m, spent at 150 mm, up again along the same line
    assert_allclose([force for _, force in found], [0, 1e4, 2e4, 1.6e4, 4e3, 0, 4e3, 2e4, 2.1e4, 0], atol=1e-9)


def test_an_elastic_element_with_tension_pulls_back():
    found = state_at(Contact(wall_structure()), [0.1, 0.05, -0.05])
    assert [state for state, _ in found] == [ElementState.LOADING, ElementState.UNLOADING, ElementState.UNLOADING]
    assert_allclose([force for _, force in found], [1e4, 5e3, -5e3])


def test_newton_s_third_law_on_body_and_barrier():
    """The same force slows the car down (in m/s^2) and pushes the barrier forward (in N)."""
    structure = wall_structure()
    time_ns = np.arange(0, 50, dtype=np.int64) * 1_000_000
    recording = Recording(wall_test(), time_ns, np.zeros((50, 2)))
    last = run(make_estimator(structure, recording.test, "rls"), recording.samples())[-1]
    assert last.predicted[0] < 0 < last.predicted[1]
    assert_allclose(last.predicted[1], -1000.0 * last.predicted[0], rtol=1e-12)
    assert_allclose(last.force[0], last.predicted[1], rtol=1e-12)


def test_the_rate_of_a_measured_crush_is_its_slope():
    """A crush that is measured grows by 3 m/s, with no channel of its rate: the smoothed slope comes to that."""
    structure = Structure(
        "measured",
        (Body("car", 1000.0, ("car_ax",)), Body("barrier", fixed=True, force="barrier_fx")),
        (Element("front", ("car", "barrier"), Coefficient(1e5), displacement="front_dx"),),
    )
    channels = (*wall_test().channels, Channel("front_dx", "displacement", "car", "x"))
    time_ns = np.arange(0, 200, dtype=np.int64) * 1_000_000
    values = np.zeros((200, 3))
    values[:, 2] = 0.05 + 3.0 * time_ns * 1e-9
    found = motions(Recording(Test("measured", channels), time_ns, values), structure)
    assert_allclose([found[-1].crush[0], found[-1].rate[0]], [values[-1, 2], 3.0], rtol=1e-6)


@pytest.mark.parametrize(("pulls", "expected"), [(True, ElementState.UNLOADING), (False, ElementState.APART)])
def test_a_damper_that_never_pulls_leaves_the_element_apart_where_it_would(pulls, expected):
    """At 0.1 m the spring pushes with 10 kN; coming back at 2 m/s a damper of 8 kN s/m would pull with 16 kN."""
    structure = wall_structure(tension=False)
    (element,) = structure.elements
    contact = Contact(replace(structure, elements=(replace(element, damper_pulls=pulls),)))
    kinematics = Kinematics(structure, wall_test())
    _, motion = kinematics.step(kinematics.init(), Sample(0, 0, np.zeros(2)))
    states, state = [], contact.init()
    for rate in (2.0, -2.0):
        at = motion._replace(crush=np.array([0.1]), rate=np.array([rate]))
        state, _, _ = contact.step(state, at, np.array([1e5]), damping=np.array([8e3]))
        states.append(ElementState(state.state[0]))
    assert states == [ElementState.LOADING, expected]
