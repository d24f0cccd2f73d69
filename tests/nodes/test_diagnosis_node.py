"""The diagnosis node: a ranking while samples come, the offline answer after the last, effects added and taken out."""

from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from crash_msgs.msg import MisfitWindow, Ranking
from crash_msgs.srv import AddEffect, GetSamples, RemoveEffect
from helpers_diagnosis import Stage, hidden_case, joined
from numpy.testing import assert_allclose, assert_array_equal
from test_constants import constants

from crash_estimator.core.diagnosis.report.diagnosis import Diagnosis, diagnose
from crash_estimator.core.effects.change import add_effect
from crash_estimator.nodes.diagnosis_node import DiagnosisNode
from crash_estimator.nodes.effect_requests import request_of, with_effect
from crash_replay.bag import time_zero_ns, write_bag
from crash_replay.qos import STREAM
from crash_replay.recording import Recording, Test
from crash_replay.ros_messages import channel_to_msg, channel_type, samples_to_msg, stamp, stamp_ns

SAME = 1e-9  # relative; the node's process multiplies small matrices in one thread, this one maybe in several
PORTION = 100  # samples after which a ranking is waited for


@pytest.fixture(scope="module")
def case():
    return hidden_case("side", "viscous_damping", 7204)


@pytest.fixture(scope="module")
def model(case, tmp_path_factory) -> str:
    path = tmp_path_factory.mktemp("model") / "side.yaml"
    path.write_text(case[0].model_text)
    return str(path)


@pytest.fixture(scope="module")
def other_bag(case, tmp_path_factory) -> str:
    other, _ = case[0].record(1.1, 1.0)
    return str(write_bag(other, tmp_path_factory.mktemp("bags") / "faster.mcap"))


class Estimators:
    """A stand-in for two estimators' service."""

    def __init__(self, stage: Stage):
        self.asked = {"one": [], "two": []}
        for name, asked in self.asked.items():
            serve = partial(self._on_add, asked)
            stage.node.create_service(AddEffect, f"{name}/add_effect", serve)

    def _on_add(self, asked: list, request: AddEffect.Request, response: AddEffect.Response) -> AddEffect.Response:
        asked.append(request)
        response.success, response.message = True, "added"
        return response


@pytest.fixture(scope="module")
def stage(case, model, other_bag):
    stage = Stage()
    stage.estimators = Estimators(stage)
    stage.add_diagnosis(model=model)
    stage.add_diagnosis("adder", model=model, with_bags=[other_bag], add_first=True, estimators=["one", "two"])
    stage.wait_for_listeners()
    stage.send_test(case[2])
    for start in range(0, len(case[2]), PORTION):
        stage.send(case[2], start, min(start + PORTION, len(case[2])))
        if start > 500:  # the impact
            stage.wait_for_ranking(start)
    stage.wait_for_finals(1)
    yield stage
    stage.close()


@pytest.fixture(scope="module")
def offline(case) -> Diagnosis:
    return diagnose(case[1], [case[2]])


@pytest.fixture(scope="module")
def offline_on_both(case) -> Diagnosis:
    other, _ = case[0].record(1.1, 1.0)
    return diagnose(case[1], [case[2], other])


def assert_same(message, found: Diagnosis) -> None:
    """A final ranking is the offline answer."""
    assert (message.verdict, message.text) == (found.verdict, found.text)
    names = [(r.effect, r.target, r.unit, r.identifiable, tuple(r.confounded_with)) for r in message.ranking]
    assert names == [(r.effect, r.target, r.unit, r.identifiable, r.confounded_with) for r in found.ranking]
    for field in ("coefficient", "std", "evidence", "explained"):
        numbers = [getattr(ranked, field) for ranked in message.ranking]
        # a screened evidence is a small difference of large numbers: it is compared with the leader's
        scale = abs(numbers[0]) if field == "evidence" else 0.0
        expected = [getattr(ranked, field) for ranked in found.ranking]
        assert_allclose(numbers, expected, rtol=SAME, atol=SAME * scale, err_msg=field)
    assert_allclose(message.rms_before, found.residual_rms.before, rtol=SAME)
    assert_allclose(message.rms_after, found.residual_rms.after, rtol=SAME)
    assert_allclose(message.noise_floor, found.residual_rms.noise_floor, rtol=SAME)
    assert_allclose(message.free_run_before, found.free_run_rms.before, rtol=SAME)
    assert_allclose(message.free_run_after, found.free_run_rms.after, rtol=SAME)
    assert list(message.found) == [f"{step.effect} on {step.target}" for step in found.steps]


def test_after_the_last_sample_it_is_the_offline_answer(stage, case, offline):
    final = stage.finals()[0]
    assert_same(final, offline)
    assert (final.number, final.revision, list(final.effects)) == (len(case[2]) - 1, 0, [])
    assert stamp_ns(final.header.stamp) == time_zero_ns(case[2]) + case[2].time_ns[-1]
    assert offline.verdict == "effect_missing" and not final.white_before and final.white_after


