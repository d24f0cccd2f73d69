"""Lock-step: the next samples go out when every listener has answered, and every run gives the same bytes."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path

from crash_msgs.msg import ParametersBlock
from helpers_paths import ROOT
from helpers_replay import Listener, environment, wait_until
from mcap.writer import Writer
from rclpy.serialization import serialize_message
from std_srvs.srv import Trigger

from crash_estimator.benchmarks.speed_lockstep import burning, said
from crash_replay.lockstep import Answered, Lockstep
from crash_replay.same_messages import messages_by_topic


class Listeners:
    def __init__(self, *names: str):
        self.processes, self.warnings = {name: {b"first"} for name in names}, []

    def lockstep(self, patience: float = 10.0) -> Lockstep:
        found = Lockstep(self._now, self.warnings.append, patience)
        found.find_listeners()
        return found

    def _now(self) -> dict[str, set[bytes]]:
        return {name: set(processes) for name, processes in self.processes.items()}


def test_nothing_goes_out_before_all_have_answered():
    lockstep = Listeners("/a", "/b").lockstep()
    lockstep.expect(0, 4)
    assert not lockstep.has_room(0.0)
    lockstep.answer("/a", Answered(0, 4, 0))
    assert not lockstep.has_room(0.0)
    lockstep.answer("/b", Answered(0, 3, 0))
    assert not lockstep.has_room(0.0)
    lockstep.answer("/b", Answered(0, 4, 0))
    assert lockstep.has_room(0.0)


def test_an_answer_of_an_earlier_run_does_not_count():
    lockstep = Listeners("/a").lockstep()
    lockstep.expect(1, 0)
    lockstep.answer("/a", Answered(0, 900, 0))
    assert not lockstep.has_room(0.0)


def test_who_comes_late_owes_an_answer_from_the_next_samples_on():
    listeners = Listeners("/a")
    lockstep = listeners.lockstep()
    lockstep.expect(0, 0)
    listeners.processes["/b"] = {b"first"}
    lockstep.find_listeners()
    lockstep.answer("/a", Answered(0, 0, 0))
    assert lockstep.has_room(0.0)
    lockstep.expect(0, 1)
    lockstep.answer("/a", Answered(0, 1, 0))
    assert not lockstep.has_room(0.0)


def test_one_that_has_died_is_not_waited_for():
    listeners = Listeners("/a", "/b")
    lockstep = listeners.lockstep()
    lockstep.expect(0, 0)
    lockstep.answer("/a", Answered(0, 0, 0))
    del listeners.processes["/b"]
    assert lockstep.has_room(time.perf_counter() + 1.0)
    assert listeners.warnings == ["/b has gone, the replay no longer waits for it"]


def test_one_killed_and_started_again_under_its_name_owes_nothing_of_before():
    """The dead one is still found beside the new one, and goes some seconds later."""
    listeners = Listeners("/a")
    lockstep = listeners.lockstep()
    lockstep.expect(0, 7)
    listeners.processes["/a"].add(b"second")
    assert lockstep.has_room(time.perf_counter() + 1.0)
    assert listeners.warnings == ["/a has been started again, the replay no longer waits for what it owed before"]
    lockstep.expect(0, 8)
    listeners.processes["/a"].remove(b"first")
    assert not lockstep.has_room(time.perf_counter() + 0.5)
    lockstep.answer("/a", Answered(0, 8, 0))
    assert lockstep.has_room(0.0)
    assert len(listeners.warnings) == 1


def test_who_is_waited_for_is_said_within_a_second_and_once():
    listeners = Listeners("/a", "/b")
    lockstep = listeners.lockstep()
    for number in (7, 8):
        lockstep.expect(2, number)
        lockstep.answer("/a", Answered(2, number, 0))
        for later in (0.5, 0.9, 1.5):
            assert not lockstep.has_room(time.perf_counter() + later)
            assert len(listeners.warnings) == (later > 0.5 or number == 8)
    assert listeners.warnings == ["waiting for /b to answer sample 7 of run 2"]


def test_a_silent_one_is_gone_on_without_until_it_answers_again():
    listeners = Listeners("/a")
    lockstep = listeners.lockstep(patience=1.0)
    lockstep.expect(0, 0)
    assert not lockstep.has_room(time.perf_counter() + 0.5)
    assert lockstep.has_room(time.perf_counter() + 2.0)
    assert "has not answered sample 0 of run 0 for 1 s" in listeners.warnings[0]
    lockstep.expect(0, 1)
    assert lockstep.has_room(0.0)
    lockstep.answer("/a", Answered(0, 1, 0))
    lockstep.expect(0, 2)
    assert not lockstep.has_room(0.0)


def test_runs_with_load_and_without_record_the_same_messages(tmp_path):
    """Two runs, every other one under load; ten with LOCKSTEP_RUNS=10 make test PYTEST_ARGS="-k record_the_same"."""
    files = [tmp_path / str(k) / "estimates.mcap" for k in range(int(os.environ.get("LOCKSTEP_RUNS", "2")))]
    for file in files:
        file.parent.mkdir()
    runs = []
    for k, file in enumerate(files):
        runs.append(run_recorded_to(file, burning if k % 2 == 0 else nullcontext))
    assert all("121 samples sent in 121 messages" in run for run in runs)
    first, *others = [messages_by_topic(file) for file in files]
    assert all(other == first for other in others)
    assert [
        len(first[f"/{name}"]) for name in ("samples", "mrls/block/parameters", "constrained_kalman/block/parameters")
    ] == [121] * 3


def test_what_is_said_of_samples_is_compared_whatever_blocks_they_come_in(tmp_path):
    """An estimator in the place of a killed one says what it has caught up with in one block."""
    singly = recording_of(tmp_path / "singly.mcap", [(0, [1.0]), (1, [2.0])])
    again = recording_of(tmp_path / "again.mcap", [(0, [1.0]), (0, [1.0, 2.0])])
    otherwise = recording_of(tmp_path / "otherwise.mcap", [(0, [1.0]), (0, [1.5, 2.0])])
    fewer = recording_of(tmp_path / "fewer.mcap", [(0, [1.0])])
    assert said(again) == said(singly)
    assert said(otherwise) != said(singly)
    assert said(fewer) != said(singly)


def recording_of(file: Path, blocks: list[tuple[int, list[float]]]) -> Path:
    """Of one parameter: blocks that begin with a sample of this number."""
    with file.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("crash_msgs/msg/ParametersBlock", "ros2msg", b"")
        channel = writer.register_channel("/mrls/block/parameters", "cdr", schema)
        for number, values in blocks:
            times = [(number + k) * 1_000_000 for k in range(len(values))]
            block = ParametersBlock(number=number, time_ns=times, name=["front.stiffness"], value=values)
            block.std, block.status = [1.0] * len(values), [0] * len(values)
            writer.add_message(channel, log_time=0, publish_time=0, data=serialize_message(block))
        writer.finish()
    return file


def run_recorded_to(file: Path, load: Callable) -> str:
    """Replay in lock-step with two estimators, under load from the first sample on -> what it says at the end."""

    def started(module: str, *arguments: str) -> subprocess.Popen:
        command = [sys.executable, "-m", module, "--ros-args", *arguments]
        return subprocess.Popen(command, env=environment(), cwd=ROOT, stdout=subprocess.PIPE, text=True)

    model = ("-p", "model:=bags/frontal_abrupt.model.yaml")
    estimators = [
        started("crash_estimator.nodes.estimator_node", *model, "-p", f"method:={method}", "-r", f"__node:={method}")
        for method in ("mrls", "constrained_kalman")
    ]
    recorder = started("crash_replay.record_node", "-p", f"to:={file}", "-p", "wait_for:=2")
    replay = started(
        "crash_replay.replay_node", "-p", "bag:=bags/frontal_abrupt.mcap", "-p", "rate:=10.0", "-p", "block:=1",
        "-p", "lockstep:=true", "-p", "wait_for:=4", "-p", "wait_timeout:=200.0", "-p", "start_paused:=true",
    )  # fmt: skip
    try:
        with Listener() as listener:  # a fourth one
            wait_until(lambda: listener.states and listener.states[-1].subscribers == 4)
            with load():
                assert listener.call(Trigger, "resume").success
                told, _ = replay.communicate(timeout=240)
                assert replay.returncode == 0
                assert recorder.wait(timeout=60) == 0
        return told
    finally:
        for process in (*estimators, recorder, replay):
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
        for process in (*estimators, recorder, replay):
            process.communicate(timeout=30)
