"""Keeps a publisher from outrunning its reliable subscribers."""

from collections.abc import Callable, Sequence

from rclpy.duration import Duration
from rclpy.publisher import Publisher

from .qos import STREAM

NOT_WAITING = Duration(seconds=0)
ON_TIME = 4000
"""Messages that may be on their way while the clock is kept: below the 5000 that a publisher holds by default."""
LATE = 80
"""Messages that may be on their way when there is no clock to keep: enough to keep all of them busy. With every
heartbeat Fast DDS searches what a reader holds: at 500 that takes longer than what is done with a message."""
BYTES = 250_000
"""Bytes that may be on their way: half of what Fast DDS holds between processes; what exceeds it is sent again."""
SAY_AFTER, SAY_AGAIN = 0.8, 30.0
"""Seconds of waiting after which it is looked, again and again, who for.
Seconds between two such lines about the same ones: one that is slow is waited for again and again."""
PATIENCE = 10.0
"""Seconds to wait for a subscriber that takes nothing; one that was killed is forgotten before, see `obituary`."""
PATIENCE_AGAIN = 0.2
"""Seconds to wait for it the next times, until it takes something: it asks for what it lacks once it is back. Long
enough for the others to take LATE messages, short enough that 2000 messages are through in 5 s."""


class Flow:
    """Counts what is sent and, before that is too much, wants all of it acknowledged.

    Subscribers acknowledge what has found room in their history. So one that keeps all (qos.EVERY_SAMPLE)
    holds the publisher back when it is full, one that keeps the last n loses what it is too slow for.
    """

    def __init__(
        self,
        publishers: Callable[[], Sequence[Publisher]],
        warn: Callable[[str], None],
        waited_for: Callable[[], str] = lambda: "a subscriber",
        depth: int = STREAM.depth,
    ):
        """waited_for: who may be holding up; depth: messages that each publisher holds for those who have not got them
        yet."""
        self.publishers, self.warn, self.waited_for = publishers, warn, waited_for
        most = max(1, depth * ON_TIME // STREAM.depth)
        self.most = {True: min(ON_TIME, most), False: min(LATE, most)}  # by whether the clock is kept
        self.messages = self.bytes = 0  # since all was acknowledged
        self.patience = PATIENCE  # s
        self.waiting_since: float | None = None
        self.looked = 0.0  # when it was last asked who is waited for
        self.said, self.said_of = -SAY_AGAIN, ""  # when, of whom

    def sent(self, messages: int, size: int) -> None:
        self.messages += messages
        self.bytes += size

    def look(self) -> None:
        """Start counting anew if all is acknowledged. In a pause between messages, when that is likely."""
        if (self.messages > LATE // 4 or self.bytes > BYTES // 4) and self.acknowledged():
            self._start_anew()

    def has_room(self, now: float, on_time: bool) -> bool:
        """Whether more may be sent at the wall time `now`. Never waits: rclpy's own waiting stops all other threads."""
        if self.messages < self.most[on_time] and self.bytes < BYTES:
            return True
        if self.all_taken(now):
            return True
        if now - self.waiting_since < self.patience:
            return False
        if self.patience == PATIENCE:
            self.warn(f"a subscriber has taken nothing for {PATIENCE:g} s: going on, it may lose samples")
        self._start_anew(PATIENCE_AGAIN)
        return True

    def all_taken(self, now: float) -> bool:
        """Whether all that was sent is acknowledged; where that takes long, it is said who it hangs on."""
        if self.acknowledged():
            self._start_anew()
            return True
        if self.waiting_since is None:
            self.waiting_since = now
        if now - max(self.waiting_since, self.looked) > SAY_AFTER:
            self._say_who(now)
        return False

    def _say_who(self, now: float) -> None:
        self.looked, who = now, self.waited_for()
        if who != self.said_of or now - self.said > SAY_AGAIN:
            self.said, self.said_of = now, who
            self.warn(f"what was sent is not taken: waiting for {who}")

    def acknowledged(self) -> bool:
        """Whether every reliable subscriber has got everything."""
        return all(publisher.wait_for_all_acked(NOT_WAITING) for publisher in self.publishers())

    def _start_anew(self, patience: float = PATIENCE) -> None:
        self.messages = self.bytes = 0
        self.patience = patience
        self.waiting_since = None
