"""Many passes and many tests through the viewer's recorder: each in its own recording, and none is held on to."""

import os
from dataclasses import replace
from threading import Event

import helpers_viewer as crash_data
import pytest
from helpers_viewer import recorder, rows, settle
from helpers_waiting import PATIENCE

from crash_estimator.viewer import show
from crash_estimator.viewer.passes import Pass
from crash_estimator.viewer.recorder import Recorder
from crash_estimator.viewer.sinks import Sinks

pytestmark = pytest.mark.usefixtures("strict")

SHORT = 60
"""Samples of a test."""


def threads() -> int:
    return len(os.listdir("/proc/self/task"))


def test_passes_that_are_over_take_neither_threads_nor_memory(tmp_path):
    crash, taken = crash_data.simulate(n=SHORT), []
    target = Recorder(Sinks(0, tmp_path / "first.rrd"))
    target.put(lambda: crash_data.test_block(crash))
    for run in range(12):
        for block in crash_data.estimates(crash, "mrls", run=run):
            target.put(lambda block=block: block)
        settle(target)
        taken.append((threads(), len(target._passes)))
    assert taken[-1][0] <= taken[5][0] and taken[-1][1] <= taken[5][1] <= 5, taken
    target.close()
    assert target.faults == []
    assert len(list(tmp_path.glob("*.rrd"))) < 5


def test_passes_that_follow_faster_than_they_are_judged_are_only_drawn(tmp_path, monkeypatch):
    """All in one batch: the first, which is in the file, and the newest are judged, those between are overtaken."""
    crash, judged = crash_data.simulate(n=SHORT), []
    target = recorder(tmp_path / "first.rrd")
    judge = Pass.judge
    monkeypatch.setattr(Pass, "judge", lambda self: (judged.append(self) if self.jury else None, judge(self)))
    goes_on = Event()
    target.put(lambda: goes_on.wait(PATIENCE) and None)
    target.put(lambda: crash_data.test_block(crash))
    for run in range(6):
        for name in crash_data.NAMES:
            for block in crash_data.estimates(crash, name, run=run):
                target.put(lambda block=block: block)
    goes_on.set()
    settle(target)
    kept = list(target._passes)
    target.close()
    assert target.faults == []
    assert kept[-1] == (0, 5) and 2 <= len({id(one) for one in judged}) < 5


def test_tests_of_one_structure_and_length_share_a_layout(monkeypatch):
    """The server of the viewers keeps each that it is sent."""
    sent, after = [], []
    monkeypatch.setattr(show, "send_layout", lambda recording, layout, activate, times: sent.append(layout))
    target = Recorder(Sinks(0), ("mrls",))
    for k in range(4):
        crash = crash_data.simulate(n=SHORT if k < 3 else SHORT + 7)
        target.put(lambda crash=crash, k=k: replace(crash_data.test_block(crash), id=f"test {k}"))
        for block in crash_data.estimates(crash, "mrls"):
            target.put(lambda block=block: block)
        settle(target)
        after.append(len(sent))
    target.close()
    assert 0 < after[0] <= 3 and after[1] == after[2] and after[3] > after[2], after


def test_tests_that_come_faster_than_they_are_drawn_stay_apart(tmp_path):
    """All in one batch, all as run 0: each test's samples are in its own file, and not in that of the last one."""
    target = recorder(tmp_path / "many.rrd")
    lengths = [SHORT + k for k in range(3)]
    goes_on, gone_on = Event(), []
    target.put(lambda: gone_on.append(goes_on.wait(PATIENCE)))  # Rerun is held up, as by a slow disk
    for n in lengths:
        crash = crash_data.simulate(n=n)
        target.put(lambda crash=crash: crash_data.test_block(crash))
        for name in crash_data.NAMES:
            for block in crash_data.estimates(crash, name):
                target.put(lambda block=block: block)
    goes_on.set()
    settle(target)
    target.close()
    assert target.faults == []
    assert rows(tmp_path / "many.rrd")["/signal/cab/measured"] == lengths[0]
