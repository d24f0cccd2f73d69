"""What `record` writes, and what it says when it cannot."""

from pathlib import Path

import numpy as np
import pytest
from crash_msgs import msg
from mcap.reader import make_reader
from helpers_replay import some_recording
from rclpy.serialization import serialize_message

from crash_replay.message_types import encode_test
from crash_replay.record_node import wrong_with
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
    [("", "must be a file that ends in .mcap"), ("e.bag", "ends in .mcap"), ("no/e.mcap", "there is no folder"), ("there.mcap", "exists already")],
)  # fmt: skip
def test_a_file_that_cannot_be_written_is_refused_at_once(tmp_path, monkeypatch, file, said):
    monkeypatch.chdir(tmp_path)
    Path("there.mcap").touch()
    assert said in wrong_with(Path(file))


def test_a_new_name_is_accepted(tmp_path):
    assert wrong_with(tmp_path / "e.mcap") == ""
