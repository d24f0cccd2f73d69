"""What can wait while samples come in a rush, and is published when it is over."""

import time
from collections import deque
from collections.abc import Callable

from ..rush import Rush

RUSH = 60_000.0
"""Samples a second from which on it is one: no replay in real time is as fast, and nobody can look at what goes by."""
HOLD = 128_000_000
"""Bytes that wait at most: what comes then pushes the oldest out."""
LOOK = 0.02
"""s between two looks at whether the rush is over."""
AT_A_TIME = 0.01
"""s that a look may take to publish: samples that come meanwhile wait no longer."""

Make = Callable[[], bytes]


class Later:
    """Publishes messages in their order: at once or, in a rush, after it, as fast as they are taken."""

    def __init__(
        self,
        publish: Callable[[bytes], None],
        taken: Callable[[], bool],
        clock: Callable[[], float] = time.perf_counter,
    ):
        """taken: whether subscribers have got all that was published."""
        self.publish, self.taken, self.clock = publish, taken, clock
        self.waiting: deque[tuple[Make, int]] = deque()
        self.held = 0  # bytes
        self.rush = Rush(RUSH, clock)

    def count(self, samples: int) -> bool:
        """So many have come -> whether what there is to say of them can wait."""
        self.rush.count(samples)
        return self.rush.look() or bool(self.waiting)

    def put(self, make: Make, size: int, wait: bool) -> None:
        """make: gives the message, of some `size` bytes; wait: False where this and all before must go now."""
        self.waiting.append((make, size))
        self.held += size
        while self.waiting and (self.held > HOLD or not wait):
            self._publish()

    def look(self) -> None:
        """Publish some of what waits, if the rush is over."""
        if self.rush.look():
            return
        end = self.clock() + AT_A_TIME
        while self.waiting and self.clock() < end:
            if self.taken():
                self._publish()
            else:
                time.sleep(0.0005)

    def _publish(self) -> None:
        make, size = self.waiting.popleft()
        self.held -= size
        self.publish(make())
