"""What `record` writes of the messages that come, and that its files replay."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from crash_msgs import msg
from helpers_replay import some_recording
from mcap.reader import make_reader
from rclpy.serialization import serialize_message

from crash_replay.bag import read_bag, write_bag
from crash_replay.message_types import encode_test
from crash_replay.recorded_topics import NUMBERED, About, about, instants_of, sayer_of, stamp_of, unreadable
from crash_replay.recorder import Heard, Recorder
from crash_replay.recording import RecordingError
from crash_replay.ros_messages import samples_to_msg, time_zero_ns
from crash_replay.same_messages import messages_by_topic

EVENTS, TEST = Heard("/a/events", "crash_msgs/msg/Event", False), Heard("/test", "crash_msgs/msg/TestInfo", True)
SAMPLES = Heard("/samples", "crash_msgs/msg/Samples", False)
WORDS = Heard("/attendance", "crash_msgs/msg/Attendance", True)
RANKINGS = Heard("/diagnosis/ranking", "crash_msgs/msg/Ranking", True)


def event(time_ns: int, text: str) -> bytes:
    message = msg.Event(kind="jump", target="k", text=text)
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(time_ns, 1_000_000_000)
    return serialize_message(message)


def found(file: Path) -> list[tuple[str, int, int, bytes]]:
    with file.open("rb") as stream:
        messages = make_reader(stream).iter_messages(log_time_order=False)
        return [(c.topic, m.log_time, m.publish_time, m.data) for _, c, m in messages]


def test_what_a_message_begins_with_is_read_in_both_byte_orders():
    assert [stamp_of(event(t, "")) for t in (1_234_567_890, -5)] == [1_234_567_890, -5]
    for kind in NUMBERED:
        message = getattr(msg, kind.rpartition("/")[2])(run=7, number=2**40, time_ns=[1, 2, 3])
        for frame in ("", "abc", "abcd"):
            message.header.frame_id = frame
            assert about(serialize_message(message)) == About(7, 2**40, 3)
            message.header.stamp.sec, message.header.stamp.nanosec = 5, 999_999_999
            assert instants_of(serialize_message(message)) == [5_999_999_999, 6_000_000_000, 6_000_000_001]
    assert sayer_of(serialize_message(msg.Attendance(node="/kalman", role="estimator"))) == "/kalman"
    big = bytes([0, 0, 0, 0]) + (5).to_bytes(4, "big") + (6).to_bytes(4, "big")
    assert stamp_of(big) == 5_000_000_006


@pytest.mark.parametrize("kind", [*sorted(NUMBERED), "crash_msgs/msg/Attendance"])
def test_garbage_is_told_in_a_line(kind):
    for data in (b"", b"\0\1\0\0", b"\0\1\0\0\xff\xff\xff\x7f1234567890"):
        assert unreadable(kind, data).startswith(f"expected {kind}, found {len(data)} bytes")


def test_the_order_is_that_of_arrival_and_times_are_of_writing_and_of_the_message(tmp_path):
    recorder = Recorder(tmp_path / "e.mcap")
    stamps = [3_000, 1_000, 2_000]
    for stamp in stamps:
        recorder.hear(EVENTS, event(stamp, "a"))
    recorder.hear(TEST, bytes(encode_test(some_recording(), 0)))
    recorder.close("")
    written = found(recorder.file)
    assert [(topic, time) for topic, _, time, _ in written[:3]] == [("/a/events", stamp) for stamp in stamps]
    logged = [time for _, time, _, _ in written]
    assert logged == sorted(logged) and logged[0] > 1_600_000_000 * 10**9
    assert written[3][1] == written[3][2]  # without a stamp


def test_messages_are_in_the_file_while_it_is_written(tmp_path, monkeypatch):
    recorder = Recorder(tmp_path / "e.mcap")
    recorder.hear(EVENTS, event(1, "a"))
    recorder.look()
    assert found(recorder.file) == []  # not yet: one chunk for each message would be many
    monkeypatch.setattr("crash_replay.recorder.SHOWN_AFTER", 0.0)
    recorder.look()
    assert len(found(recorder.file)) == 1
    recorder.close("")


@pytest.mark.parametrize("missing", ["", "/samples: 3 of 40"])
def test_the_file_says_whether_it_is_complete(tmp_path, missing):
    recorder = Recorder(tmp_path / "e.mcap")
    recorder.hear(EVENTS, event(1, "a"))
    recorder.close(missing)
    with recorder.file.open("rb") as stream:
        records = {record.name: record.metadata for record in make_reader(stream).iter_metadata()}
    assert records["crash_replay"] == {"complete": "false" if missing else "true", "missing": missing}


def test_where_the_disk_has_become_full_the_file_says_it_too(tmp_path, monkeypatch):
    recorder = Recorder(tmp_path / "e.mcap")
    recorder.hear(EVENTS, event(1, "kept"))
    recorder.writer.writer.flush()

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("crash_replay.recorder.SHOWN_AFTER", 0.0)
    monkeypatch.setattr("crash_replay.whole_file.os.posix_fallocate", full)
    monkeypatch.setattr("crash_replay.whole_file.ROOM", 0)
    rng = np.random.default_rng(1)
    with pytest.raises(OSError, match="No space"):
        for k in range(1000):
            recorder.hear(EVENTS, event(k, rng.bytes(20_000).hex()))
    recorder.give_up("No space left on device: the recording ends here")
    assert found(recorder.file)[0][2] == 1
    with recorder.file.open("rb") as stream:
        (record,) = make_reader(stream).iter_metadata()
    assert record.metadata["missing"].startswith("No space left")


def test_what_is_kept_for_who_joins_late_is_written_once(tmp_path):
    recorder = Recorder(tmp_path / "e.mcap")
    words = [
        serialize_message(msg.Attendance(node=node, next=number))
        for node, number in [("/a", 1), ("/b", 1), ("/a", 2), ("/b", 1), ("/a", 2), ("/a", 1)]
    ]
    assert [recorder.hear(WORDS, word) for word in words] == [True, True, True, False, False, True]
    rankings = [serialize_message(msg.Ranking(number=k)) for k in range(5)]
    assert [recorder.hear(RANKINGS, data) for data in [*rankings, *rankings]] == [True] * 5 + [False] * 5
    assert [recorder.hear(EVENTS, event(1, "a")) for _ in range(2)] == [True, True]
    recorder.close("")
    assert len(found(recorder.file)) == 4 + 5 + 2


def samples(recording, start: int, stop: int, run: int) -> bytes:
    return serialize_message(samples_to_msg(recording, start, stop, run, time_zero_ns(recording)))


def recorded(file: Path, recording, spans) -> Path:
    """Samples of these (start, stop, run), recorded one message after the other."""
    recorder = Recorder(file)
    recorder.hear(TEST, bytes(encode_test(recording, time_zero_ns(recording))))
    for span in spans:
        recorder.hear(SAMPLES, samples(recording, *span))
    recorder.close("")
    return file


def assert_same(read, written):
    assert read.test == written.test
    np.testing.assert_array_equal(read.time_ns, written.time_ns)
    np.testing.assert_array_equal(read.values, written.values)


def test_a_recording_replays_whatever_passes_are_in_it(tmp_path):
    written = read_bag(write_bag(some_recording(), tmp_path / "b.mcap"))
    assert_same(read_bag(recorded(tmp_path / "one.mcap", written, [(k, k + 1, 0) for k in range(40)])), written)
    several = [(0, 20, 0), (10, 15, 1), (30, 40, 2), (0, 25, 3), (20, 30, 3)]
    assert_same(read_bag(recorded(tmp_path / "several.mcap", written, several)), written)


def test_samples_that_are_missing_are_noted(tmp_path):
    written = some_recording()
    read = read_bag(recorded(tmp_path / "e.mcap", written, [(0, 10, 0), (15, 40, 0)]))
    np.testing.assert_array_equal(read.values, np.delete(written.values, range(10, 15), axis=0))
    assert read.test.notes == (*written.test.notes, "35 of the 40 samples that the test had are in the bag")


def test_what_cannot_be_one_test_is_refused_in_a_line(tmp_path):
    one, other = some_recording(seed=5), some_recording(seed=6)
    recorder = Recorder(tmp_path / "two.mcap")
    recorder.hear(TEST, bytes(encode_test(one, time_zero_ns(one))))
    recorder.hear(SAMPLES, samples(one, 0, 9, 0))
    recorder.hear(SAMPLES, samples(other, 4, 40, 0))
    recorder.close("")
    with pytest.raises(RecordingError, match=r"two.mcap: topic /samples: sample 4 comes twice .* there are two tests"):
        read_bag(tmp_path / "two.mcap")
    fewer = replace(one, test=replace(one.test, channels=one.test.channels[:2]), values=one.values[:, :2])
    recorder = Recorder(tmp_path / "fewer.mcap")
    recorder.hear(TEST, bytes(encode_test(one, time_zero_ns(one))))
    recorder.hear(SAMPLES, samples(fewer, 0, 3, 0))
    recorder.close("")
    with pytest.raises(RecordingError, match=r"expected 18 values \(3 instants of 6 channels\), found 6"):
        read_bag(tmp_path / "fewer.mcap")


def test_a_file_that_was_cut_off_replays_as_far_as_it_goes(tmp_path, monkeypatch):
    """As kill -9 leaves it: it is never ended."""
    monkeypatch.setattr("crash_replay.recorder.SHOWN_AFTER", 0.0)
    written = some_recording()
    recorder = Recorder(tmp_path / "e.mcap")
    recorder.hear(TEST, bytes(encode_test(written, time_zero_ns(written))))
    for k in range(30):
        recorder.hear(SAMPLES, samples(written, k, k + 1, 0))
    read = read_bag(tmp_path / "e.mcap")
    np.testing.assert_array_equal(read.values, written.values[:30])
    assert read.test.notes[-1] == "30 of the 40 samples that the test had are in the bag"
    recorder.close("")


def test_recordings_are_compared_by_what_is_said_of_samples(tmp_path):
    written, files = some_recording(), []
    for name in ("one", "two"):
        recorder = Recorder(tmp_path / f"{name}.mcap")
        for k in range(3):
            if name == "two":
                recorder.hear(WORDS, serialize_message(msg.Attendance(node="/a", next=k)))
            recorder.hear(SAMPLES, samples(written, k, k + 1, 0))
        recorder.close("")
        files.append(messages_by_topic(recorder.file))
    assert files[0] == files[1] and list(files[0]) == ["/samples"]
    stamps = (written.time_ns[:3] + time_zero_ns(written)).tolist()
    assert [time for time, _ in files[0]["/samples"]] == stamps
