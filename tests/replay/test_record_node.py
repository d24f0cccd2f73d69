"""`record` as a process: when it ends, what it says, and what is in its file then."""

import os
import resource
import signal
import subprocess
import sys
import time
from collections import Counter
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Thread

import pytest
from crash_msgs.msg import Attendance as Word
from crash_msgs.msg import ParametersBlock, Ranking, ResidualsBlock
from crash_msgs.srv import GetEstimates, Step
from helpers_replay import DOMAIN, Listener, Replay, environment, some_recording, wait_until
from helpers_waiting import PATIENCE
from mcap.reader import make_reader

from crash_replay import record_killed
from crash_replay.attending import Attending, Progress
from crash_replay.bag import read_bag, write_bag
from crash_replay.processes import this_host
from crash_replay.qos import SAID, STREAM
from crash_replay.record_node import RecordError, opened


def messages(file: Path) -> Counter:
    with file.open("rb") as stream:
        return Counter(channel.topic for _, channel, _ in make_reader(stream).iter_messages())


def says_of_itself(file: Path) -> dict[str, str]:
    with file.open("rb") as stream:
        return next(r.metadata for r in make_reader(stream).iter_metadata() if r.name == "crash_replay")


class Record:
    """`record` with its output; killed with the test."""

    def __init__(self, file: Path, limit: int | None = None, **parameters):
        """limit: bytes that it may write into a file."""
        command = [sys.executable, "-m", "crash_replay.record_node", "--ros-args", "-p", f"to:={file}"]
        for name, value in parameters.items():
            command += ["-p", f"{name}:={value}"]
        limited = (lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))) if limit else None
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        self.process = subprocess.Popen(command, env=environment(), preexec_fn=limited, **pipes)

    def end(self, number: int = 0, timeout: float = PATIENCE) -> tuple[int, str, str]:
        """Its exit status, output and errors without what it logs."""
        if number:
            self.process.send_signal(number)
        output, errors = self.process.communicate(timeout=timeout)
        logged = [line for line in errors.splitlines() if not line.startswith("[") and "RTPS_" not in line]
        return self.process.returncode, output.strip(), "\n".join(logged)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
            self.process.communicate()


class Estimator(Listener):
    """Says something on every sample it hears, and takes part."""

    def __init__(self, name: str = "fake", silent_from: int = 10**9):
        """silent_from: number of the sample from which on nothing is published, though it can be had again."""
        super().__init__(name)
        self.next, self.silent_from = 0, silent_from
        node = self.node
        self.out = [node.create_publisher(kind, f"~/block/{topic}", STREAM) for kind, topic in self.kinds.items()]
        node.create_service(GetEstimates, "~/get_estimates", self._again)
        self.attending = Attending(node, "estimator", self._progress)
        self.executor.wake()

    kinds = {ParametersBlock: "parameters", ResidualsBlock: "residuals"}

    def _progress(self) -> Progress:
        total = self.tests[-1].samples if self.tests else 0
        return Progress(0, total, self.next, done=bool(total) and self.next == total)

    def _on_samples(self, message) -> None:
        super()._on_samples(message)
        for kind, publisher in zip(self.kinds, getattr(self, "out", [])):
            if message.number < self.silent_from:
                publisher.publish(kind(run=message.run, number=message.number, time_ns=message.time_ns))
        self.next = message.number + len(message.time_ns)

    def _again(self, request, response):
        if request.start >= 36:
            response.message = f"samples {request.start} to {request.stop - 1} have not all been seen"
            return response
        response.success = True
        for kind, topic in self.kinds.items():
            times = [0] * min(4, request.stop - request.start)
            setattr(response, topic, kind(run=request.run, number=request.start, time_ns=times))
        return response


@pytest.fixture
def bag(tmp_path):
    return write_bag(some_recording(), tmp_path / "b.mcap")


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
        assert record.end()[0] == 0
    assert messages(file) == {"/test": 1, "/samples": 40, "/channels/rib_ay": 40, "/clock": 40}


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


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_a_signal_ends_it_in_time_with_a_whole_file(bag, tmp_path, number):
    file = tmp_path / "e.mcap"
    with Record(file, wait_for=0) as record:
        with Replay(bag, rate=0.01, wait_for=1, wait_timeout=PATIENCE):
            wait_until(lambda: file.exists() and messages(file)["/samples"] > 5)
            began = time.monotonic()
            status, _, errors = record.end(number)
            assert time.monotonic() - began < 5.0
    assert status == 1 and "record was told to end" in errors and errors.count("\n") == 0
    with file.open("rb") as stream:
        assert make_reader(stream).get_summary().statistics.message_count == messages(file).total()


def test_where_the_disk_is_full_it_says_so_and_the_file_can_be_read(tmp_path):
    """A limit on the file's size stands for the disk's."""
    bag, file = write_bag(some_recording(30_000), tmp_path / "b.mcap"), tmp_path / "e.mcap"
    with Record(file, limit=3 << 19, wait_for=0) as record:
        with Replay(bag, rate=10.0, wait_for=1, wait_timeout=PATIENCE):
            status, output, errors = record.end()
    assert (status, output) == (1, "")
    assert errors == f"error: {file}: File too large: the recording ends here; what came before can be read"
    assert len(read_bag(file)) > 1000


def test_stopped_for_longer_than_the_middleware_waits_it_asks_for_what_it_missed(tmp_path):
    recording = some_recording(1500)
    bag, file = write_bag(recording, tmp_path / "b.mcap"), tmp_path / "e.mcap"
    with Record(file, wait_for=0) as record:
        with Replay(bag, rate=0.1, wait_for=1, wait_timeout=PATIENCE) as replay:
            wait_until(lambda: file.exists() and messages(file)["/samples"] > 100)
            record.process.send_signal(signal.SIGSTOP)
            time.sleep(9.0)
            before = messages(file)["/samples"]
            record.process.send_signal(signal.SIGCONT)
            replay.end()
        status, output, errors = record.end()
    assert (status, errors) == (0, ""), output
    assert before < 1000
    assert len(read_bag(file)) == 1500


def test_killed_at_any_moment_its_file_can_be_read_and_lacks_next_to_nothing(monkeypatch):
    """Five moments; fifty: `python -m crash_replay.record_killed`, which asks for half a second.

    Here it is 5 s: beside other tests `record` may get no processor for longer than half a second (3 of 50 did not at a
    load of 20), and no test fails by the clock; what it holds back longer than that it would hold back for ever.
    """
    for name, value in {**environment(), "ROS_DOMAIN_ID": str(DOMAIN)}.items():
        monkeypatch.setenv(name, value)
    found = list(record_killed.kills(5, seed=3))
    assert all(not killed.fault and killed.oldest_missing < 5.0 for killed in found), found
    assert sum(killed.messages for killed in found) > 1000
