"""Lock-step: the next samples go out when every listener has answered the last ones. No ROS here.

A listener is a node that publishes answers. One that comes late owes answers from the next samples on; one
that dies, or does not answer for long, is gone on without, so that the replay never waits for ever.
"""

import time
from collections.abc import Callable, Mapping, Set
from threading import Condition
from typing import NamedTuple

LOOK_AFTER = 0.2
"""Seconds without an answer after which to look whether the listener is still there."""
SAY_AFTER = 0.8
"""Seconds without an answer after which it is said, once, whose is missing."""


class Answered(NamedTuple):
    """What a listener has told."""

    run: int
    number: int  # of the last sample it has answered
    missed: int  # samples it did not get, in all


Listeners = Mapping[str, Set[bytes]]
"""Name -> the processes that listen under it, by what the middleware knows them by."""


class Lockstep:
    """`expect` and `has_room` are of the thread that sends, `answer` comes from another."""

    def __init__(self, listeners: Callable[[], Listeners], warn: Callable[[str], None], patience: float):
        """listeners: those there are now; patience: s to wait for one that is there but does not answer."""
        self.listeners, self.warn, self.patience = listeners, warn, patience
        self.changed = Condition()
        self.known: Listeners = {}
        self.dropped: set[str] = set()  # there, but silent
        self.said: set[str] = set()  # those who have been waited for so long
        self.owing: set[str] = set()  # those whose answer to the last samples is still to come
        self.answers: dict[str, Answered] = {}
        self.last = (0, -1)  # run and number of the last sample sent
        self.since = self.look_at = 0.0

    def find_listeners(self) -> None:
        """Look who is there now: who came owes answers from the next samples on, who went owes none."""
        there = self.listeners()
        with self.changed:
            gone = self.known.keys() - there.keys()
            again = {name for name in self.known.keys() & there.keys() if there[name] - self.known[name]}
            self.known = there
            self.owing -= gone | again
            self.dropped -= gone | again
            self.said -= gone | again
        for name in sorted(gone):
            self.warn(f"{name} has gone, the replay no longer waits for it")
        for name in sorted(again):
            self.warn(f"{name} has been started again, the replay no longer waits for what it owed before")

    def told(self) -> dict[str, Answered]:
        """What each listener that is there has told last."""
        with self.changed:
            return {name: self.answers[name] for name in sorted(self.known.keys() & self.answers.keys())}

    def expect(self, run: int, number: int) -> None:
        """Samples up to `number` are about to be sent."""
        with self.changed:
            self.last, self.owing = (run, number), self.known.keys() - self.dropped
        self.since = time.perf_counter()
        self.look_at = self.since + LOOK_AFTER

    def answer(self, name: str, answered: Answered) -> None:
        """A listener has published everything up to a sample."""
        with self.changed:
            self.answers[name] = answered
            self.dropped.discard(name)
            if (answered.run, answered.number) >= self.last:
                self.owing.discard(name)
                if not self.owing:
                    self.changed.notify_all()

    def has_room(self, now: float) -> bool:
        """Whether nobody owes an answer at the wall time `now`."""
        if self.owing and now > self.look_at:
            self.look_at = now + LOOK_AFTER
            self.find_listeners()
            if self.owing and now - self.since > self.patience:
                self._drop()
            elif now - self.since > SAY_AFTER:
                self._say()
        return not self.owing

    def wait(self, seconds: float) -> None:
        """Wait until all have answered, at most so long."""
        with self.changed:
            if self.owing:
                self.changed.wait(seconds)

    def _say(self) -> None:
        run, number = self.last
        late = sorted(self.owing - self.said)
        self.said |= set(late)
        if late:
            self.warn(f"waiting for {', '.join(late)} to answer sample {number} of run {run}")

    def _drop(self) -> None:
        with self.changed:
            silent = sorted(self.owing)
            self.dropped |= self.owing
            self.owing = set()
        run, number = self.last
        for name in silent:
            self.warn(
                f"{name} has not answered sample {number} of run {run} for {self.patience:g} s: going on without it "
                "until it answers again"
            )
