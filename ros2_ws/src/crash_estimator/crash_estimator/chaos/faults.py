"""Carries out the faults of a case, each at its moment."""

import resource
import signal
import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Protocol

from .case import FINISHED, FULL_DISK, HANG_UP, KILL, LASTING, PLAYED, RESTART, STOP, Fault
from .members import Member, children_of, furthest_written, send

ROOM = 16384
"""Bytes that fit into any file though the disk is full: what a process says goes into one too."""


class Disturbed(Protocol):
    """The run."""

    def top(self, name: str) -> Member | None: ...  # a process that we have started ourselves
    def process(self, name: str) -> int: ...  # its number; 0: there is none (yet)
    def since_start(self, name: str) -> float: ...  # s since it was started

    @property
    def played(self) -> float: ...  # % of the samples
    @property
    def since_finish(self) -> float: ...  # s since the last sample; negative: not yet


class Faults:
    def __init__(self, faults: list[Fault], run: Disturbed):
        self.run, self.pending = run, [fault for fault in faults if fault.member]
        self.ends: list[tuple[float, Callable[[], None]]] = []  # when what is stopped or gone comes back
        self.log: list[str] = []

    @property
    def active(self) -> bool:
        return bool(self.ends)

    def look(self) -> None:
        now = time.monotonic()
        for fault in [fault for fault in self.pending if self._is_due(fault)]:
            if process := self.run.process(fault.member):
                self.pending.remove(fault)
                self._begin(fault, process, now)
        due = [end for end in self.ends if end[0] <= now]
        self.ends = [end for end in self.ends if end[0] > now]
        for _, come_back in due:
            come_back()

    def _is_due(self, fault: Fault) -> bool:
        if fault.anchor == PLAYED:
            return self.run.played >= fault.at
        passed = self.run.since_finish if fault.anchor == FINISHED else self.run.since_start(fault.member)
        return passed >= fault.at

    def _begin(self, fault: Fault, process: int, now: float) -> None:
        self.log.append(f"{fault.name}: process {process}, {self.run.played:.0f} % of the samples sent")
        top = self.run.top(fault.member)
        come_back: Callable[..., None] = _nothing_to_do
        if fault.kind == HANG_UP:
            top.hang_up()
        elif fault.kind in (KILL, RESTART) and top:
            top.kill()
            come_back = top.start
        elif fault.kind == STOP:
            send(process, signal.SIGSTOP)
            come_back = partial(send, process, signal.SIGCONT)
        elif fault.kind == FULL_DISK:
            for one in [process, *children_of(process)]:
                full = max(furthest_written(one), ROOM)
                with suppress(ProcessLookupError):  # it has ended meanwhile
                    resource.prlimit(one, resource.RLIMIT_FSIZE, (full, full))
        else:
            send(process, signal.SIGKILL)
        if fault.kind in LASTING:
            self.ends.append((now + fault.seconds, come_back))


def _nothing_to_do() -> None:
    pass
