"""What is known of the nodes that take part: from their words, their processes and their silence."""

import os
import signal
import subprocess
import sys

import pytest
from helpers_replay import wait_until

from crash_replay.attendance import GIVEN_UP, PERIOD, SILENT, Attendance, State, Word
from crash_replay.processes import has_ended, is_stopped, state_of, this_host

HERE, ELSEWHERE = "here", "elsewhere"
KALMAN = Word("/kalman", "estimator", HERE, 7, ready=True, run=0, total=10, next=4)


class Scene:
    """A clock and a table of processes, told by the test."""

    def __init__(self):
        self.now, self.gone, self.stopped = 100.0, set(), set()
        self.attendance = Attendance(lambda: self.now, HERE, self.gone.__contains__, self.stopped.__contains__)

    def state(self, name: str = "/kalman", run: int = 0, sent: int = 10) -> State:
        return self.attendance.state(name, run, sent)


@pytest.fixture
def scene():
    scene = Scene()
    scene.attendance.hear(KALMAN)
    return scene


@pytest.mark.parametrize(
    ("word", "state"),
    [
        (KALMAN, State.FOLLOWING),
        (KALMAN._replace(ready=False), State.PREPARING),
        (KALMAN._replace(next=10), State.COMPLETE),
        (KALMAN._replace(run=1, next=2), State.COMPLETE),  # of a later pass: this one is behind it
        (KALMAN._replace(leaving=True), State.LEFT),
    ],
)
def test_its_own_word_counts(scene, word, state):
    scene.attendance.hear(word)
    assert scene.state() == state


def test_silence_means_less_than_a_process_that_has_ended(scene):
    scene.now += SILENT + 0.1
    assert scene.state() == State.SILENT
    scene.stopped.add(7)
    assert scene.attendance.lacks("/kalman", 0, 10) == "4 of 10 samples (stopped for 5 s)"
    scene.now += 10 * GIVEN_UP
    assert scene.state() == State.SILENT, "its process is there"
    scene.gone.add(7)
    assert scene.state() == State.KILLED
    assert scene.attendance.lacks("/kalman", 0, 10) == "4 of 10 samples (was killed)"
    scene.attendance.hear(KALMAN._replace(process=8))
    assert scene.state() == State.FOLLOWING, "another one of that name"


def test_a_process_is_not_looked_at_while_it_speaks(scene):
    scene.gone.add(7)  # its last word may still be under way
    scene.now += PERIOD
    assert scene.state() == State.FOLLOWING
    scene.now += 2 * PERIOD
    assert scene.state() == State.KILLED


def test_of_another_machine_only_silence_tells(scene):
    scene.gone.add(7)
    scene.attendance.hear(KALMAN._replace(host=ELSEWHERE))
    scene.now += SILENT + 0.1
    assert scene.state() == State.SILENT and scene.attendance.there("/kalman")
    scene.now += GIVEN_UP
    assert scene.state() == State.KILLED and not scene.attendance.there("/kalman")


@pytest.mark.parametrize(
    ("word", "lacks"),
    [
        (KALMAN._replace(next=10), ""),
        (
            KALMAN._replace(next=10, missing=3, reason="the replay had ended"),
            "3 of 10 samples missing (the replay had ended)",
        ),
        (KALMAN._replace(run=1), "0 of 10 samples (still at work)"),
        (KALMAN._replace(next=6, missing=2), "4 of 10 samples (still at work)"),
        (KALMAN._replace(ready=False, next=0), "0 of 10 samples (not ready yet)"),
    ],
)
def test_what_it_lacks_is_counted_and_said_why(scene, word, lacks):
    scene.attendance.hear(word)
    assert scene.attendance.lacks("/kalman", 0, 10) == lacks


def test_the_state_of_a_process_of_this_machine_is_known():
    process = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    try:
        assert not has_ended(process.pid) and not has_ended(os.getpid())
        process.send_signal(signal.SIGSTOP)
        wait_until(lambda: is_stopped(process.pid))
        process.send_signal(signal.SIGCONT)
        wait_until(lambda: not is_stopped(process.pid))
    finally:
        process.kill()
    wait_until(lambda: has_ended(process.pid))  # though nobody has waited for it yet
    process.communicate()
    assert state_of(process.pid) == ""
    assert this_host() == this_host() != ""
