"""States of an estimator along a recording, so that going back costs a short way and not all of it.

At most `LIMIT` are kept: where there would be more, every second one goes and the next ones come half as often. So
after n samples they are `stride` <= max(STRIDE, 2 n / LIMIT) samples apart, and take LIMIT times a state's memory
(3 kB to 54 kB for a dummy, by method: 0.4 to 7 MB), whatever n.
"""

from bisect import bisect_right
from copy import deepcopy
from typing import Any

STRIDE = 64
"""Samples between two, at first: some 64 us to 30 ms of work again, by method."""
LIMIT = 128


class Checkpoints:
    """`numbers[k]` is the sample that `states[k]` expects next."""

    def __init__(self, initial: Any):
        self.numbers: list[int] = [0]
        self.states: list[Any] = [initial]
        self.stride = STRIDE

    def offer(self, number: int, state: Any) -> None:
        """Keep the state before sample `number` if it is far enough from the last one kept."""
        if number < self.numbers[-1] + self.stride:
            return
        self.numbers.append(number)
        self.states.append(deepcopy(state))  # a state may be a view of a whole block's rows
        if len(self.numbers) > LIMIT:
            del self.numbers[1::2], self.states[1::2]
            self.stride *= 2

    def before(self, number: int) -> tuple[int, Any]:
        """The last one at or before sample `number`."""
        k = bisect_right(self.numbers, number) - 1
        return self.numbers[k], self.states[k]

    def forget_after(self, number: int) -> None:
        """Samples from `number` on are not what they were: no state beyond them holds."""
        k = bisect_right(self.numbers, number)
        del self.numbers[k:], self.states[k:]
