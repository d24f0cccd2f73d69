"""side_full and the two models it is split into (figures 6.3, 6.4a, 6.4b) say the same about the same sample."""

import numpy as np
from numpy.testing import assert_allclose

from crash_estimator.core.fold import run
from crash_estimator.core.methods import make_estimator
from crash_estimator.model_file import load_model
from crash_replay.recording import Channel, Recording, Test

CHANNELS = ("mdb_ay", "door_upper_ay", "door_lower_ay", "car_ay", "rib_ay", "pelvis_ay", "spine_ay")


def collision(n=300):
    """Seven smooth accelerations; what they are does not matter here."""
    time_ns = np.arange(-50, n, dtype=np.int64) * 100_000
    t = np.maximum(time_ns * 1e-9, 0.0)[:, None]
    a = np.array([-150, 600, 700, 90, 400, 350, 300.0]) * np.sin(np.array([60, 90, 95, 50, 110, 120, 80]) * t)
    test = Test(
        "collision",
        tuple(Channel(name, "acceleration") for name in CHANNELS),
        initial_velocity={"mdb": 14.0},
        initial_displacement={"door_upper": -0.01, "door_lower": -0.02, "mdb": -0.05},
    )
    return Recording(test, time_ns, a)


def steps(model, recording, **settings):
    structure = load_model(model)
    estimator = make_estimator(structure, recording.test, "constrained_kalman", compiled=False, **settings)
    return structure, estimator, run(estimator, recording.samples())


def test_each_half_has_its_equations_and_elements_of_the_whole():
    whole, structure, dummy = (load_model(name) for name in ("side_full", "side_structure", "side_dummy"))
    elements = {e.name: e for e in whole.elements}
    for half in (structure, dummy):
        for element in half.elements:
            assert elements[element.name].between == element.between
            assert elements[element.name].tension == element.tension
            assert elements[element.name].unloading == element.unloading
    assert len(whole.elements) == len(structure.elements) + len(dummy.elements)
    equations = [whole.bodies[k].name for k in whole.equations]
    assert equations == ["mdb", "door_upper", "door_lower", "car", "rib", "pelvis", "spine"]
    masses = {body.name: body.mass for body in whole.bodies}
    assert all(masses[body.name] == body.mass for body in dummy.bodies if body.free)


def test_the_dummys_half_moves_and_carries_as_in_the_whole():
    """The same crush, rate and state of its elements, whether the doors are driven or free bodies of the model."""
    recording = collision()
    whole, _, all_of_it = steps("side_full", recording)
    dummy, _, half = steps("side_dummy", recording)
    names = [element.name for element in whole.elements]
    index = [names.index(element.name) for element in dummy.elements]
    for a, b in zip(all_of_it, half):
        assert_allclose(b.crush, a.crush[index], atol=1e-12)
        assert_allclose(b.rate, a.rate[index], atol=1e-12)
    assert any(event.kind == "loading" and event.target == "door_rib" for e in half for event in e.events)


def test_all_methods_follow_the_whole_model():
    recording = collision(n=100)
    for method in ("rls", "mrls", "kalman", "constrained_kalman", "gauss_newton", "afmm"):
        estimator = make_estimator(load_model("side_full"), recording.test, method)
        last = run(estimator, recording.samples())[-1]
        assert np.isfinite(last.parameters).all() and np.isfinite(last.covariance).all(), method
        assert len(last.parameters) == 18 and len(last.predicted) == 7
