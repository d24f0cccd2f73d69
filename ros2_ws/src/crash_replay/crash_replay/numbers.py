"""A set of numbers as spans, start to stop - 1: what comes in order takes one span however long it is."""

from bisect import bisect_left, bisect_right
from collections.abc import Iterable

Span = tuple[int, int]


class Numbers:
    def __init__(self, spans: Iterable[Span] = ()):
        self.starts: list[int] = []
        self.stops: list[int] = []
        for start, stop in spans:
            self.add(start, stop)

    def add(self, start: int, stop: int) -> None:
        """start, ..., stop - 1, whether some of them are there or not."""
        if start >= stop:
            return
        if self.stops and self.stops[-1] == start:
            self.stops[-1] = stop
            return
        # the spans that it touches become one with it
        low, high = bisect_left(self.stops, start), bisect_right(self.starts, stop)
        if low < high:
            start, stop = min(start, self.starts[low]), max(stop, self.stops[high - 1])
        self.starts[low:high], self.stops[low:high] = [start], [stop]

    @property
    def spans(self) -> list[Span]:
        return list(zip(self.starts, self.stops))

    def missing(self, start: int, stop: int) -> list[Span]:
        """The spans of start, ..., stop - 1 that are not there."""
        found, at = [], start
        for begin, end in self.spans[bisect_right(self.stops, start) :]:
            if at >= stop or begin >= stop:
                break
            if begin > at:
                found.append((at, begin))
            at = max(at, end)
        return [*found, (at, stop)] if at < stop else found

    def reach(self, start: int) -> int:
        """The first from `start` on that is not there."""
        k = bisect_right(self.starts, start) - 1
        return max(start, self.stops[k]) if k >= 0 else start

    def __len__(self) -> int:
        return sum(self.stops) - sum(self.starts)

    def __str__(self) -> str:
        return ", ".join(f"{a}" if b == a + 1 else f"{a} to {b - 1}" for a, b in self.spans)