def test_what_it_says_are_the_constants_of_its_messages(stage):
    heard = stage.heard["diagnosis"]
    assert {message.verdict for message in heard["ranking"]} <= set(constants(Ranking, str).values())
    states = {window.state for message in heard["misfit"] for window in message.windows}
    assert states and states <= set(constants(MisfitWindow, str).values())
    frames = {m.header.frame_id for m in (*heard["ranking"], *heard["misfit"])}
    assert frames == {stage.diagnoses[0].structure.name}
    assert {m.header.frame_id for m in heard["revisions"]} == {m.model for m in heard["revisions"]}


def test_other_recordings_are_used_with_the_replayed_one(stage, offline_on_both):
    assert_same(stage.wait_for_finals(1, "adder"), offline_on_both)


def test_while_samples_come_the_ranking_grows_with_them(stage, case):
    live = [message for message in stage.heard["diagnosis"]["ranking"] if not message.final]
    numbers = [message.number for message in live]
    assert len(live) >= (len(case[2]) - 500) // PORTION and (np.diff(numbers) > 0).all()
    assert np.diff([message.time for message in live])[:-1].min() >= 0.002, "as the parameter `every` says"
    assert all(np.isnan(message.free_run_before) and message.text.startswith("up to ") for message in live)
    assert live[-1].found == stage.finals()[0].found, "the last live answer names what the offline answer names"


def test_where_the_model_fails_is_said_with_each_ranking(stage, offline):
    rankings, misfits = stage.heard["diagnosis"]["ranking"], stage.heard["diagnosis"]["misfit"]
    assert [m.number for m in misfits] == [m.number for m in rankings]
    final = misfits[[m.final for m in rankings].index(True)]
    windows = [(w.body, w.state) for w in final.windows]
    assert windows == [(w.body, w.state) for w in offline.misfit]
    assert_allclose([w.rms for w in final.windows], [w.rms for w in offline.misfit], rtol=SAME)
    assert_allclose([w.start for w in final.windows], [w.start for w in offline.misfit], atol=1e-12)


def test_each_revision_has_its_curves(stage, case, offline):
    messages = [m for m in stage.heard["diagnosis"]["revisions"]]
    after = case[2].time_ns >= 0
    first = int(np.flatnonzero(after)[0])
    final = [m for m in messages if m.final][:2]
    assert [m.model for m in final] == ["side", "side + viscous_damping on door_car"]
    for message, fitted in zip(final, offline.models):
        assert message.number == first
        assert_array_equal(message.time_ns, case[2].time_ns[after])
        record, predicted = fitted.records[0], fitted.residuals.predicted[0]
        assert_allclose(joined([message], "measured"), record.measured, rtol=1e-12)
        assert_allclose(joined([message], "predicted"), predicted, rtol=1e-6, atol=1e-6 * np.abs(predicted).max())
        assert_allclose(joined([message], "residual"), record.measured - predicted, atol=1e-6 * np.abs(predicted).max())
    drawn = [m for m in messages if not m.final and m.model == "side"]
    assert_array_equal(np.concatenate([m.time_ns for m in drawn]), case[2].time_ns[after])


def test_the_first_effect_found_is_added_to_itself_and_to_the_estimators(stage, case, offline_on_both):
    second = stage.wait_for_finals(2, "adder")
    assert list(second.effects) == ["viscous_damping on door_car"] and second.revision == 1
    assert (second.verdict, list(second.found)) == ("adequate", []) and second.white_before
    assert second.rms_before < 1.05 * second.noise_floor < stage.finals("adder")[0].rms_before
    for asked in stage.estimators.asked.values():
        assert [(q.effect, q.target) for q in asked] == [("viscous_damping", "door_car")]
        own = with_effect(case[1], asked[0]).effects[-1]
        assert_allclose(own.coefficient, offline_on_both.steps[0].coefficient, rtol=SAME)
    stage.spin(1.0)
    assert len(stage.finals("adder")) == 2, "it adds once"


@pytest.mark.parametrize("verdict, added", [("effect_missing", 1), ("unexplained", 0)])
def test_only_what_the_verdict_names_is_added(verdict, added):
    """Where nothing explains enough the best is reported, and not added."""
    taken: list = []
    answer = SimpleNamespace(found=("an effect",), verdict=verdict)
    node = SimpleNamespace(
        finals={}, adds=True, kept=SimpleNamespace(missing=lambda end: 0), model=SimpleNamespace(add=taken.append)
    )
    for _ in range(2):
        DiagnosisNode._add_found(node, SimpleNamespace(revision=0, number=9), answer)
    assert len(taken) == added


