"""Who of the demonstration's nodes is lost, and when: from their processes, their words and their silence."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from crash_estimator.demo.company import GRACE, SILENT, STALLED, STOPPED, Company
from crash_replay.attendance import Attendance, Word


class Scene:
    """Two processes, a clock and what is stopped, told by the test."""

    def __init__(self):
        self.now, self.stopped = 100.0, set()
        self.children = {name: self.child(pid) for pid, name in enumerate(("replay", "mrls"), start=7)}
        self.words = Attendance(lambda: self.now, "here")
        self.company = Company(self.children, self.words, lambda: self.now, self.stopped.__contains__)
        for name in self.children:
            self.say(name)

    @staticmethod
    def child(pid: int) -> SimpleNamespace:
        process = SimpleNamespace(pid=pid)
        return SimpleNamespace(process=process, status=None, log=Path("log"), last_words=lambda: "its reason")

    def say(self, name: str, **fields) -> None:
        pid = self.children[name].process.pid
        self.words.hear(Word(f"/{name}", "role", "here", pid, **{"ready": True, **fields}))

    def pass_time(self, seconds: float, *silent: str) -> list[str]:
        """Looking often, while the others say their words."""
        lines = []
        for _ in range(round(seconds)):
            self.now += 1.0
            for name in set(self.children) - set(silent):
                self.say(name)
            lines += self.company.look()
        return lines


@pytest.fixture
def scene():
    return Scene()


def test_a_process_that_is_stopped_for_a_minute_is_waited_for_and_one_for_longer_is_not(scene):
    scene.stopped.add(8)
    assert scene.pass_time(60, "mrls") == [] and scene.company.how("mrls") == "stopped: kill -CONT 8"
    (line,) = scene.pass_time(STOPPED, "mrls")
    assert line.startswith(f"mrls was stopped for {STOPPED:g} s") and not scene.company.there("mrls")
    assert scene.pass_time(10, "mrls") == [], "it is said once"


def test_one_that_runs_and_says_nothing_may_be_at_work_for_longer(scene):
    assert scene.pass_time(SILENT - 1, "mrls") == []
    (line,) = scene.pass_time(3, "mrls")
    assert line.startswith(f"mrls has said nothing for {SILENT:g} s")


def test_one_that_compiles_may_be_silent_for_as_long_as_the_start_may_take(scene):
    scene.say("mrls", ready=False)
    assert scene.pass_time(2 * SILENT, "mrls") == [] and scene.company.how("mrls") == "compiling"


def test_who_has_stood_still_itself_blames_nobody(scene):
    scene.stopped.add(8)
    scene.now += STOPPED + SILENT
    assert scene.company.look() == [] and scene.company.back == scene.now
    assert scene.pass_time(STALLED) == []


def test_an_early_end_is_said_with_its_reason(scene):
    scene.children["mrls"].status = -9
    assert scene.company.look() == [] and scene.company.there("mrls"), "its last word may still come"
    assert scene.pass_time(GRACE + 1, "mrls") == ["mrls has ended too early: its reason"]


def test_the_replay_may_end_by_itself_and_others_when_they_are_let_go(scene):
    for child in scene.children.values():
        child.status = 0
    scene.say("replay", leaving=True)
    scene.company.let_go.add("mrls")
    assert scene.pass_time(GRACE + 2, "replay", "mrls") == []
    assert not scene.company.there("replay") and not scene.company.lost


@pytest.mark.parametrize(("status", "lost"), [(0, []), (2, ["replay has ended too early: its reason"])])
def test_a_replay_that_says_by_its_status_that_nothing_is_missing_needs_no_last_word(scene, status, lost):
    """On a machine with much to do that comes after its process has ended, by more than a second."""
    scene.children["replay"].status = status
    assert scene.pass_time(GRACE + 2, "replay", "mrls") == lost
