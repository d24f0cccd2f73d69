"""Parameters of running nodes: described as declared, refused where they must not change, followed where they may."""

import pytest
from helpers_diagnosis import Stage as DiagnosisStage
from helpers_diagnosis import hidden_case
from helpers_estimation import oscillator_recording
from helpers_estimator_node import MODEL, joined, offline
from helpers_parameters import TABLES
from numpy.testing import assert_array_equal
from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import DescribeParameters, GetParameters, SetParameters
from rclpy.parameter import Parameter

from crash_estimator.core.diagnosis import ADEQUATE, EFFECT_MISSING, diagnose, tolerance_of
from crash_estimator.nodes.estimator_parameters import settings_of

TYPES = {
    bool: ParameterType.PARAMETER_BOOL, int: ParameterType.PARAMETER_INTEGER, float: ParameterType.PARAMETER_DOUBLE,
    str: ParameterType.PARAMETER_STRING, list: ParameterType.PARAMETER_STRING_ARRAY,
}  # fmt: skip


@pytest.fixture
def model(tmp_path) -> str:
    (tmp_path / "model.yaml").write_text(MODEL)
    return str(tmp_path / "model.yaml")


@pytest.fixture(scope="module")
def diagnosed(tmp_path_factory):
    """A stage with the diagnosis of a case, which has said its final answer; for the last tests of this file, as no
    other stage can be in this process till it has closed."""
    case, structure, recording = hidden_case("side", "viscous_damping", 7204)
    model = tmp_path_factory.mktemp("model") / "side.yaml"
    model.write_text(case.model_text)
    stage = DiagnosisStage()
    stage.add_diagnosis(model=str(model))
    stage.wait_for_listeners()
    stage.send_test(recording)
    stage.send(recording)
    stage.wait_for_finals(1)
    yield stage, structure, recording
    stage.close()


def set_one(stage, node: str, name: str, value):
    """What the node's own service says to it, as `ros2 param set` asks."""
    parameters = [Parameter(name, value=value).to_parameter_msg()]
    service = f"{node}/set_parameters"
    if isinstance(stage, DiagnosisStage):
        return stage.call(service, SetParameters, parameters=parameters).results[0]
    return stage.call(SetParameters, service, parameters=parameters).results[0]


def test_a_running_node_describes_them_as_they_are_declared(stage, model):
    stage.add_estimator("one", model=model, method="mrls")
    table = TABLES["estimator"] | settings_of("mrls")
    described = stage.call(DescribeParameters, "one/describe_parameters", names=list(table)).descriptors
    for allowed, descriptor in zip(table.values(), described, strict=True):
        assert (descriptor.description, descriptor.read_only) == (allowed.meaning, not allowed.live)
        assert descriptor.type == TYPES[type(allowed.default)]
        ranges = [(r.from_value, r.to_value) for r in (*descriptor.floating_point_range, *descriptor.integer_range)]
        assert ranges == ([] if allowed.lowest is None else [(allowed.lowest, allowed.highest)])
    values = stage.call(GetParameters, "one/get_parameters", names=["settings.m", "settings.memory"]).values
    assert [values[0].integer_value, values[1].double_value] == [5, 0.005], "those that the method has"


def test_a_setting_is_changed_for_all_samples(stage, model):
    """What comes then is what a node gives that has had it from the start, to the last bit."""
    recording = oscillator_recording(noise=0.5, n=200)
    stage.add_estimator("one", model=model, method="rls")
    stage.send_test(recording)
    stage.send(recording, 0, 100, block=10)
    stage.wait_for("one", 10)
    assert set_one(stage, "one", "settings.forgetting", 0.9).successful
    stage.send(recording, 100, 200, block=10)
    heard = stage.wait_for("one", 20)["parameters"]
    for messages, first, settings in ((heard[:10], 0, {}), (heard[10:], 100, {"forgetting": 0.9})):
        whole = [e.parameters for e in offline(model, recording, "rls", **settings)]
        assert_array_equal(joined(messages, "value"), whole[first : first + 100])
    assert [messages.revision for messages in heard] == 10 * [0] + 10 * [1]


@pytest.mark.parametrize(
    ("name", "value", "why"),
    [
        ("method", "rls", "read-only"),
        ("model", "side_dummy", "read-only"),
        ("settings.forgetting", 1.5, "out of range"),
        ("settings.m", 5.5, ""),
        ("settings.models", 5, ""),
        ("good_enough", "5%", ""),
    ],
)
def test_what_cannot_be_set_is_refused_and_changes_nothing(stage, model, name, value, why):
    node = stage.add_estimator("one", model=model, method="rls")
    before = node.model
    said = set_one(stage, "one", name, value)
    assert not said.successful and said.reason and why in said.reason
    assert node.model is before


def test_what_is_good_enough_is_judged_once_more(diagnosed):
    stage, structure, recording = diagnosed
    assert stage.finals()[0].verdict == EFFECT_MISSING
    left = diagnose(structure, [recording]).left_before.of_peak
    # a number is taken as the text that it is
    asked = [(f"{110 * left:.1f}%", ADEQUATE), (f"{90 * left:.1f}%", EFFECT_MISSING), (0.999, EFFECT_MISSING)]
    for said, (value, verdict) in enumerate(asked, 1):
        assert set_one(stage, "diagnosis", "good_enough", value).successful
        final = stage.wait_for_finals(said + 1)
        expected = diagnose(structure, [recording], tolerance=tolerance_of(str(value)))
        assert (final.verdict, final.text) == (expected.verdict, expected.text) and final.verdict == verdict
    wrong = set_one(stage, "diagnosis", "good_enough", "150%")
    assert not wrong.successful and "what is good enough is a rating from 0 to 1" in wrong.reason


def test_a_time_limit_holds_for_the_next_final_answer(diagnosed):
    stage, *_ = diagnosed
    before = stage.finals()
    assert not any("stopped after" in final.text for final in before)
    assert set_one(stage, "diagnosis", "time_limit", 0.001).successful
    assert "stopped after 0.001 s" in stage.wait_for_finals(len(before) + 1).text


def test_every_is_followed_and_asks_nothing_again(diagnosed):
    stage, *_ = diagnosed
    before = len(stage.finals())
    assert set_one(stage, "diagnosis", "every", 0.01).successful
    stage.spin(1.0)
    assert stage.diagnoses[0].wanted.every_ns == 10_000_000 and len(stage.finals()) == before
