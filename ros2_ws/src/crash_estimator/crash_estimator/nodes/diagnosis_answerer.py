"""The process that a `Worker` asks: it answers tasks, one after the other, as long as its node is there. No ROS
here."""

import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from functools import partial
from multiprocessing.connection import Connection
from typing import Any

import numpy as np

from crash_replay.bag import read_bag
from crash_replay.fault import of_the_program
from crash_replay.recording import Channel, Recording, RecordingError, Test

from ..core.compile_cache import compiling_said
from ..core.diagnosis import DEFAULT, OnlineAnswer, OnlineDiagnosis, OnlineState, diagnose, final_answer
from ..core.effects import EFFECTS
from ..core.effects.effect import Effect
from ..core.effects.user import load_effects
from ..core.structure import ModelError, Structure
from .diagnosis_worker import Reply, Task

NICENESS = 10
"""On a busy machine the estimators go first, the ranking comes later."""

TRY_OUT = 200
"""Samples of noise, at 10 kHz."""


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
            others, tolerance = self.others, task.tolerance or DEFAULT
            return final_answer(diagnose(structure, [recording, *others], self.effects, tolerance, task.seconds))
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


def node_says(node: Connection) -> Iterator[Any]:
    """What comes from it, the set-up and then tasks, as long as it is there: killed, it may leave half a message."""
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
