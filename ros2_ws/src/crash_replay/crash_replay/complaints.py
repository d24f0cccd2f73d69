"""What is wrong with what comes, said so that it can be read: at once, but never a line for each message."""

import time
from collections.abc import Callable

BETWEEN = 5.0
"""s between two lines of one kind."""


class Complaints:
    """The first of a kind at once; then, while it goes on, one every few seconds, with how often it has happened."""

    def __init__(self, say: Callable[[str], object], clock: Callable[[], float] = time.monotonic):
        """say: what writes a line; of a logger a function around it, as rclpy's takes one severity per line of code."""
        self.say, self.clock = say, clock
        self.said: dict[str, tuple[float, int]] = {}  # by kind: when last, and how many since

    def complain(self, kind: str, text: str) -> None:
        """kind: what is the same about them, such as the topic; text: one line."""
        now = self.clock()
        last, since = self.said.get(kind, (-BETWEEN, 0))
        if now - last < BETWEEN:
            self.said[kind] = last, since + 1
            return
        self.say(f"{text} (and {since} more like it)" if since else text)
        self.said[kind] = now, 0
