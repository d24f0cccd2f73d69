"""The estimator node says what the loop gives on the same samples, to the last bit, and tells what is wrong."""

import numpy as np
import pytest
from crash_msgs.msg import Answer
from helpers_estimation import oscillator_recording
from helpers_estimator_node import MODEL, TIME_ZERO, assert_same, empty_samples, joined, offline
from numpy.testing import assert_array_equal

from crash_estimator.core.methods import make_estimator
from crash_estimator.nodes import estimator_model, later
from crash_replay.qos import LATCHED
from crash_replay.recording import Recording, Test
from crash_replay.ros_messages import stamp_ns


@pytest.fixture
def model(tmp_path) -> str:
    path = tmp_path / "oscillator.yaml"
    path.write_text(MODEL)
    return str(path)


@pytest.fixture(scope="module")
def recording() -> Recording:
    return oscillator_recording(noise=5.0, n=300)


@pytest.mark.parametrize("block", [1, 7])
def test_what_is_published_is_what_the_loop_gives_to_the_last_bit(stage, model, recording, block):
    stage.add_estimator(model=model, method="mrls")
    stage.send_test(recording)
    stage.send(recording, block=block)
    heard = stage.wait_for("estimator", -(-len(recording) // block))
    assert_same(heard, offline(model, recording, "mrls"))
    assert heard["events"], "the recording has rewinds and reversals to tell of"
    for message in heard["parameters"]:
        assert stamp_ns(message.header.stamp) == TIME_ZERO + message.time_ns[0]
        assert (message.model, message.method, message.run) == ("oscillator", "mrls", 0)
    first = heard["parameters"][0]
    assert (list(first.name), list(first.unit)) == (["spring.stiffness", "spring.damping"], ["N/m", "N*s/m"])
    forces = heard["forces"][0]
    assert (list(forces.element), list(forces.between)) == (["spring"], ["block-wall"])
    assert_array_equal(forces.mass, [10.0, np.nan])
    for event in heard["events"]:
        assert stamp_ns(event.header.stamp) == TIME_ZERO + round(event.time * 1e9)


def most_that_waits(stage, node, recording) -> int:
    """Messages of forces, while the recording goes by in what the node takes for a rush."""
    stage.send_test(recording)
    stage.send(recording, block=7)
    most = 0
    while len(stage.heard["estimator"]["parameters"]) < -(-len(recording) // 7):
        most = max(most, len(node.topics.later.waiting))
        stage.executor.spin_once(timeout_sec=0.02)
    return most


def test_in_a_rush_the_forces_come_later_and_are_the_same(stage, model, recording, monkeypatch):
    monkeypatch.setattr(later, "RUSH", 0.0)
    node = stage.add_estimator(model=model, method="mrls")
    assert most_that_waits(stage, node, recording) > 1
    assert_same(stage.wait_for("estimator", -(-len(recording) // 7)), offline(model, recording, "mrls"))
    assert node.topics.looking.is_canceled()  # nothing is looked for any more


def test_who_waits_for_an_answer_has_heard_the_forces_before(stage, model, recording, monkeypatch):
    """Else a recording of a replay in lock-step could end without them."""
    monkeypatch.setattr(later, "RUSH", 0.0)
    node = stage.add_estimator(model=model, method="mrls")
    stage.node.create_subscription(Answer, "answers", lambda message: None, LATCHED)
    stage.spin_until(node.topics.answers.get_subscription_count, "somebody waits for answers")
    assert most_that_waits(stage, node, recording) == 0
    assert_same(stage.wait_for("estimator", -(-len(recording) // 7)), offline(model, recording, "mrls"))


def test_several_side_by_side_each_with_its_method_and_settings(stage, model, recording):
    stage.add_estimator("slow", model=model, method="rls", **{"settings.forgetting": 0.999})
    stage.add_estimator("fast", model=model, method="rls", **{"settings.forgetting": 0.9})
    stage.add_estimator("filter", model=model, method="constrained_kalman")
    stage.send_test(recording)
    stage.send(recording, block=10)
    messages = -(-len(recording) // 10)
    assert_same(stage.wait_for("slow", messages), offline(model, recording, "rls", forgetting=0.999))
    assert_same(stage.wait_for("fast", messages), offline(model, recording, "rls", forgetting=0.9))
    assert_same(stage.wait_for("filter", messages), offline(model, recording, "constrained_kalman"))


def test_lost_samples_are_counted_and_said(stage, model, recording, capfd):
    stage.add_estimator(model=model)
    stage.send_test(recording)
    stage.send(recording, 0, 100)
    stage.send(recording, 103, 200)
    heard = stage.wait_for("estimator", 197)
    lost = [(m.number, m.value, m.text) for m in heard["events"] if m.kind == "lost"]
    text = "3 samples before number 103 were not seen; the estimates rest on every sample from number 103 on"
    assert lost == [(103, 3.0, text)]
    assert capfd.readouterr().err.count("3 samples before number 103 were not seen") == 1


def test_who_joins_late_says_so_and_goes_on(stage, model, recording):
    stage.send_test(recording)  # latched: known to whoever comes later
    stage.send(recording, 0, 150)
    stage.add_estimator(model=model)
    stage.spin(0.2)
    stage.send(recording, 150, 200)
    heard = stage.wait_for("estimator", 50)
    lost = [m for m in heard["events"] if m.kind == "lost"]
    assert len(lost) == 1 and lost[0].value == 150.0
    assert "150 samples before number 150 were not seen: the pass was joined late" in lost[0].text
    assert [m.number for m in heard["parameters"]] == list(range(150, 200))


@pytest.mark.parametrize("second_run", [1, 0])
def test_a_new_pass_starts_from_nothing(stage, model, recording, second_run):
    """Run 1: the replay's own loop; run 0 again: a replay that was started anew."""
    stage.add_estimator(model=model)
    stage.send_test(recording)
    stage.send(recording, 0, 100, block=10)
    stage.send(recording, 0, 100, block=10, run=second_run)
    heard = stage.wait_for("estimator", 20)
    assert not [m for m in heard["events"] if m.kind == "lost"]
    first, second = heard["parameters"][:10], heard["parameters"][10:]
    assert {m.run for m in second} == {second_run}
    assert_array_equal(joined(second, "value"), joined(first, "value"))
    assert_array_equal(joined(second, "std"), joined(first, "std"))


def test_samples_that_come_again_are_left_out_with_a_warning(stage, model, recording, capfd):
    stage.add_estimator(model=model)
    stage.send_test(recording)
    stage.send(recording, 0, 100, block=10)
    stage.send(recording, 95, 105, block=10)
    stage.send(recording, 105, len(recording), block=1000)
    heard = stage.wait_for("estimator", 12)
    assert_same(heard, offline(model, recording, "constrained_kalman"))
    assert "samples from number 95 come after number 99" in capfd.readouterr().err


def test_a_model_that_does_not_fit_the_test_is_one_line_and_the_next_test_is_welcome(stage, model, recording, capfd):
    stage.add_estimator(model=model)
    channels = recording.test.channels
    other = Recording(Test("other", channels[:2]), recording.time_ns, recording.values[:, :2])
    stage.send_test(other)
    stage.send(other, 0, 20)
    stage.spin(0.2)
    said = [line for line in capfd.readouterr().err.splitlines() if "ERROR" in line]
    assert len(said) == 1 and "no channel 'speed' (wanted by element spring); nearest: " in said[0]
    assert not stage.heard["estimator"]["parameters"]
    stage.send_test(recording)
    stage.send(recording, block=10)
    assert_same(stage.wait_for("estimator", 35), offline(model, recording, "constrained_kalman"))


def test_every_message_is_answered_whatever_becomes_of_it(stage, model, recording):
    """A replay in lock-step waits for the answer, which comes when all there is to say on the samples is published."""
    answers = []
    node = stage.add_estimator("mrls", model=model, method="mrls")
    stage.node.create_subscription(Answer, "answers", answers.append, LATCHED)

    def answer_to(start, stop, run=0):
        before = len(answers)
        stage.send(recording, start, stop, block=stop - start, run=run)
        stage.spin_until(lambda: len(answers) > before, "an answer comes")
        return answers[-1].number, answers[-1].run, answers[-1].missed

    assert answer_to(0, 10) == (9, 0, 0)  # there is no test yet
    stage.send_test(recording)
    for start in range(0, 100, 10):
        assert answer_to(start, start + 10) == (start + 9, 0, 0)
        stage.spin(0.02)
        assert stage.heard["mrls"]["parameters"][-1].number == start
    assert answer_to(95, 100) == (99, 0, 0)  # once more
    assert answer_to(103, 113) == (112, 0, 3)
    node.stopped = True
    assert answer_to(113, 120) == (119, 0, 3)
    assert answer_to(50, 60, run=1) == (59, 1, 3)
    stage.samples.publish(empty_samples(7, [1.0, 2.0]))  # of another test
    stage.spin_until(lambda: answers[-1].number == 7, "an answer comes")
    assert {answer.node for answer in answers} == {"/mrls"}


def test_samples_of_another_test_are_left_out_with_an_error(stage, model, recording, capfd):
    stage.add_estimator(model=model)
    stage.send_test(recording)
    for _ in range(50):
        stage.samples.publish(empty_samples(0, [1.0, 2.0]))
    stage.spin(0.2)
    said = capfd.readouterr().err
    assert said.count("samples from number 0: expected 3 values (3 channels), found 2: left out") == 1, "a flood"
    stage.send(recording, block=10)
    assert_same(stage.wait_for("estimator", 35), offline(model, recording, "constrained_kalman"))


class Spoiled:
    """An estimator whose step is changed."""

    def __init__(self, estimator, spoil):
        self.estimator, self.spoil = estimator, spoil
        self.description, self.init = estimator.description, estimator.init

    def step(self, state, sample):
        return self.spoil(sample, *self.estimator.step(state, sample))


@pytest.fixture
def spoil(monkeypatch):
    """spoil(change): from now on change(sample, state, estimate) is what an estimator's step gives."""

    def install(change):
        spoiled = lambda *args, **settings: Spoiled(make_estimator(*args, **settings), change)  # noqa: E731
        monkeypatch.setattr(estimator_model, "make_estimator", spoiled)

    return install


def test_a_filter_that_cannot_go_on_says_so_once_and_starts_again(stage, model, recording, capfd, spoil):
    fails = [True]

    def singular(sample, state, estimate):
        if sample.time_ns > 10_000_000 and fails:
            raise np.linalg.LinAlgError("Singular matrix")
        return state, estimate

    spoil(singular)
    stage.add_estimator(model=model)
    stage.send_test(recording)
    stage.send(recording, 0, 200)
    at = int(np.searchsorted(recording.time_ns, 10_000_000)) + 1
    heard = stage.wait_for("estimator", at)
    stage.spin(0.2)
    said = [line for line in capfd.readouterr().err.splitlines() if "ERROR" in line]
    assert len(said) == 1 and f"sample {at} at 10.10 ms: constrained_kalman cannot go on (Singular matrix)" in said[0]
    assert len(heard["parameters"]) == at
    fails.clear()
    stage.send(recording, run=1)
    stage.wait_for("estimator", at + len(recording))
    again = {topic: [m for m in messages if m.run == 1] for topic, messages in heard.items()}
    assert_same(again, offline(model, recording, "constrained_kalman"))


def test_parameters_that_are_not_finite_are_never_published(stage, model, recording, capfd, spoil):
    def diverging(sample, state, estimate):
        return state, estimate._replace(parameters=estimate.parameters * (np.inf if sample.number > 99 else 1.0))

    spoil(diverging)
    stage.add_estimator(model=model)
    stage.send_test(recording)
    stage.send(recording, block=1000)
    heard = stage.wait_for("estimator", 1)
    assert np.isfinite(joined(heard["parameters"], "value")).all()
    assert len(heard["parameters"][0].time_ns) == 100
    assert (
        "sample 100 at 5.00 ms: constrained_kalman cannot go on (the parameters are no longer" in capfd.readouterr().err
    )