def test_an_effect_added_and_taken_out_makes_a_revision_each(stage, case, offline):
    before = len(stage.finals())
    refused = stage.call("diagnosis/add_effect", AddEffect, effect="viscous_dampin", target="door_car")
    assert not refused.success and "did you mean 'viscous_damping'" in refused.message
    refused = stage.call("diagnosis/remove_effect", RemoveEffect, effect="viscous_damping", target="door_car")
    assert not refused.success and "has no effect viscous_damping on door_car to remove" in refused.message
    wrong = stage.call("diagnosis/add_effect", AddEffect, effect="viscous_damping", target="door_car", options=["slow"])
    assert not wrong.success and "got 'slow'" in wrong.message

    added = stage.call("diagnosis/add_effect", AddEffect, effect="viscous_damping", target="door_car")
    assert (added.success, added.message) == (True, "revision 1: side + viscous_damping on door_car")
    final = stage.wait_for_finals(before + 1)
    assert_same(final, diagnose(add_effect(case[1], "viscous_damping", "door_car"), [case[2]]))
    assert (final.revision, final.verdict) == (1, "adequate")
    live = [m for m in stage.heard["diagnosis"]["ranking"] if m.revision == 1 and not m.final]
    assert [m.number for m in live] == [len(case[2]) - 1], "one at once, from the samples that are kept"

    assert stage.call("diagnosis/remove_effect", RemoveEffect, effect="viscous_damping", target="door_car").success
    final = stage.wait_for_finals(before + 2)
    assert_same(final, offline)
    assert (final.revision, list(final.effects)) == (2, [])


def test_a_new_pass_begins_anew_and_ends_with_the_same_answer(stage, case):
    finals, live = len(stage.finals()), len(stage.heard["diagnosis"]["ranking"])
    middle = len(case[2]) // 2
    stage.send(case[2], middle, middle + 100, run=1)
    stage.spin_until(lambda: len(stage.heard["diagnosis"]["ranking"]) > live, "it says something")
    stage.send(case[2], middle + 100, run=1)
    final = stage.wait_for_finals(finals + 1)
    said = stage.heard["diagnosis"]["ranking"][live:]
    assert all(message.run == 1 and message.number >= middle for message in said)
    assert not said[0].final and said[0].number < middle + 100
    previous = stage.finals()[finals - 1]
    assert [(r.effect, r.evidence) for r in final.ranking] == [(r.effect, r.evidence) for r in previous.ranking]


def test_a_pass_of_which_much_was_not_seen_is_not_judged(stage, case, capfd):
    stage.send_test(case[2])
    count = len(stage.heard["diagnosis"]["ranking"])
    stage.send(case[2], 600, 700, run=2)
    stage.spin_until(lambda: stage.diagnoses[0].stopped, "it has asked for them in vain")
    assert len(stage.heard["diagnosis"]["ranking"]) == count
    assert "samples were not seen: nothing is said on this pass" in capfd.readouterr().err


def test_a_test_that_the_model_does_not_fit_is_one_line(stage, case, capfd):
    recording = case[2]
    other = Recording(Test("other", recording.test.channels[:1]), recording.time_ns, recording.values[:, :1])
    stage.send_test(other)
    stage.send(other, 0, 100)
    said = [line for line in capfd.readouterr().err.splitlines() if "ERROR" in line]
    assert len(said) == 2 and all("nothing is diagnosed on this test" in line for line in said)  # one of each node


def test_samples_that_were_missed_are_asked_of_the_replay(stage, case):
    def send_again(request: GetSamples.Request, response: GetSamples.Response) -> GetSamples.Response:
        stop = min(request.stop, request.start + 400)  # as much as fits
        response.samples = samples_to_msg(case[2], request.start, stop, 0, time_zero_ns(case[2]))
        response.success = True
        return response

    service = stage.node.create_service(GetSamples, "replay/get_samples", send_again)
    stage.spin_until(stage.diagnoses[0].asking.client.service_is_ready, "the service is there")
    stage.send_test(case[2])
    finals = len(stage.finals())
    stage.send(case[2], 1000, run=3)  # it came late
    assert_same(stage.wait_for_finals(finals + 1), diagnose(stage.diagnoses[0].structure, [case[2]]))
    stage.node.destroy_service(service)


def test_rosbag2s_player_feeds_it_too(stage, case):
    recording, finals = case[2], len(stage.finals())
    stage.send_test(recording)
    stage.node.destroy_publisher(stage.samples)
    channels, player = recording.test.channels, stage.others.add("player")
    out = [player.create_publisher(channel_type(c), f"channels/{c.name}", STREAM) for c in channels]
    stage.spin_until(lambda: all(p.get_subscription_count() == 2 for p in out), "the channels are subscribed to")
    for time_ns, values in zip(recording.time_ns.tolist(), recording.values.tolist()):
        for publisher, channel, value in zip(out, channels, values):
            publisher.publish(channel_to_msg(channel, stamp(time_zero_ns(recording) + time_ns), value))
        stage.executor.spin_once(timeout_sec=0.0)
    assert_same(stage.wait_for_finals(finals + 1), diagnose(stage.diagnoses[0].structure, [recording]))


def test_a_request_carries_all_that_was_found(case):
    structure = add_effect(
        case[1], "rate_hardening", "door_car", coefficient=1 / 3, shape={"exponent": 0.1 + 0.2}
    )  # fmt: skip
    assert with_effect(case[1], request_of(structure.effects[0])) == structure
