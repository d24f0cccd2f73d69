"""Several recordings one after the other: each is a test of its own to those who listen."""

import signal
from dataclasses import replace

import pytest
from helpers_replay import Listener, Replay, some_recording, wait_until

from crash_replay.bag import write_bag


@pytest.fixture(scope="module")
def bags(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bags")
    tests = {name: some_recording(n) for name, n in (("first", 40), ("second", 30), ("third", 20))}
    named = {name: replace(one, test=replace(one.test, id=name)) for name, one in tests.items()}
    return [write_bag(one, folder / f"{name}.mcap") for name, one in named.items()]


def test_each_is_replayed_to_its_end(bags):
    with Listener() as listener, Replay(bags[0], then=bags[1:], wait_for=1) as replay:
        status, output, errors = replay.end()
        assert (status, errors) == (0, "")
        assert [line.split(" samples")[0] for line in output.splitlines()] == [
            "finished: 40", "finished: 30", "finished: 20",
        ]  # fmt: skip
        wait_until(lambda: len(listener.numbers()) == 90)
        assert [test.id for test in listener.tests] == ["first", "second", "third"]
        assert listener.numbers() == [(0, number) for n in (40, 30, 20) for number in range(n)]


def test_who_stops_one_stops_all(bags):
    with Listener() as listener, Replay(bags[0], then=bags[1:], wait_for=1, rate=0.01) as replay:
        wait_until(lambda: listener.messages)
        replay.process.send_signal(signal.SIGINT)
        status, output, _ = replay.end()
    assert status == 0 and output.count("\n") == 1 and "stopped before sample" in output


def test_what_is_wrong_with_a_later_one_is_said_before_the_first(bags, tmp_path):
    with Replay(bags[0], then=[bags[1], tmp_path / "none.mcap"]) as replay:
        status, output, errors = replay.end()
    assert (status, output) == (1, "") and errors == f"error: {tmp_path}/none.mcap: there is no such file or folder\n"
