"""What an estimator says on one topic, handed out in its order and whole. No ROS here.

What comes after a gap is held back until the gap is filled, or it is known that it cannot be.
"""

from collections import deque
from collections.abc import Callable
from typing import NamedTuple


class About(NamedTuple):
    """Which samples a message is about: number, ..., number + count - 1 of a pass over the test."""

    run: int
    number: int
    count: int  # type: ignore[assignment]  # hides the tuple's own method

    @property
    def end(self) -> int:
        return self.number + self.count


class InOrder:
    """The newest pass on one topic."""

    def __init__(self, hand_out: Callable[[bytes], None]):
        self.hand_out = hand_out
        self.held: deque[tuple[About, bytes]] = deque()
        self.run, self.first, self.next = -1, 0, 0  # the pass; its first sample; the next one to hand out
        self.said = 0  # the estimator has said everything on the samples before this one
        self.lost = 0  # samples of the pass that cannot be had

    def begin_test(self) -> None:
        """What follows is about another test, or about the same one from a new replay."""
        self._hand_out_held()
        self.run = -1

    def receive(self, about: About, data: bytes, first: int) -> None:
        """A message has come; first: number of the first sample of its pass."""
        starts_again = about.number == 0 < self.next  # a replay that was started anew begins at run 0 again
        if about.run != self.run or starts_again:
            self._begin(about.run, min(first, about.number))
        if about.end > self.next:
            self.held.append((about, data))
            self._work()

    def expect(self, run: int, first: int, said: int) -> None:
        """The estimator has said everything on this pass up to `said`: what has not come is not on its way."""
        if run != self.run:
            self._begin(run, first)
        self.said = said

    def gap(self) -> tuple[int, int] | None:
        """Samples start, ..., stop - 1 that are missing before anything more can be handed out."""
        stop = self.held[0][0].number if self.held else self.said
        return (self.next, stop) if self.next < stop else None

    def fill(self, about: About, data: bytes) -> None:
        """What was missing has been got, from its beginning on."""
        self.held.appendleft((about, data))
        self._work()

    def give_up(self, stop: int) -> None:
        """What is missing before number `stop` cannot be had."""
        self.lost += stop - self.next
        self.next = stop
        self._work()

    def has(self, run: int) -> int:
        """Samples of a pass that have been handed out."""
        return self.next - self.first - self.lost if run == self.run else 0

    def reached(self, run: int, number: int) -> bool:
        """Whether every sample of the pass before this one has been handed out, or is known to be lost."""
        return run == self.run and self.next >= number

    def _begin(self, run: int, first: int) -> None:
        self._hand_out_held()
        self.run, self.first, self.next, self.said, self.lost = run, first, first, 0, 0

    def _hand_out_held(self) -> None:
        while self.held:
            self.hand_out(self.held.popleft()[1])

    def _work(self) -> None:
        while self.held and self.held[0][0].number <= self.next:
            about, data = self.held.popleft()
            if about.end > self.next:
                self.next = about.end
                self.hand_out(data)
