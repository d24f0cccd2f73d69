"""The demonstration's nodes, by their processes and their own words: who is there, who is lost, and why."""

import time
from collections.abc import Callable, Mapping

from crash_replay.attendance import Attendance, Word
from crash_replay.processes import is_stopped

from .children import Child

STOPPED = 120.0
"""s after which a process that something has stopped is not waited for any more."""
SILENT = 300.0
"""s after which one that runs and says nothing is not either: while it compiles or estimates all again it is silent."""
GRACE = 1.0
"""s after its end in which a process's last word may still come."""
STALLED = 2.0
"""s between two looks from which on it was this process that stood still."""


class Company:
    def __init__(
        self,
        children: Mapping[str, Child],
        words: Attendance,
        clock: Callable[[], float] = time.monotonic,
        stopped: Callable[[int], bool] = is_stopped,
    ):
        """children: by the names of their nodes."""
        self.children, self.words, self.clock, self.stopped = children, words, clock, stopped
        self.lost: dict[str, str] = {}  # who has died or was given up, and why
        self.ended_well: set[str] = set()
        self.let_go: set[str] = set()  # who may end
        self.moved = dict.fromkeys(children, clock())  # when a process was last seen not to be stopped
        self.ended: dict[str, float] = {}  # when a process was seen to have ended
        self.looked = self.back = clock()  # the last look; when this process went on after standing still

    def word(self, name: str) -> Word | None:
        """Its last one."""
        return self.words.word(f"/{name}")

    def there(self, name: str) -> bool:
        """Whether it was started and is waited for."""
        return name in self.children and name not in self.lost and name not in self.ended_well

    def look(self) -> list[str]:
        """A line on each that was lost since the last look."""
        now = self.clock()
        if now - self.looked > STALLED:
            self.back = now
            self.moved = dict.fromkeys(self.moved, now)
        self.looked = now
        found = {name: why for name in self.children if self.there(name) and (why := self._why_lost(name, now))}
        self.lost |= found
        return [f"{name} {why}" for name, why in found.items()]

    def how(self, name: str) -> str:
        """A few words on one that is waited for."""
        child, word = self.children[name], self.word(name)
        if child.status is None and self.stopped(child.process.pid):
            return f"stopped: kill -CONT {child.process.pid}"
        if word is None:
            return "starting"
        if word.ready:
            return "ready"
        return "looking for the others" if name == "viewer" else "compiling"

    def _why_lost(self, name: str, now: float) -> str:
        child = self.children[name]
        if child.status is not None:
            # its status is about what the others lack; where they lack nothing, its last word may come late
            ends_itself = name == "replay" and (child.status == 0 or self._has_left(name))
            if name in self.let_go or ends_itself:
                self.ended_well.add(name)
                return ""
            if now - self.ended.setdefault(name, now) < GRACE:
                return ""
            return f"has ended too early: {child.last_words()}"
        if not self.stopped(child.process.pid):
            self.moved[name] = now
        if now - self.moved[name] > STOPPED:
            return f"was stopped for {STOPPED:g} s and is ended now (it goes on with: kill -CONT {child.process.pid})"
        word = self.word(name)
        if word and word.ready and now - max(self.words.words[f"/{name}"][1], self.back) > SILENT:
            return f"has said nothing for {SILENT:g} s and is ended now (its output: {child.log})"
        return ""

    def _has_left(self, name: str) -> bool:
        """Whether it has said that it ends."""
        word = self.word(name)
        return word is not None and word.leaving
