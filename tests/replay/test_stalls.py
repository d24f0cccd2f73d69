"""Processes that are stopped for long, or killed: the results are whole, or it is said."""

import re
import signal
import subprocess

import numpy as np
import pytest
from crash_msgs.msg import Ranking
from helpers_diagnosis import hidden_case
from helpers_estimator_node import joined
from helpers_paths import BAGS
from helpers_waiting import PATIENCE
from numpy.testing import assert_array_equal

from crash_estimator.core.fold import run
from crash_estimator.core.methods import make_estimator
from crash_estimator.model_file import load_model
from crash_replay.bag import read_bag, write_bag
from crash_replay.qos import SAID

BAG = BAGS / "frontal_engine_cab.mcap"
MODEL = "frontal_engine_cab"
STOPPED = 8.0
"""s: longer than the replay's 2 s, and than silence takes to be noticed."""


@pytest.fixture(scope="module")
def whole():
    """Parameters after every sample, as the one loop gives them."""
    recording = read_bag(BAG)
    estimator = make_estimator(load_model(MODEL), recording.test, "mrls")
    return np.array([e.parameters for e in run(estimator, recording.samples())])


def victim_and_replay(stage, **parameters) -> tuple[subprocess.Popen, subprocess.Popen]:
    stage.listen("victim")
    victim = stage.start("crash_estimator.nodes.estimator_node", "victim", model=MODEL, method="mrls")
    stage.spin_until(
        lambda: stage.node.count_publishers("victim/block/parameters"), "the victim is found", 2 * PATIENCE
    )
    stage.spin(1.0)  # it finds the stage a moment later: what it says before is heard by nobody
    waiting = {"listeners": "[victim]", "wait_timeout": 100.0, "wait_for": 2}
    replay = stage.replay(BAG, rate=0.1, stderr=subprocess.PIPE, **waiting | parameters)
    stage.spin_until(lambda: stage.heard["victim"]["parameters"], "the victim has begun", 2 * PATIENCE)
    return victim, replay


def ended(stage, process: subprocess.Popen, patience: float = PATIENCE) -> tuple[int, str]:
    """Exit status, and what it has said on standard error."""
    stage.spin_until(lambda: process.poll() is not None, "it has ended", patience)
    return process.returncode, process.communicate()[1]


def numbers(messages) -> list[int]:
    return [message.number + k for message in messages for k in range(len(message.time_ns))]


def assert_whole(stage, victim: subprocess.Popen, whole: np.ndarray) -> None:
    """The victim has said the right parameters after every sample, and knows that it has."""
    heard = stage.heard["victim"]["parameters"]
    # the replay goes when the victim has said all; what it has said last may still be on its way to the stage
    stage.spin_until(lambda: len(numbers(heard)) >= len(whole), "the last parameters have come")
    messages = sorted(heard, key=lambda message: message.number)
    assert numbers(messages) == list(range(len(whole)))
    assert_array_equal(joined(messages, "value")[:, : whole.shape[1]], whole)
    victim.send_signal(signal.SIGINT)
    stage.spin_until(lambda: victim.poll() is not None, "it has ended")
    assert victim.returncode == 0


def test_who_was_stopped_until_the_last_sample_was_long_sent_has_all_of_them_in_the_end(stage, whole):
    stage.listen_to_samples()
    victim, replay = victim_and_replay(stage)
    victim.send_signal(signal.SIGSTOP)
    stage.spin(STOPPED)
    assert replay.poll() is None, "it stays for who is stopped"
    victim.send_signal(signal.SIGCONT)
    status, said = ended(stage, replay)
    assert status == 0, said
    assert re.search(r"/victim (stopped|silent) for \d+ s", said) and "incomplete" not in said, said
    assert_whole(stage, victim, whole)


def test_who_is_killed_is_named_and_the_status_is_1(stage):
    stage.listen_to_samples()
    victim, replay = victim_and_replay(stage)
    victim.kill()
    victim.wait()
    status, said = ended(stage, replay)
    assert status == 1
    assert "incomplete: /victim has " in said and " of 1901 samples (was killed)\n" in said


def test_who_stays_away_is_not_waited_for_without_end(stage):
    stage.listen_to_samples()
    victim, replay = victim_and_replay(stage, finish_timeout=1.0)
    victim.send_signal(signal.SIGSTOP)
    # where the clock is lost the replay waits 10 s once, and 30 s for the last to be taken, beside what PATIENCE is for
    status, said = ended(stage, replay, 2 * PATIENCE)
    victim.send_signal(signal.SIGCONT)
    assert status == 1
    assert "incomplete: /victim has " in said and " of 1901 samples (" in said
    # and it says itself what it lacks, once the replay has gone
    victim.send_signal(signal.SIGINT)
    stage.spin_until(lambda: victim.poll() is not None, "it has ended")
    assert victim.returncode == 1


def test_a_replay_that_was_stopped_goes_on_and_nothing_is_missing(stage, whole):
    stage.listen_to_samples()
    victim, replay = victim_and_replay(stage)
    replay.send_signal(signal.SIGSTOP)
    stage.spin(STOPPED)
    replay.send_signal(signal.SIGCONT)
    status, said = ended(stage, replay)
    assert status == 0, said
    assert_whole(stage, victim, whole)


def test_a_diagnosis_that_was_stopped_gives_the_same_answer(stage, tmp_path):
    case, _, recording = hidden_case("single", "viscous_damping", 8101)
    bag, model = write_bag(recording, tmp_path / "damped.mcap"), tmp_path / "damped.yaml"
    model.write_text(case.model_text)
    answers: list[Ranking] = []
    stage.node.create_subscription(Ranking, "diagnosis/ranking", answers.append, SAID)
    final = lambda: [answer for answer in answers if answer.final]  # noqa: E731
    undisturbed = None
    for stop in (False, True):
        answers.clear()
        diagnosis = stage.start("crash_estimator.nodes.diagnosis_node", model=model)
        replay = stage.replay(bag, rate=0.1, stderr=subprocess.PIPE, listeners="[diagnosis]", wait_timeout=200.0)
        stage.spin_until(lambda: answers, "the diagnosis has begun", 4 * PATIENCE)
        if stop:
            diagnosis.send_signal(signal.SIGSTOP)
            stage.spin(STOPPED)
            diagnosis.send_signal(signal.SIGCONT)
        status, said = ended(stage, replay)
        assert status == 0, said
        stage.spin_until(final, "the diagnosis has answered", 4 * PATIENCE)
        given = final()[0]
        diagnosis.send_signal(signal.SIGINT)
        stage.spin_until(lambda diagnosis=diagnosis: diagnosis.poll() is not None, "it has ended")
        assert diagnosis.returncode == 0
        if stop:
            assert (given.verdict, given.number, given.ranking) == (
                undisturbed.verdict,
                undisturbed.number,
                undisturbed.ranking,
            )
            assert (given.rms_before, given.rms_after) == (undisturbed.rms_before, undisturbed.rms_after)
        undisturbed = given
