"""A free run steps as finely as it must, however far apart its samples are; passes are counted as they are made."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from crash_estimator.core.characteristic import Characteristic
from crash_estimator.core.fold import run
from crash_estimator.core.free_run import free_run
from crash_estimator.core.methods import make_estimator
from crash_estimator.core.passes import Passes
from crash_estimator.core.structure import Body, Coefficient, Element, Structure
from crash_replay.recording import Channel, Recording, Test


def test_a_stiff_spring_sampled_coarsely_keeps_its_motion():
    """Ten samples a period: one step of RK4 for each would lose a percent of the energy within a few periods."""
    w, mass = 2.0 * np.pi * 100.0, 10.0
    time_ns = np.arange(-20, 60, dtype=np.int64) * 1_000_000
    t = np.maximum(time_ns * 1e-9, 0.0)
    a = np.where(time_ns < 0, 0.0, -5.0 * w * np.sin(w * t))
    test = Test("bounce", (Channel("ax", "acceleration"),), initial_velocity={"car": 5.0})
    k = mass * w**2
    structure = Structure(
        "bounce",
        (Body("car", mass, ("ax",)), Body("wall", fixed=True)),
        (Element("spring", ("car", "wall"), Coefficient(k, True, drift=0.0, shape="constant")),),
    )
    estimator = make_estimator(structure, test, "kalman")
    estimates = run(estimator, Recording(test, time_ns, a[:, None]).samples())
    given = (Characteristic("spring", np.array([-1.0, 0.0, 1.0]), np.array([-k, 0.0, k]), None, 0.0, True),)
    found = free_run(structure, estimator.description, estimates, given)
    assert_allclose(found.velocity[:, 0], 5.0 * np.cos(w * found.time), atol=1e-3)


@pytest.mark.parametrize(("moved", "made", "settled"), [((), 1, False), ((0.5,), 2, False), ((0.5, 0.01), 3, True)])
def test_passes_are_counted_as_they_were_made(moved, made, settled):
    passes = Passes(None, [], moved)
    assert passes.as_json() == {"made": made, "moved": moved, "settled": settled}
    assert passes.text.startswith("one pass" if made == 1 else f"{made} passes")


def test_a_force_on_a_free_body_is_taken_where_each_step_is():
    """A mass that a force 400 sin(w t) pushes, sampled ten times a period: v = 400 / (m w) (1 - cos w t)."""
    w, mass = 2.0 * np.pi * 100.0, 10.0
    time_ns = np.arange(-20, 60, dtype=np.int64) * 1_000_000
    t = np.maximum(time_ns * 1e-9, 0.0)
    pushed = 400.0 * np.sin(w * t)
    test = Test("pushed", (Channel("ax", "acceleration"), Channel("motor_fx", "force")))
    structure = Structure(
        "pushed",
        (Body("axis", mass, ("ax",), applied="motor_fx"), Body("frame", fixed=True)),
        (Element("guide", ("axis", "frame"), Coefficient(0.0), Coefficient(1.0, True)),),
    )
    recording = Recording(test, time_ns, np.column_stack([pushed / mass, pushed]))
    estimator = make_estimator(structure, test, "kalman")
    estimates = run(estimator, recording.samples())
    given = (Characteristic("guide", np.array([-1.0, 1.0]), np.zeros(2), None, 0.0, True),)
    found = free_run(structure, estimator.description, estimates, given, recording=recording)
    expected = 400.0 / (mass * w) * (1.0 - np.cos(w * found.time))
    assert_allclose(found.velocity[:, 0], expected, atol=2e-3)
