"""What is stated or measured wrong: a speed, a load cell's zero, a time zero; and forces that no element carries."""

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.diagnosis.observation.record import observe
from crash_estimator.core.diagnosis.selection.assumptions import as_given
from crash_estimator.core.diagnosis.selection.onset_search import _Search
from crash_estimator.core.diagnosis.selection.time_zero import Shift, TimeZero
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.applied import applied
from crash_estimator.core.effects.effect import Addition
from crash_estimator.core.kinematics import initial_motion
from crash_estimator.core.structure import Body, Coefficient, EffectSpec, Element, ModelError, Structure
from crash_estimator.model_file import load_model
from crash_replay.recording import Channel, Recording, Test
from crash_replay.second_generator.cases import case_of, drawn


def case(name: str) -> tuple[Structure, list[Recording]]:
    """The second simulator's; its development seeds."""
    it = drawn(case_of(name))
    with TemporaryDirectory() as folder:
        path = Path(folder) / "model.yaml"
        path.write_text(it.model_text, encoding="utf-8")
        return load_model(path), it.recordings


def stating(recording: Recording, share: float) -> Recording:
    """With speeds so many times as large as they are."""
    speeds = {body: share * v for body, v in recording.test.initial_velocity.items()}
    return replace(recording, test=replace(recording.test, initial_velocity=speeds))


def later(recording: Recording, seconds: float) -> Recording:
    """With a time zero that is stated late."""
    return replace(recording, time_ns=recording.time_ns - round(seconds * 1e9))


@pytest.mark.parametrize(
    ("name", "striking"),
    [("wall/nothing/1g/clean/71900000", "car"), ("cab/nothing/1g/clean/71900001", "cab")],
)
@pytest.mark.parametrize("share", [1.02, 0.97])
def test_a_speed_that_is_stated_wrong_is_named_with_its_error(name, striking, share):
    """It was named as two channels' gains before."""
    model, recordings = case(name)
    found = diagnose(model, [stating(one, share) for one in recordings])
    assert (found.verdict, found.complete) == ("effect_missing", True), found.text
    (step,) = found.steps
    assert (step.effect, step.target) == ("initial_velocity", striking)
    assert abs(step.coefficient - (1.0 / share - 1.0)) < max(3.0 * step.std, 0.001)


def test_all_bodies_that_start_as_fast_go_with_the_one_that_is_named():
    names = ("cab", "engine", "other")
    bodies = (*(Body(name, 500.0, (f"{name}_ax",)) for name in names), Body("barrier", fixed=True))
    model = Structure("pair", bodies, (), (EffectSpec("initial_velocity", "engine", 0.05),))
    channels = tuple(Channel(f"{name}_ax", "acceleration", name, "x") for name in names)
    test = Test("t", channels, initial_velocity={"cab": 14.0, "engine": 14.0, "other": -10.0})
    assert_allclose(initial_motion(applied(model, test), test)[1], [14.7, 14.7, -10.0, 0.0])
    unknown = replace(model, effects=(EffectSpec("initial_velocity", "engine"),))
    with pytest.raises(ModelError, match="initial_velocity on engine needs its coefficient"):
        applied(unknown, test)


def test_friction_on_the_ground_is_named_without_an_element_for_it():
    """A car with locked wheels: it was told as a gain, or a constant force."""
    found = diagnose(*case("wall/force.guide/1g/clean/71960001"))
    (step,) = found.steps
    assert (found.verdict, found.complete) == ("effect_missing", True)
    assert (step.effect, step.target) == ("guide_friction", "car")


def test_a_part_that_is_reached_on_the_way_is_named_with_its_gap():
    """It led the ranking, and was unexplained: no spring from time zero on follows it."""
    found = diagnose(*case("sled/path.slack/1g/clean/71983002"))
    (step,) = found.steps
    assert (found.verdict, found.complete) == ("effect_missing", True)
    assert (step.effect, step.target, step.form) == ("load_path", "impactor-sled", "late")
    assert step.shape["gap"] > 0.01


def test_what_an_element_to_a_wall_may_carry_is_not_offered_on_the_ground_as_well():
    guide = Element("guide", ("axis", "frame"), Coefficient(0.0, shape="constant"))
    bodies = Body("axis", 95.0, ("axis_ax",)), Body("frame", fixed=True)
    held = Structure("rig", bodies, (guide,))
    assert list(EFFECTS["guide_friction"].candidates(held, None)) == []


