"""The diagnosis in a process of its own, so that the node's callbacks never wait for it. No ROS here."""

import math
import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from functools import partial
from multiprocessing.connection import Connection, Pipe
from typing import NamedTuple

import numpy as np

from crash_replay.bag import read_bag
from crash_replay.fault import Fault, of_the_program
from crash_replay.recording import Channel, Recording, RecordingError, Test
from crash_replay.starting import held

from ..core.compile_cache import compiling_said
from ..core.diagnosis import DEFAULT, OnlineAnswer, OnlineDiagnosis, OnlineState, Tolerance, diagnose, final_answer
from ..core.effects import EFFECTS
from ..core.effects.effect import Effect
from ..core.effects.user import load_effects
from ..core.structure import ModelError, Structure

NICENESS = 10
"""On a busy machine the estimators go first, the ranking comes later."""

TRY_OUT = 200
"""Samples of noise, at 10 kHz."""


class Task(NamedTuple):
    structure: Structure
    recording: Recording  # as far as the samples go
    final: bool  # that was the last one: the offline answer
    tolerance: Tolerance = DEFAULT  # of the final answer: what is good enough
    seconds: float = math.inf  # of the final answer: after which nothing more is tried


class Answerer:
    """Answers tasks in this process, one after the other; what an update leaves serves the next one."""

    def __init__(self, effects: Mapping[str, Effect], others: Sequence[Recording] = ()):
        """others: recordings of the same structure that are used with the replayed one."""
        self.effects, self.others = effects, others
        self.live: OnlineDiagnosis | None = None
        self.state = OnlineState()
        self.samples = 0

    def answer(self, task: Task) -> OnlineAnswer | None:
        """None where the samples are too few. Raises ModelError or RecordingError."""
        structure, recording = task.structure, task.recording
        if task.final:
            found = diagnose(structure, [recording, *self.others], self.effects, task.tolerance, task.seconds)
            return final_answer(found)
        live = self.live
        if live is None or live.structure != structure or live.test != recording.test or len(recording) < self.samples:
            live = OnlineDiagnosis(structure, recording.test, self.others, self.effects)
            self.live, self.state = live, live.init()
        self.samples = len(recording)
        self.state, answer = live.update(self.state, recording)
        return answer

    def try_out(self, structure: Structure) -> None:
        """An update on noise: it gets the compiled code ready."""
        channels = {name: Channel(name, quantity) for _, name, quantity in structure.channels()}
        values = np.random.default_rng(0).normal(size=(TRY_OUT, len(channels)))
        time_ns = np.arange(-TRY_OUT // 2, TRY_OUT // 2) * 100_000
        recording = Recording(Test("try-out", tuple(channels.values())), time_ns, values)
        with suppress(Exception):  # an effect may need a channel of the test; what is at fault fails on the test, too
            self.answer(Task(structure, recording, final=False))


DEATHS = 3
"""Times that the process may end by itself, in all, before no other one is started: a killed one is not its own fault."""


class WorkerError(Fault):
    """The process ends again and again; the message is one line."""


class Reply(NamedTuple):
    answer: OnlineAnswer | None
    error: str = ""  # one line


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
        command = [sys.executable, "-c", f"from {__name__} import main; main({its.fileno()})"]
        with held(signal.SIGINT, signal.SIGHUP):  # for good: they are for the node, which ends this
            self.process = subprocess.Popen(command, pass_fds=[its.fileno()], stdin=subprocess.DEVNULL)
        its.close()
        self._send(self.setup)
        self.busy, self.wanted, self.long = True, False, False  # until it says that it is there


def main(fd: int) -> None:
    """Answer what comes through the pipe, until the node at its other end has gone."""
    os.nice(NICENESS)
    with Connection(fd) as node:
        said = node_says(node)
        if (setup := next(said, None)) is None:
            return
        structure, effects_file, bags = setup
        effects = EFFECTS | (load_effects(effects_file) if effects_file else {})
        with compiling_said(partial(print, "diagnosis:", file=sys.stderr, flush=True)):
            Answerer(effects).try_out(structure)
        answerer = Answerer(effects, [read_bag(bag) for bag in bags])
        with suppress(ConnectionError):  # it has gone
            node.send(Reply(None))
            for task in said:
                node.send(_reply(answerer, task))


def node_says(node: Connection) -> Iterator[tuple | Task]:
    """What comes from it as long as it is there: killed, it may leave half a message."""
    while True:
        try:
            content = node.recv()
        except (EOFError, OSError):
            return
        yield content


def _reply(answerer: Answerer, task: Task) -> Reply:
    try:
        return Reply(answerer.answer(task))
    except (ModelError, RecordingError) as error:
        return Reply(None, " ".join(str(error).split()))
    except np.linalg.LinAlgError as error:
        return Reply(None, f"the fit broke down ({error})" if task.final else "")
    except Exception as error:  # ours, or in a user's effect
        return Reply(None, f"the diagnosis failed: {of_the_program(error)}")
