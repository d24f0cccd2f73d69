"""An effect is added to a running estimator, and taken out again: it goes on as if the model had always been so."""

import numpy as np
import pytest
from crash_msgs.srv import AddEffect, RemoveEffect
from helpers_estimation import oscillator_recording
from helpers_estimator_node import UNDAMPED, joined
from numpy.testing import assert_array_equal
from rclpy.parameter import Parameter

from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.change import add_effect
from crash_estimator.core.effects.user import load_effects
from crash_estimator.core.fold import run
from crash_estimator.core.methods import make_estimator
from crash_estimator.core.structure import ModelError
from crash_estimator.model_file import load_model
from crash_estimator.nodes.estimator_node import EstimatorNode
from crash_replay.recording import Recording

OWN = '''
"""A force with the third power of the rate."""
from crash_estimator.core.effects.base import ElementForce

EFFECT = ElementForce("cubic_damping", "N*s^3/m^3", force=lambda motion: motion.rate**3)
'''


@pytest.fixture
def model(tmp_path) -> str:
    path = tmp_path / "oscillator.yaml"
    path.write_text(UNDAMPED)
    return str(path)


@pytest.fixture(scope="module")
def recording() -> Recording:
    """Of a body with a damper that the model has not got."""
    return oscillator_recording(noise=0.5, n=300)


def from_the_start(structure, recording: Recording, **settings) -> list:
    return run(make_estimator(structure, recording.test, "constrained_kalman", **settings), recording.samples())


def assert_is(messages, estimates) -> None:
    """Parameters as the one loop gives them with this model, from the first of the messages on."""
    name, first = messages[0].name, messages[0].number
    count = sum(len(message.time_ns) for message in messages)
    expected = np.array([e.parameters for e in estimates])[first : first + count]
    assert {tuple(message.name) for message in messages} == {tuple(name)}
    assert_array_equal(joined(messages, "value"), expected)


def test_added_and_removed_while_samples_come(stage, model, recording):
    stage.add_estimator(model=model)
    stage.send_test(recording)
    stage.send(recording, 0, 150, block=10)
    stage.wait_for("estimator", 15)
    added = stage.call(AddEffect, "estimator/add_effect", effect="viscous_damping", target="spring")
    assert added.success and added.message.startswith(
        "revision 1: oscillator with viscous_damping on spring; 150 samples estimated again"
    )
    stage.send(recording, 150, 250, block=10)
    stage.wait_for("estimator", 25)
    removed = stage.call(RemoveEffect, "estimator/remove_effect", effect="viscous_damping", target="spring")
    assert removed.message == "revision 2: oscillator with no effect; 250 samples estimated again"
    stage.send(recording, 250, len(recording), block=10)
    heard = stage.wait_for("estimator", 35)

    for topic in ("parameters", "residuals", "forces"):
        revisions = [(message.number, message.revision) for message in heard[topic]]
        assert revisions == [(n, (n >= 150) + (n >= 250)) for n in range(0, len(recording), 10)]
    assert list(heard["parameters"][20].name) == ["spring.stiffness", "spring.damping", "spring.viscous_damping"]
    value, std = (getattr(heard["parameters"][24], field)[-1] for field in ("value", "std"))
    assert abs(value - 50.0) < 3.0 * std, "the damper that the recording's body had is found"
    plain = load_model(model)
    with_it = add_effect(plain, "viscous_damping", "spring")
    assert_is(heard["parameters"][:15], from_the_start(plain, recording))
    assert_is(heard["parameters"][15:25], from_the_start(with_it, recording))
    assert_is(heard["parameters"][25:], from_the_start(plain, recording))
    told = [(event.number, event.value, event.text) for event in heard["events"] if event.kind == "effect"]
    assert told == [(150, 1.0, added.message), (250, 2.0, removed.message)]
    states = {state.revision: list(state.effects) for state in heard["state"]}
    assert states == {0: [], 1: ["viscous_damping on spring"], 2: []}
    assert all((state.holds_from, state.missed) == (0, 0) for state in heard["state"])


