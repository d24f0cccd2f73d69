"""Samples that were missed are asked of the replay; one that gives none holds up nothing for long."""

import pytest
from crash_msgs.srv import GetSamples
from helpers_estimation import oscillator_recording
from helpers_estimator_node import MODEL, TIME_ZERO, Stage
from numpy.testing import assert_array_equal

from crash_replay.ros_messages import samples_to_msg


@pytest.fixture
def stage(tmp_path):
    (tmp_path / "oscillator.yaml").write_text(MODEL)
    stage = Stage()
    stage.add_estimator(model=str(tmp_path / "oscillator.yaml"), method="mrls")
    yield stage
    stage.close()


@pytest.fixture(scope="module")
def recording():
    return oscillator_recording(noise=5.0, n=200)


def lost(stage) -> list[tuple[int, str]]:
    return [(event.number, event.text) for event in stage.heard["estimator"]["events"] if event.kind == "lost"]


def test_what_comes_meanwhile_waits_and_pieces_are_asked_for_one_by_one(stage, recording):
    asked = []

    def serve(request, response):
        asked.append((request.start, request.stop))
        response.success = True
        response.samples = samples_to_msg(recording, request.start, min(request.stop, request.start + 40), 0, TIME_ZERO)
        return response

    stage.node.create_service(GetSamples, "replay/get_samples", serve)
    stage.send_test(recording)
    stage.send(recording, 100, 110, block=5)
    stage.send(recording, 20, 30, block=5, run=1)
    heard = stage.wait_for("estimator", 4)
    assert asked == [(0, 100), (40, 100), (80, 100)]
    assert [(message.run, message.number) for message in heard["parameters"]] == [(0, 100), (0, 105), (1, 20), (1, 25)]
    assert lost(stage) == [(100, "100 samples before number 100 were not seen: the replay has sent them again")]
    first = heard["parameters"][0]
    stage.send(recording, 0, 110, block=5, run=2)
    again = stage.wait_for("estimator", 26)["parameters"][4 + 20]
    assert again.number == 100
    assert_array_equal(again.value, first.value)


def test_a_refusal_and_nobody_to_ask_are_gone_without(stage, recording, capfd):
    service = stage.node.create_service(GetSamples, "replay/get_samples", lambda _, response: response)
    stage.send_test(recording)
    stage.send(recording, 100, 105, block=5)
    stage.wait_for("estimator", 1)
    text = "the pass was joined late, its motion up to here is unknown; the estimates rest on every sample from number"
    assert lost(stage) == [(100, f"100 samples before number 100 were not seen: {text} 100 on")]
    stage.node.destroy_service(service)
    stage.spin(1.0)
    stage.send(recording, 110, 115, block=5)
    stage.wait_for("estimator", 2)
    rest = "the estimates rest on every sample from number 110 on"
    assert lost(stage)[1:] == [(110, f"5 samples before number 110 were not seen; {rest}")]
