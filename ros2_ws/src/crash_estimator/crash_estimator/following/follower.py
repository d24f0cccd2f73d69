"""An estimator that can be anywhere in a test. Whichever way sample n was reached, the state before it is

    the initial state with every sample folded in that has been seen and is numbered below n, to the last bit.

It keeps the samples (8 bytes x (channels + 1) + 1 each, once, however many passes: 137 MB for 100 s of 16 channels at
10 kHz) and a bounded number of states, see `checkpoints`.
"""

from typing import Any

import numpy as np

from ..core.methods import AnyEstimator
from ..kept import Kept, Rows
from .checkpoints import Checkpoints
from .columns import Columns, follow


class Follower:
    def __init__(self, estimator: AnyEstimator, kept: Kept, floor: int = 0):
        """floor: number of the first sample that counts; those before are left out, as if never seen."""
        self.estimator, self.kept, self.floor = estimator, kept, floor
        self.state: Any = estimator.init()
        self.checkpoints = Checkpoints(self.state)
        self.position = 0  # the state expects this sample next

    def keep(self, rows: Rows) -> None:
        """Samples have come, in whatever order; states that rest on their absence are forgotten."""
        if rows.number < self.position and not self.kept.seen[rows.number : min(rows.end, self.position)].all():
            self.checkpoints.forget_after(rows.number)
            self.position, self.state = self.checkpoints.before(rows.number)
        self.kept.put_rows(rows)

    def gap(self, number: int) -> tuple[int, int] | None:
        """The first samples before `number` that have not been seen: start, stop. None: all have."""
        if number == self.position:
            return None  # what was missing on the way here has been gone without
        return self.kept.gap(self.floor, number)

    def holds_from(self, number: int) -> int:
        """The state before sample `number` rests on every sample from this one on."""
        unseen = np.flatnonzero(~self.kept.seen[self.floor : number])
        return self.floor + int(unseen[-1]) + 1 if len(unseen) else self.floor

    def go_to(self, number: int) -> Columns | None:
        """Fold what is kept up to the state before sample `number`; the estimates of the last few samples folded.

        Raises FilterFailure.
        """
        if number == self.position:
            return None
        start, state = self.checkpoints.before(number)
        if start <= self.position < number:
            start, state = self.position, self.state
        columns = None
        for rows in self.kept.runs(max(start, self.floor), number, self.checkpoints.stride):
            state, columns = follow(self.estimator, state, rows)
            self.checkpoints.offer(rows.end, state)
        self.position, self.state = number, state
        return columns

    def follow(self, rows: Rows) -> Columns:
        """The estimates of consecutive samples that are kept; raises FilterFailure, and stays before them."""
        self.go_to(rows.number)
        own = self.kept.rows(rows.number, rows.end)  # what is computed again from them holds no memory of its own
        state, columns = follow(self.estimator, self.state, own)
        self.position, self.state = rows.end, state
        self.checkpoints.offer(self.position, state)
        return columns

    def again(self, start: int, stop: int) -> Columns:
        """The estimates of samples start, ..., stop - 1, which have been seen, once more; the follower stays where it
        is.

        Raises FilterFailure.
        """
        number, state = self.checkpoints.before(start)
        for rows in self.kept.runs(max(number, self.floor), start, self.checkpoints.stride):
            state, _ = follow(self.estimator, state, rows)
        return follow(self.estimator, state, self.kept.rows(start, stop))[1]
