"""Whether so much comes that nobody can look at it as it goes by."""

import time
from collections.abc import Callable

PERIOD = 0.05
"""s over which what comes is counted."""
GOES_ON = 0.75
"""Of what it takes to begin one: it lasts while more than this comes."""
LULL = 0.3
"""s of less after which it is over. A period holds but a few large messages: to take the first one with a message less
for the end would begin, in the midst of the rush, what was put off, which makes what comes slower still."""


class Rush:
    """One that has begun lasts until less has come for a while."""

    def __init__(self, limit: float, clock: Callable[[], float] = time.monotonic):
        """limit: what may come in a second without being one."""
        self.limit, self.clock = limit, clock
        self.on = False
        self.came, self.looked = 0, clock()  # since then
        self.lasted = self.looked  # until then

    def count(self, amount: int) -> None:
        self.came += amount

    def look(self) -> bool:
        """Whether there is one now."""
        now = self.clock()
        if (passed := now - self.looked) > PERIOD:
            if self.came > self.limit * passed * (GOES_ON if self.on else 1.0):
                self.on, self.lasted = True, now
            elif now - self.lasted > LULL:
                self.on = False
            self.came, self.looked = 0, now
        return self.on
