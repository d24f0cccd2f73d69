"""Channels that come one by one, as rosbag2's player sends them, put together to samples again: by their stamps."""

from bisect import bisect_right
from collections.abc import Callable

import numpy as np

from crash_replay.recording import Test

from ..kept import Rows

PATIENCE = 200
"""Stamps to wait for a channel that says nothing."""
NEVER = (-1, 2**62)
"""The moment before all: any time after it goes back."""


class Numbering:
    """Number of a sample by its time, where none is sent: the first seen is 0, the sample period tells of lost ones."""

    def __init__(self, period_ns: int):
        self.period_ns = period_ns
        self.times: list[int] = []  # ns, increasing
        self.numbers: list[int] = []

    def __call__(self, time_ns: int) -> int:
        """Raises LookupError for a time before the first: all numbers would have to change."""
        k = bisect_right(self.times, time_ns)
        if k == 0 and self.times:
            raise LookupError
        if k and self.times[k - 1] == time_ns:
            return self.numbers[k - 1]
        number = self.numbers[k - 1] + max(1, round((time_ns - self.times[k - 1]) / self.period_ns)) if k else 0
        self.times.insert(k, time_ns)
        self.numbers.insert(k, number)
        return number


class Alignment:
    """Hands out a sample once every channel has said what it has to say up to its stamp: NaN where that is nothing.

    Each channel's messages come in order, those of several in any. A moment is (pass, ns since the impact): a channel
    whose time goes back has begun another pass over the test.
    """

    def __init__(self, test: Test, period: float, begin: Callable[[bool], None], take: Callable[[Rows], None]):
        """period: s between samples; take: called with each sample; begin: before the first one of a pass, and
        whether numbers are now counted from an earlier sample than before."""
        self.width = len(test.channels)
        self.number_of = Numbering(max(1, round(period * 1e9)))
        self.begin, self.take = begin, take
        self.rows: dict[tuple[int, int], np.ndarray] = {}  # by moment, those to come
        self.newest = [NEVER] * self.width  # moment of each channel's latest value
        self.last = NEVER  # moment of the last sample handed out

    def put(self, channel: int, time_ns: int, value: float) -> None:
        run, newest_ns = self.newest[channel]
        moment = (run + (time_ns < newest_ns), time_ns)
        if moment <= self.last:
            return  # after all patience
        row = self.rows.get(moment)
        if row is None:
            row = self.rows[moment] = np.full(self.width, np.nan)
        row[channel] = value
        self.newest[channel] = moment
        self._hand_out(min(self.newest))
        while len(self.rows) > PATIENCE:
            self._hand_out(min(self.rows))

    def flush(self) -> None:
        """Nothing more comes for now: hand out what there is."""
        if self.rows:
            self._hand_out(max(self.rows))

    def _hand_out(self, until: tuple[int, int]) -> None:
        for moment in sorted(m for m in self.rows if m <= until):
            row = self.rows.pop(moment)
            run, time_ns = moment
            number, renumbered = self._number(time_ns)
            if run > self.last[0]:
                self.begin(renumbered)
            self.last = moment
            self.take(Rows(number, np.array([time_ns]), row.reshape(1, -1)))

    def _number(self, time_ns: int) -> tuple[int, bool]:
        try:
            return self.number_of(time_ns), False
        except LookupError:  # the pass before this one was joined late
            self.number_of = Numbering(self.number_of.period_ns)
            return self.number_of(time_ns), True
