"""What `record` writes, and what it says when it cannot."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from crash_msgs import msg
from crash_msgs.srv import Step
from helpers_replay import Listener, Replay, environment, some_recording, wait_until
from mcap.reader import make_reader
from rclpy.serialization import serialize_message

from crash_replay.bag import write_bag
from crash_replay.message_types import encode_test
from crash_replay.record_node import RecordError, reserved, write
from crash_replay.recorder import Heard, Recorder, stamp_of

EVENTS, TEST = Heard("/a/events", "crash_msgs/msg/Event", False), Heard("/test", "crash_msgs/msg/TestInfo", True)


def event(time_ns: int, text: str) -> bytes:
    message = msg.Event(kind="jump", target="k", text=text)
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(time_ns, 1_000_000_000)
    return serialize_message(message)


def recorded(file: Path) -> list[tuple[str, int]]:
    with file.open("rb") as stream:
        return [(c.topic, m.log_time) for _, c, m in make_reader(stream).iter_messages(log_time_order=False)]


def test_a_stamp_is_read_before_and_after_1970():
    assert [stamp_of(event(t, "")) for t in (1_234_567_890, -5)] == [1_234_567_890, -5]


def test_messages_are_written_by_their_stamps_whenever_they_came(tmp_path):
    rng, files = np.random.default_rng(1), [tmp_path / str(k) / "e.mcap" for k in range(2)]
    for file in files:
        recorder = Recorder()
        other = EVENTS._replace(name="/b/events")
        # topics interleave as it happens; within one, order is kept
        queues = {topic: [event(1000 * k, f"{topic.name} {k}") for k in range(20)] for topic in (EVENTS, other)}
        recorder.hear(TEST, bytes(encode_test(some_recording(), 0)))
        while any(queues.values()):
            topic = (EVENTS, other)[rng.integers(2)]
            if queues[topic]:
                recorder.hear(topic, queues[topic].pop(0))
        file.parent.mkdir()
        recorder.write(file)
    assert files[0].read_bytes() == files[1].read_bytes()
    times = [time for _, time in recorded(files[0])]
    assert len(times) == 41
    assert times == sorted(times)


@pytest.mark.parametrize(
    ("file", "said"),
    [
        ("", "must be a file that ends in .mcap, got ''"),
        ("e.bag", "ends in .mcap"),
        ("no/e.mcap", "there is no folder no"),
        ("there.mcap", "exists already"),
        ("/proc/e.mcap", "/proc/e.mcap cannot be written"),
    ],
)
def test_a_file_that_cannot_be_written_is_refused_at_once(tmp_path, monkeypatch, file, said):
    monkeypatch.chdir(tmp_path)
    Path("there.mcap").write_text("kept")
    with pytest.raises(RecordError, match=said):
        reserved(file)
    assert Path("there.mcap").read_text() == "kept"


def test_where_nothing_came_no_file_is_left(tmp_path):
    file = reserved(str(tmp_path / "e.mcap"))
    with pytest.raises(RecordError, match="nothing came"):
        write(Recorder(), file)
    assert not file.exists()


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        (["to:=5"], "expecting type 'STRING'"),
        (["to:=e.mcap", "wait_for:=-1"], "wait_for"),
        (["to:=e.bag"], "must be a file that ends in .mcap, got 'e.bag'"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(tmp_path, parameters, said):
    command = [sys.executable, "-m", "crash_replay.record_node", "--ros-args"]
    for parameter in parameters:
        command += ["-p", parameter]
    ended = subprocess.run(command, env=environment(), cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert (ended.returncode, ended.stdout) == (1, "")
    assert ended.stderr.startswith("error: ") and said in ended.stderr and ended.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_it_records_the_samples_and_ends_when_the_replay_is_gone(tmp_path):
    """The replay is ended by a signal, before its last sample."""
    bag, file = write_bag(some_recording(), tmp_path / "b.mcap"), tmp_path / "e.mcap"
    command = [sys.executable, "-m", "crash_replay.record_node", "--ros-args", "-p", f"to:={file}", "-p", "wait_for:=0"]
    recorder = subprocess.Popen(command, env=environment(), stdout=subprocess.PIPE, text=True)
    try:
        with Replay(bag, start_paused=True, keep_alive=True, wait_for=2) as replay, Listener() as listener:
            wait_until(lambda: listener.states and listener.states[-1].subscribers == 2)
            assert listener.call(Step, "step", n=3).success
            wait_until(lambda: len(listener.numbers()) == 3)
            replay.interrupt()
        told, _ = recorder.communicate(timeout=30)
    finally:
        if recorder.poll() is None:
            recorder.kill()
            recorder.communicate()
    assert (recorder.returncode, told) == (0, f"{file}: 4 messages on 2 topics\n")
    assert [topic for topic, _ in recorded(file)] == ["/test", "/samples", "/samples", "/samples"]
