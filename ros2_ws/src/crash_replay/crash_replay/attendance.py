"""Who takes part in a replay, by their own words on `attendance`: ready, how far, what is missing. No ROS here.

A node is the only one who knows whether it can work and what it has dealt with. What it cannot say is that it is
gone: that is known from its process, where it runs on this machine, and from its silence elsewhere.
"""

import time
from collections.abc import Callable, Iterable
from enum import IntEnum
from typing import NamedTuple

from .processes import has_ended, is_stopped, this_host

PERIOD = 0.5
"""s between two words of a node."""
SILENT = 5.0
"""s without a word after which a node counts as silent: ten of its words have not come."""
GIVEN_UP = 60.0
"""s without a word after which a node of another machine, whose process cannot be looked at, counts as gone."""


class Word(NamedTuple):
    """What a node says of itself; the fields of crash_msgs/Attendance."""

    node: str
    role: str
    host: str
    process: int
    ready: bool = False
    run: int = 0
    total: int = 0  # samples; 0: knows of no test
    next: int = 0  # has dealt with every sample before this one, or knows that it cannot have it
    missing: int = 0  # of those before next
    done: bool = False  # has said its last word on this pass
    leaving: bool = False
    reason: str = ""


class State(IntEnum):
    """As in crash_msgs/Listener."""

    PREPARING = 0
    FOLLOWING = 1
    COMPLETE = 2
    LEFT = 3
    SILENT = 4
    KILLED = 5


GONE = (State.LEFT, State.KILLED)


class Attendance:
    """The last word of each node."""

    def __init__(
        self, clock: Callable[[], float] = time.monotonic, host: str = "", ended=has_ended, stopped=is_stopped
    ):
        """host: this machine; ended, stopped: of a process of it."""
        self.clock, self.host = clock, host or this_host()
        self.ended, self.stopped = ended, stopped
        self.words: dict[str, tuple[Word, float]] = {}  # by node, and when it came

    def hear(self, word: Word) -> None:
        self.words[word.node] = word, self.clock()

    def forget(self, names: Iterable[str]) -> None:
        for name in names:
            self.words.pop(name, None)

    def word(self, name: str) -> Word | None:
        found = self.words.get(name)
        return found[0] if found else None

    def silence(self, name: str) -> float:
        """s since its last word."""
        return self.clock() - self.words[name][1]

    def names(self, *roles: str) -> list[str]:
        """Of the nodes that have said a word; of these roles only, where any are given."""
        return sorted(name for name, (word, _) in list(self.words.items()) if not roles or word.role in roles)

    def state(self, name: str, run: int = 0, sent: int = 0) -> State:
        """What it is doing, where the samples before number `sent` of pass `run` have gone out."""
        word, silence = self.words[name][0], self.silence(name)
        if word.leaving:
            return State.LEFT
        if silence > 2 * PERIOD and (self.ended(word.process) if word.host == self.host else silence > GIVEN_UP):
            return State.KILLED
        if silence > SILENT:
            return State.SILENT
        if not word.ready:
            return State.PREPARING
        return State.COMPLETE if (word.run, word.next) >= (run, sent) else State.FOLLOWING

    def there(self, name: str) -> bool:
        """Whether it has said a word and has neither left nor been killed."""
        return name in self.words and self.state(name) not in GONE

    def lacks(self, name: str, run: int, sent: int) -> str:
        """What it does not have of the samples before number `sent` of pass `run`, and why; "" where it has all."""
        word, state = self.words[name][0], self.state(name, run, sent)
        if word.run == run and word.next >= sent:
            return f"{word.missing} of {sent} samples missing{_because(word.reason)}" if word.missing else ""
        has = max(0, word.next - word.missing) if word.run == run else 0
        return f"{has} of {sent} samples{_because(word.reason or self.how(name, state))}"

    def how(self, name: str, state: State) -> str:
        """A few words on one that does not follow."""
        word = self.words[name][0]
        if state == State.SILENT:
            stopped = word.host == self.host and self.stopped(word.process)
            return f"{'stopped' if stopped else 'silent'} for {self.silence(name):.0f} s"
        words = {State.PREPARING: "not ready yet", State.LEFT: "has left", State.KILLED: "was killed"}
        return words.get(state, "still at work")


def _because(reason: str) -> str:
    return f" ({reason})" if reason else ""
