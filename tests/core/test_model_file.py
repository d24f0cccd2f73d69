"""Model files: the ready models, and one clear line for every mistake."""

import pytest

from crash_estimator.core.structure import ModelError
from crash_estimator.model_file import load_model
from crash_estimator.ready_models import ready_models
from crash_replay.recording import RecordingError

GOOD = """\
name: two_mass
bodies:
  cab: {mass: 1300, acceleration: [cab_left_ax, cab_right_ax]}
  engine: {mass: 400, acceleration: engine_ax}
  barrier: {fixed: true, force: barrier_fx}
elements:
  cab_barrier:
    between: [cab, barrier]
    stiffness: {estimate: true, initial: 4.0e5, min: 0.0}
    damping: 1000
  engine_barrier:
    between: [engine, barrier]
    stiffness: {estimate: true, shape: constant}
    tension: none
    unloading: 6e5
  cab_engine:
    between: [cab, engine]
    stiffness: 2e6
"""


def load(tmp_path, text):
    path = tmp_path / "model.yaml"
    path.write_text(text)
    return load_model(path)


def test_the_ready_models_are_those_of_the_design():
    expected = {"frontal_single", "frontal_engine_cab", "side_mdb_door_car", "side_dummy", "impactor_single"}
    assert expected <= set(ready_models())
    for name in ready_models():
        assert load_model(name).name == name


def test_a_file_becomes_a_structure(tmp_path):
    structure = load(tmp_path, GOOD)
    cab, engine, barrier = structure.bodies
    assert cab.acceleration == ("cab_left_ax", "cab_right_ax") and cab.free and cab.mass == 1300
    assert barrier.fixed and barrier.force == "barrier_fx"
    first, second, third = structure.elements
    assert first.stiffness.estimated and first.stiffness.min == 0.0 and first.damping.value == 1000
    assert not second.tension and second.unloading == 6e5 and second.stiffness.shape == "constant"
    assert not third.stiffness.estimated and third.stiffness.value == 2e6 and third.tension
    assert [structure.bodies[k].name for k in structure.equations] == ["cab", "engine", "barrier"]
    assert structure.equation_units == ("m/s^2", "m/s^2", "N")


MISTAKES = {
    "a misspelt key": ("    damping: 1000", "    dampign: 1000", r"model.yaml:10: .*'dampign'.*'damping'"),
    "a misspelt key inside": ("initial: 4.0e5, min", "initail: 4.0e5, min", r"model.yaml:9: .*'initail'.*'initial'"),
    "a text for a number": ("stiffness: 2e6", "stiffness: stiff", r"model.yaml:18: .*stiffness"),
    "known and estimated": ("estimate: true, shape", "estimate: true, value: 3, shape", r"model.yaml:13: .*not both"),
    "a value outside its bounds": (
        "initial: 4.0e5, min: 0.0",
        "initial: -1, min: 0.0",
        r"model.yaml:9: .*min <= initial",
    ),
    "a body that is not there": ("[engine, barrier]", "[engin, barrier]", r"no body 'engin'; did you mean 'engine'"),
    "an element onto itself": (
        "[cab, engine]",
        "[cab, cab]",
        r"model.yaml:16.*two different bodies|two different bodies",
    ),
    "a free body without mass": ("{mass: 400, ", "{", r"body engine is free and needs a mass"),
    "a negative mass": ("mass: 400", "mass: -4", r"model.yaml:4: .*mass"),
    "not a number": ("stiffness: 2e6", "stiffness: .nan", r"model.yaml:18: .*stiffness"),
    "an unknown choice": ("tension: none", "tension: nome", r"model.yaml:14: .*tension"),
    "code": ("stiffness: 2e6", "stiffness: !!python/object/apply:os.system [ls]", r"model.yaml"),
    "broken YAML": ("bodies:", "bodies: [", r"model.yaml:\d+: not valid YAML"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_gets_one_line_with_the_place_and_the_remedy(tmp_path, mistake):
    right, wrong, message = MISTAKES[mistake]
    assert right in GOOD
    with pytest.raises((ModelError, RecordingError), match=message) as caught:
        load(tmp_path, GOOD.replace(right, wrong, 1))
    assert "\n" not in str(caught.value)


def test_an_unknown_ready_model_names_the_nearest(tmp_path):
    with pytest.raises(ModelError, match="did you mean 'side_dummy'"):
        load_model("side_dumy")
    with pytest.raises((ModelError, RecordingError), match="missing.yaml"):
        load_model(tmp_path / "missing.yaml")
