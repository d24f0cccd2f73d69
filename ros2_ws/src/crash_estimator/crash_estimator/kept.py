"""The samples of a test that have been seen, by their numbers, in whatever order and however often they came."""

from collections.abc import Iterator
from typing import NamedTuple

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

    def first(self, count: int) -> "Rows":
        return Rows(self.number, self.time_ns[:count], self.values[:count])

    def without(self, count: int) -> "Rows":
        """All but the first `count`."""
        return Rows(self.number + count, self.time_ns[count:], self.values[count:])

    def samples(self) -> Iterator[Sample]:
        for k, (time_ns, values) in enumerate(zip(self.time_ns.tolist(), self.values)):
            yield Sample(self.number + k, time_ns, values)


AT_FIRST = 4096
"""Samples that there is room for from the beginning."""


class Kept:
    """Grows with what it is given, not with what is said to come; a sample that comes again replaces itself."""

    def __init__(self, test: Test):
        self.test = test
        self.seen = np.zeros(0, dtype=bool)
        self.time_ns = np.zeros(0, dtype=np.int64)
        self.values = np.zeros((0, len(test.channels)))
        self.end = 0  # number after the last that has been seen
        self._grow(AT_FIRST)

    def put_rows(self, rows: Rows) -> None:
        first, end = rows.number, rows.end
        if end > len(self.seen):
            self._grow(max(end, 2 * len(self.seen)))
        self.end = max(self.end, end)
        self.seen[first:end] = True
        self.time_ns[first:end] = rows.time_ns
        self.values[first:end] = rows.values

    def agrees(self, number: int, time_ns: np.ndarray) -> bool:
        """Whether these may be the times of samples number, number + 1, ..., by those that have been seen.

        time_ns: (k,) increasing. Samples of another test, or of one whose clock went wrong, do not.
        """
        if number >= self.end:  # the next ones, as nearly always
            return not self.end or bool(self.time_ns[self.end - 1] < time_ns[0])
        end = number + len(time_ns)
        before = self.seen[:number][::-1]
        if len(before):
            last = number - 1 - int(before.argmax())  # which stops at the first, mostly at once
            if self.seen[last] and self.time_ns[last] >= time_ns[0]:
                return False
        there = self.seen[number : min(end, self.end)]
        if not np.array_equal(self.time_ns[number : number + len(there)][there], time_ns[: len(there)][there]):
            return False
        after = self.seen[end : self.end]
        return not len(after) or bool(self.time_ns[end + int(after.argmax())] > time_ns[-1])

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
        """Zeros that are made, not copied, take no memory until they are written to."""
        old, have = (self.seen, self.time_ns, self.values), len(self.seen)
        self.seen = np.zeros(length, dtype=bool)
        self.time_ns = np.zeros(length, dtype=np.int64)
        self.values = np.zeros((length, self.values.shape[1]))
        for new, before in zip((self.seen, self.time_ns, self.values), old):
            new[:have] = before
