"""The diagnosis in a process of its own, so that the node's callbacks never wait for it. No ROS here.

`diagnosis_answerer` is that process: what it computes with is not imported on this side.
"""

import signal
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from multiprocessing.connection import Pipe
from typing import TYPE_CHECKING, NamedTuple

from crash_replay.fault import Fault
from crash_replay.recording import Recording
from crash_replay.starting import held

from ..core.structure import Structure

if TYPE_CHECKING:
    from ..core.diagnosis import OnlineAnswer, Tolerance

ANSWERER = "crash_estimator.nodes.diagnosis_answerer"


class Task(NamedTuple):
    structure: Structure
    recording: Recording  # as far as the samples go
    final: bool  # that was the last one: the offline answer
    tolerance: "Tolerance | None" = None  # of the final answer: what is good enough, where somebody has said it
    seconds: float | None = None  # of the final answer: after which nothing more is tried; None: as of `diagnose`


class Reply(NamedTuple):
    answer: "OnlineAnswer | None"
    error: str = ""  # one line


DEATHS = 3
"""Times that the process may end by itself, in all, before no other one is started: a killed one is not its own
fault."""


class WorkerError(Fault):
    """The process ends again and again; the message is one line."""


class Worker:
    """An Answerer in another process, which is asked without waiting; one task at a time."""

    def __init__(self, structure: Structure, effects_file: str = "", bags: Sequence[str] = ()):
        """structure: to get ready with; effects_file: a user's own; bags: other recordings of the same structure."""
        self.setup = structure, effects_file, tuple(bags)
        self.deaths = 0
        self.task: Task | None = None  # the last one
        self.to_ask_again: Task | None = None  # one that died with its process, till the new one is there
        self._start()

    def ask(self, task: Task) -> None:
        """Only while it is not busy: then it takes the task from the pipe as fast as it is put there."""
        self.busy, self.wanted, self.long, self.task = True, True, task.final, task
        self._send(task)

    def reply(self) -> Reply | None:
        """What has come for the last task since the last look. Raises WorkerError."""
        if not self.busy or not self._pipe.poll():
            return None
        try:
            content = self._pipe.recv()
        except (EOFError, OSError):
            return self._ended()
        wanted, self.busy, self.wanted = self.wanted, False, False
        again, self.to_ask_again = self.to_ask_again, None
        if again:
            self.ask(again)
            return None
        return content if wanted else None

    def drop(self) -> None:
        """Nobody waits for the reply any more: an update is let finish, a final answer, which takes seconds, is not."""
        self.wanted, self.to_ask_again = False, None
        if self.busy and self.long:
            self.close()
            self._start()

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        self._pipe.close()

    def _send(self, content) -> None:
        with suppress(ConnectionError):  # killed while it had nothing to do: the next look finds it gone
            self._pipe.send(content)

    def _ended(self) -> Reply | None:
        """The process is gone: another one is asked the same. Raises WorkerError where that has happened too often."""
        status = self.process.wait()
        self._pipe.close()
        self.deaths += 1
        if self.deaths > DEATHS:
            raise WorkerError(f"the process of the diagnosis ended {self.deaths} times, at last with status {status}")
        again = (self.task if self.wanted else None) or self.to_ask_again
        self._start()
        self.to_ask_again = again
        return None

    def _start(self) -> None:
        self._pipe, its = Pipe()
        # run as __main__ it would send classes of that name
        command = [sys.executable, "-c", f"from {ANSWERER} import main; main({its.fileno()})"]
        with held(signal.SIGINT, signal.SIGHUP):  # for good: they are for the node, which ends this
            self.process = subprocess.Popen(command, pass_fds=[its.fileno()], stdin=subprocess.DEVNULL)
        its.close()
        self._send(self.setup)
        self.busy, self.wanted, self.long = True, False, False  # until it says that it is there
