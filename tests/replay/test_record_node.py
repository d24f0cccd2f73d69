"""`record` as a process: when it ends, what it says, and what is in its file then."""

import os
import signal
import time
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Thread

import pytest
from crash_msgs.msg import Attendance as Word
from crash_msgs.msg import Ranking, ReplayState
from crash_msgs.srv import Step
from helpers_record import Estimator, Record, messages, says_of_itself
from helpers_replay import Listener, Replay, wait_until
from helpers_waiting import PATIENCE

from crash_replay.bag import read_bag
from crash_replay.processes import this_host
from crash_replay.qos import SAID
from crash_replay.record_node import RecordError, main, opened


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
        opened(file)
    assert Path("there.mcap").read_text() == "kept"


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        (["to:=5"], "parameter to must be a text, got 5"),
        (["to:=e.mcap", "wait_for:=-1"], "wait_for"),
        (["to:=e.bag"], "must be a file that ends in .mcap, got 'e.bag'"),
        (["to:=e.mcap", "topics:=5"], "parameter topics must be a list of names, got 5"),
        (["to:=e.mcap", "regex:='('"], "parameter regex must be a regular expression, got '('"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(tmp_path, monkeypatch, node_ended, parameters, said):
    monkeypatch.chdir(tmp_path)
    status, output, errors = node_ended(main, "--ros-args", *(word for one in parameters for word in ("-p", one)))
    assert (status, output) == (1, "")
    assert errors.startswith("error: ") and said in errors and errors.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_where_nothing_came_no_file_is_left(tmp_path):
    with Record(tmp_path / "e.mcap", topics="/samples") as record:
        wait_until((tmp_path / "e.mcap").exists)
        time.sleep(0.5)
        status, output, errors = record.end(signal.SIGINT)
    assert (status, output) == (1, "") and errors.startswith("error: nothing came to be recorded")
    assert list(tmp_path.iterdir()) == []


def test_all_that_was_said_is_in_the_file_and_it_replays(bag, tmp_path):
    file = tmp_path / "e.mcap"
    with Record(file) as record, Estimator(), Replay(bag, rate=0.05, wait_for=2, wait_timeout=PATIENCE) as replay:
        assert replay.end()[0] == 0
        status, output, errors = record.end()
    assert (status, errors) == (0, "")
    found = messages(file)
    assert output == f"{file}: {found.total()} messages on {len(found)} topics, complete"
    assert [found[topic] for topic in ("/test", "/samples", "/fake/block/parameters", "/fake/block/residuals")] == [
        1,
        40,
        40,
        40,
    ]
    assert found["/attendance"] and found["/replay_state"]
    assert not any(topic.startswith("/channels") or topic == "/clock" for topic in found)
    assert says_of_itself(file) == {"complete": "true", "missing": ""}
    written, read = read_bag(bag), read_bag(file)
    assert read.test == written.test and (read.values == written.values)[4:].all()
    with Replay(file, rate=10.0) as replay:
        status, output, _ = replay.end()
    assert status == 0 and "finished: 40 samples sent" in output


def test_it_records_the_topics_that_are_asked_for(bag, tmp_path):
    file = tmp_path / "e.mcap"
    chosen = {"topics": "[channels/rib_*, test, samples, clock]", "exclude": "'*_vy'", "wait_for": 0}
    with Record(file, **chosen) as record, Replay(bag, rate=0.05, wait_for=1, wait_timeout=PATIENCE) as replay:
        assert replay.end()[0] == 0
        status, _, errors = record.end()
    assert (status, errors) == (0, "")
    found = messages(file)
    assert found.pop("/clock") >= 40
    assert found == {"/test": 1, "/samples": 40, "/channels/rib_ay": 40}


def test_what_was_not_replayed_is_missing_and_the_status_says_so(bag, tmp_path):
    """The replay is ended by a signal, before its last sample."""
    file = tmp_path / "e.mcap"
    with Record(file, wait_for=0) as record, Listener() as listener:
        with Replay(bag, start_paused=True, keep_alive=True, wait_for=2, wait_timeout=PATIENCE) as replay:
            wait_until(lambda: listener.states and listener.states[-1].subscribers == 2)
            assert listener.call(Step, "step", n=3).success
            wait_until(lambda: len(listener.numbers()) == 3)
            replay.interrupt()
        status, output, errors = record.end()
    assert (status, output) == (1, "")
    assert errors.startswith(f"incomplete: {file}: ") and errors.count("\n") == 0
    assert errors.endswith("; /samples: 3 of 40, without 3 to 39; /replay has left")
    assert messages(file)["/samples"] == 3
    assert says_of_itself(file) == {"complete": "false", "missing": errors.partition(" topics; ")[2]}


def test_a_channel_that_was_not_heard_from_the_beginning_is_missing_and_the_status_says_so(bag, tmp_path):
    """Samples that were sent before it came are asked for; of channels there is nothing to ask."""
    file = tmp_path / "e.mcap"
    with Listener() as listener:
        with Replay(bag, start_paused=True, keep_alive=True, wait_for=1, wait_timeout=PATIENCE) as replay:
            wait_until(lambda: listener.states and listener.states[-1].state == ReplayState.PAUSED)
            assert listener.call(Step, "step", n=3).success
            with Record(file, topics="[test, samples, channels/rib_ay]", wait_for=0) as record:
                wait_until(lambda: listener.states[-1].subscribers == 2)
                assert listener.call(Step, "step", n=37).success
                wait_until(lambda: [one.next for one in listener.states[-1].listeners if one.role == "record"] == [40])
                replay.interrupt()
                status, output, errors = record.end()
    assert (status, output) == (1, "")
    assert errors.endswith("; /channels/rib_ay: 37 of 40, without 0 to 2; /replay has left")


def test_what_an_estimator_said_and_did_not_come_is_asked_for_and_what_it_cannot_give_is_named(bag, tmp_path):
    file = tmp_path / "e.mcap"
    with Record(file) as record, Estimator(silent_from=20):
        with Replay(bag, rate=0.05, wait_for=2, wait_timeout=PATIENCE) as replay:
            assert replay.end()[0] == 0
        status, _, errors = record.end()
    assert status == 1
    assert "; /fake/block/parameters: 36 of 40, without 36 to 39 (samples 39 to 39 have not all been seen); " in errors
    assert messages(file)["/fake/block/parameters"] == 20 + 4  # 4 estimates in an answer


@contextmanager
def diagnosis(listener: Listener, after: float):
    """Says its last word so many s after the replay's."""
    total, done, ended = 40, [], Event()
    node = listener.node
    out = node.create_publisher(Ranking, "/diagnosis/ranking", SAID)
    words = node.create_publisher(Word, "attendance", SAID)

    def speak() -> None:
        ends_at = None
        while not ended.wait(0.2):
            next_ = len(listener.numbers())
            if next_ == total and ends_at is None:
                ends_at = time.monotonic() + after
            if ends_at and time.monotonic() > ends_at and not done:
                out.publish(Ranking(number=total - 1, final=True, text="the last word"))
                done.append(True)
            words.publish(
                Word(node="/diagnosis", role="diagnosis", ready=True, total=total, next=next_, done=bool(done),
                     host=this_host(), process=os.getpid())
            )  # fmt: skip

    thread = Thread(target=speak)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


def test_it_waits_for_the_last_word_of_a_diagnosis(bag, tmp_path):
    file = tmp_path / "e.mcap"
    with Record(file, wait_for=0) as record, Listener() as listener, diagnosis(listener, after=4.0):
        with Replay(bag, rate=0.05, wait_for=2, wait_timeout=PATIENCE) as replay:
            assert replay.end()[0] == 0
        status, _, errors = record.end()
    assert (status, errors) == (0, "")
    assert messages(file)["/diagnosis/ranking"] == 1
