"""The samples of a test that have been seen, by their numbers, in whatever order and however often they came."""

from collections.abc import Iterator
from typing import NamedTuple, Self

import numpy as np

from crash_replay.recording import Recording, Sample, Test


class Rows(NamedTuple):
    """Consecutive samples as arrays."""

    number: int  # of the first
    time_ns: np.ndarray  # (k,) int64 ns since the impact
    values: np.ndarray  # (k, channels) SI

    @property
    def end(self) -> int:
        """Number after the last."""
        return self.number + len(self.time_ns)

    def first(self, count: int) -> Self:
        return Rows(self.number, self.time_ns[:count], self.values[:count])

    def without(self, count: int) -> Self:
        """All but the first `count`."""
        return Rows(self.number + count, self.time_ns[count:], self.values[count:])

    def samples(self) -> Iterator[Sample]:
        for k, (time_ns, values) in enumerate(zip(self.time_ns.tolist(), self.values)):
            yield Sample(self.number + k, time_ns, values)


class Kept:
    """Grows with what it is given; a sample that comes again replaces itself."""

    def __init__(self, test: Test, expected: int = 0):
        """expected: samples in the whole recording, where that is known."""
        self.test = test
        self.seen = np.zeros(0, dtype=bool)
        self.time_ns = np.zeros(0, dtype=np.int64)
        self.values = np.zeros((0, len(test.channels)))
        self._grow(max(expected, 1))

    def put_rows(self, rows: Rows) -> None:
        first, end = rows.number, rows.end
        if end > len(self.seen):
            self._grow(max(end, 2 * len(self.seen)))
        self.seen[first:end] = True
        self.time_ns[first:end] = rows.time_ns
        self.values[first:end] = rows.values

    def gap(self, start: int, end: int) -> tuple[int, int] | None:
        """The first samples of number start, ..., end - 1 that have not been seen: start, stop. None: all have."""
        seen = self.seen[start:end]
        unseen = np.flatnonzero(~seen)
        if len(seen) < end - start:  # beyond what there has ever been room for
            unseen = np.concatenate([unseen, np.arange(len(seen), end - start)])
        if not len(unseen):
            return None
        last = int(np.argmax(np.diff(unseen, append=unseen[-1] + 2) > 1))
        return start + int(unseen[0]), start + int(unseen[last]) + 1

    def runs(self, start: int, end: int, longest: int) -> Iterator[Rows]:
        """The samples of number start, ..., end - 1 that have been seen, in pieces without a gap; views."""
        there = start + np.flatnonzero(self.seen[start:end])
        for piece in np.split(there, np.flatnonzero(np.diff(there) > 1) + 1):
            for k in range(0, len(piece), longest):
                yield self.rows(int(piece[k]), int(piece[min(k + longest, len(piece)) - 1]) + 1)

    def rows(self, start: int, end: int) -> Rows:
        """The samples of number start, ..., end - 1, all of which have been seen; views."""
        return Rows(start, self.time_ns[start:end], self.values[start:end])

    def missing(self, end: int) -> int:
        """How many of the samples before number `end` have not been seen."""
        return end - int(np.count_nonzero(self.seen[:end]))

    def numbers(self, end: int) -> np.ndarray:
        """Of the samples before number `end` that have been seen."""
        return np.flatnonzero(self.seen[:end])

    def until(self, end: int) -> Recording:
        """The samples before number `end` that have been seen, at least one; a copy."""
        there = self.numbers(end)
        return Recording(self.test, self.time_ns[there], self.values[there])

    def _grow(self, length: int) -> None:
        more = length - len(self.seen)
        self.seen = np.concatenate([self.seen, np.zeros(more, dtype=bool)])
        self.time_ns = np.concatenate([self.time_ns, np.zeros(more, dtype=np.int64)])
        self.values = np.concatenate([self.values, np.zeros((more, self.values.shape[1]))])