def test_a_mass_without_a_sensor_is_hung_on_a_body_while_samples_come(stage, model, recording):
    stage.add_estimator(model=model)
    stage.send_test(recording)
    stage.send(recording, 0, 150, block=10)
    stage.wait_for("estimator", 15)
    hung = {"effect": "unmodelled_body", "target": "block"}
    refused = stage.call(AddEffect, "estimator/add_effect", **hung, options=["form=hung"])
    assert not refused.success and "needs its frequency, in Hz" in refused.message
    options = ["form=hung", "coefficient=2", "frequency=20", "damping=0.1"]
    assert stage.call(AddEffect, "estimator/add_effect", **hung, options=options).success
    stage.send(recording, 150, len(recording), block=10)
    heard = stage.wait_for("estimator", 30)
    shape = {"frequency": 20.0, "damping": 0.1}
    structure = add_effect(load_model(model), "unmodelled_body", "block", coefficient=2.0, shape=shape, variant="hung")
    assert_is(heard["parameters"][15:], from_the_start(structure, recording))


def test_what_cannot_be_done_is_said_in_one_line_and_changes_nothing(stage, model, recording):
    stage.add_estimator(model=model)
    stage.send_test(recording)
    stage.send(recording, 0, 100, block=10)
    stage.wait_for("estimator", 10)

    def refused(kind, **request) -> str:
        service = "add_effect" if kind is AddEffect else "remove_effect"
        response = stage.call(kind, f"estimator/{service}", **request)
        assert not response.success and "\n" not in response.message
        return response.message

    assert "'viscous_damping'" in refused(AddEffect, effect="viscous_dampin", target="spring")
    assert "sprung" in refused(AddEffect, effect="viscous_damping", target="sprung")
    assert "'speed'" in refused(AddEffect, effect="coulomb_friction", target="spring", options=["speed"])
    assert "no effect viscous_damping on spring" in refused(RemoveEffect, effect="viscous_damping", target="spring")
    assert stage.call(AddEffect, "estimator/add_effect", effect="viscous_damping", target="spring").success
    assert "already" in refused(AddEffect, effect="viscous_damping", target="spring")
    stage.send(recording, 100, 110, block=10)
    heard = stage.wait_for("estimator", 11)
    assert heard["parameters"][-1].revision == 1


def test_before_there_is_a_test_it_is_the_model_to_begin_with(stage, model, recording):
    stage.add_estimator(model=model)
    response = stage.call(AddEffect, "estimator/add_effect", effect="viscous_damping", target="spring")
    assert response.message == "revision 1: oscillator with viscous_damping on spring"
    stage.send_test(recording)
    stage.send(recording, block=50)
    heard = stage.wait_for("estimator", 7)
    structure = add_effect(load_model(model), "viscous_damping", "spring")
    assert_is(heard["parameters"], from_the_start(structure, recording))


def test_ones_own_effect_from_a_file(stage, model, recording, tmp_path):
    own = tmp_path / "own.py"
    own.write_text(OWN)
    stage.add_estimator(model=model, effects=str(own))
    stage.send_test(recording)
    stage.send(recording, 0, 100, block=50)
    stage.wait_for("estimator", 2)
    response = stage.call(AddEffect, "estimator/add_effect", effect="cubic_damping", target="spring")
    assert response.success, response.message
    stage.send(recording, 100, len(recording), block=50)
    heard = stage.wait_for("estimator", 7)
    table = EFFECTS | load_effects(own)
    structure = add_effect(load_model(model), "cubic_damping", "spring", table)
    assert list(heard["parameters"][-1].name) == ["spring.stiffness", "spring.damping", "spring.cubic_damping"]
    assert_is(heard["parameters"][2:], from_the_start(structure, recording, effects=table))


def test_a_file_without_an_effect_ends_the_node_with_one_line(stage, model, tmp_path):
    empty = tmp_path / "empty.py"
    empty.write_text("")
    with pytest.raises(ModelError, match="empty.py defines no effect"):
        EstimatorNode(parameter_overrides=[Parameter("model", value=model), Parameter("effects", value=str(empty))])
