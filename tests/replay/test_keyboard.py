"""Keys of the terminal that a replay runs in."""

import os
import pty
import signal
import subprocess
import sys
import termios
import time
from select import select

import pytest
from helpers_replay import environment, some_recording

from crash_replay.bag import write_bag
from crash_replay.keys import decode, next_rate


@pytest.mark.parametrize(
    ("data", "keys"),
    [
        (b" ", ["space"]),
        (b"\x1b[A\x1b[D", ["up", "left"]),
        (b"\x1bOC", ["right"]),
        (b"\x1b[1;2C", ["shift+right"]),
        (b"\x1b[H\x1b[F", ["home", "end"]),  # as xterm sends them,
        (b"\x1bOH\x1bOF", ["home", "end"]),  # and where a program has asked for application keys,
        (b"\x1b[1~\x1b[4~", ["home", "end"]),  # as tmux and screen do,
        (b"\x1b[7~\x1b[8~", ["home", "end"]),  # as rxvt does
        (b"\x1b[15~7", ["7"]),  # F5 means nothing
        ("l é".encode(), ["l", "space", "Ã", "©"]),
    ],
)
def test_keys_are_told_from_what_a_terminal_sends(data, keys):
    assert decode(data) == (keys, b"")


def test_a_key_that_has_come_by_half_waits_for_its_rest():
    keys, rest = decode(b"a\x1b[")
    assert keys == ["a"]
    assert decode(rest + b"B") == (["down"], b"")


def test_rates_go_in_steps_of_1_2_5_within_the_limits():
    assert [next_rate(1.0, True), next_rate(1.0, False), next_rate(0.03, True)] == [2.0, 0.5, 0.05]
    assert (next_rate(1000.0, True), next_rate(0.001, False)) == (1000.0, 0.001)


class Terminal:
    """A replay of 40 samples in a terminal of its own, paused before the first."""

    def __init__(self, bag):
        self.ours, theirs = pty.openpty()
        self.before = termios.tcgetattr(theirs)
        command = [sys.executable, "-m", "crash_replay.replay_node", "--ros-args", "-p", f"bag:={bag}"]
        command += ["-p", "start_paused:=true", "-p", "keep_alive:=true", "-p", "rate:=0.001"]
        self.process = subprocess.Popen(
            ["setsid", "--ctty", *command], stdin=theirs, stdout=theirs, stderr=theirs, env=environment()
        )
        self.theirs, self.shown = theirs, ""

    def press(self, keys: bytes, until: str) -> None:
        """Press keys and wait for a text to be shown after it."""
        start = len(self.shown)
        os.write(self.ours, keys)
        self.wait(until, start)

    def wait(self, text: str, start: int = 0, seconds: float = 60.0) -> None:
        limit = time.monotonic() + seconds
        while text not in self.shown[start:]:
            assert time.monotonic() < limit, f"{text!r} not shown in {self.shown[start:]!r}"
            if select([self.ours], [], [], 0.1)[0]:
                self.shown += os.read(self.ours, 65536).decode(errors="replace")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGKILL)
        self.process.wait()
        os.close(self.ours)
        os.close(self.theirs)


def test_a_replay_follows_the_keys_and_leaves_the_terminal_as_it_was(tmp_path):
    bag = write_bag(some_recording(), tmp_path / "b.mcap")
    with Terminal(bag) as terminal:
        terminal.wait("keys: space pause or resume")
        terminal.wait("sample 0 of 40")
        terminal.press(b"\x1b[C", "sample 1 of 40")
        terminal.press(b"\x1b[1;2C", "sample 11 of 40")
        terminal.press(b"\x1b[D", "sample 10 of 40")
        terminal.press(b"5", "sample 20 of 40")
        terminal.press(b"\x1b[4~", "sample 39 of 40")
        terminal.press(b"\x1b[1~", "sample 0 of 40")
        terminal.press(3 * b"\x1b[1;2C", "sample 30 of 40")
        terminal.press(b"\x1b[A", "rate 0.002")
        terminal.press(b"l", "loop")
        terminal.press(b"x", "no such key: 'x'")
        terminal.press(b" ", "playing")
        os.write(terminal.ours, b"q")
        assert terminal.process.wait(timeout=30) == 0
        assert termios.tcgetattr(terminal.theirs) == terminal.before