def test_what_a_load_cell_behind_an_element_does_not_show_is_offered_on_the_ground():
    """It was told as friction in that element, by which the error of the load cell grew."""
    post = Element("post", ("sled", "frame"), Coefficient(3e5, shape="constant"))
    magnitudes = SimpleNamespace(shape_unit=lambda shape, element: 1.0)
    bodies = Body("sled", 95.0, ("sled_ax",)), Body("frame", fixed=True, force="frame_fx")
    offered = EFFECTS["guide_friction"].candidates(Structure("rig", bodies, (post,)), magnitudes)
    assert [addition.target for addition in offered] == ["sled"]


@pytest.mark.parametrize(("load_cell", "stands_on"), [("wall_fx", "ground_"), (None, "ground")])
def test_a_load_cell_on_what_is_called_ground_feels_nothing_of_a_guide(load_cell, stands_on):
    """A wall of that name had the friction of the car's wheels in its force, and a wrong speed was told."""
    post = Element("post", ("car", "ground"), Coefficient(3e5, shape="constant"))
    bodies = Body("car", 95.0, ("car_ax",)), Body("ground", fixed=True, force=load_cell)
    model = Structure("rig", bodies, (post,), (EffectSpec("guide_friction", "car", 30.0, {"speed": 0.1}),))
    assert applied(model, Test("t", ())).elements[-1].between == ("car", stands_on)
    index = {"car": 0, "ground": 1, "ground_": 2}
    link = EFFECTS["guide_friction"].own_link(Addition(EFFECTS["guide_friction"], "car"), model, index, [])
    assert link.ends == (0, index[stands_on])


def test_a_load_cell_s_zero_is_named_and_not_a_force():
    model, recordings = case("wall/nothing/1g/clean/71900000")
    offset = 0.04 * max(float(np.abs(one.column("barrier_fx")).max()) for one in recordings)

    def jumped(recording: Recording) -> Recording:
        values = recording.values.copy()
        values[recording.time_ns >= 0, recording.test.index("barrier_fx")] += offset
        return replace(recording, values=values)

    found = diagnose(model, list(map(jumped, recordings)))
    (step,) = found.steps
    assert (found.verdict, step.effect, step.target) == ("effect_missing", "force_offset", "barrier_fx")
    assert abs(step.coefficient - offset) < 4.0 * step.std


@pytest.mark.parametrize("name", ["wall/nothing/1g/clean/71900000", "cab/nothing/1g/cfc180/71970008"])
def test_what_moves_before_the_stated_time_zero_is_no_noise(name):
    """Of a time zero that is 4 ms late; noise of all samples before it would be several times as large."""
    model, (recording, _) = case(name)
    right, late = (observe(model, one).noise for one in (recording, later(recording, 0.004)))
    assert np.all(late < 1.3 * right)


def test_quiet_samples_before_a_stated_time_zero_are_no_gain():
    """A mean over 100 samples of a misfit and 20 quiet ones is less than over the misfit alone, whatever the model."""
    time = 1e-3 * np.arange(120)
    record = SimpleNamespace(bins=100, measured=np.zeros((100, 1)), time=time, at=np.arange(120))
    left = np.where(time < 0.0195, 0.01, 1.0)[:, None]
    fitted = SimpleNamespace(layout=SimpleNamespace(outputs=[SimpleNamespace(to_acceleration=1.0)]))
    moved = SimpleNamespace(records=[record], residuals=SimpleNamespace(residual=[left]), fit=fitted)
    as_stated = SimpleNamespace(records=[record], residuals=SimpleNamespace(rms=1.0))
    assert TimeZero((Shift(0, "t", -0.02, 1e-4, 1e-3),), as_stated).gain(moved) == pytest.approx(0.0, abs=1e-9)
    moved.residuals.residual[0] /= np.e
    assert TimeZero((Shift(0, "t", -0.02, 1e-4, 1e-3),), as_stated).gain(moved) == pytest.approx(100.0)


def test_a_model_that_leaves_noise_from_the_stated_time_zero_on_is_not_moved():
    model, recordings = case("side/nothing/1g/clean/71900002")
    shifts = tuple(Shift(k, one.test.id, -0.02, 1e-4, 1e-4) for k, one in enumerate(recordings))
    search = _Search(model, recordings, EFFECTS)
    _, given = as_given(model, search.as_stated, EFFECTS)
    assert given.white and search._begins_early(given, shifts) is None
