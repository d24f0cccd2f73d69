"""Sends what the player finds due, at its time: one thread sends, commands come from others."""

import math
import time
from collections.abc import Callable, Sequence
from threading import Condition
from typing import NamedTuple, Protocol

from .fault import Fault
from .player import Batch, Mode, Player, Tally, suitable_block
from .recording import Recording
from .scheduling import sleep_exactly

STATE_PERIOD = 0.1
"""Seconds between two reports of the state while nothing changes."""
ON_TIME = 0.05
"""Seconds by which a message may be late before the clock counts as lost."""
DISCOVERY = 0.5
"""Seconds in which subscribers that are there already are found, where none are asked for."""
ANSWER_WITHIN = 5.0
"""Seconds after which a step or a burst is answered though it is not all sent."""
LAST_ACKNOWLEDGEMENT = 30.0
"""Seconds at the end for subscribers to take what has been sent; half a second where a signal has ended the replay."""


WAITING = 0.1
"""Seconds between two looks at who has come, or is through."""
SAY_AFTER, SAY_AGAIN = 2.0, 30.0
"""Seconds at the end after which it is said who is waited for, and between two such lines."""


class Outcome(NamedTuple):
    """How a replay went."""

    text: str  # one line
    lacking: list[str]  # a line on each who lacks samples
    stopped: bool = False  # before the last sample was sent, or while it was kept alive


class SubscribersMissing(Fault):
    """Not all subscribers that were asked for have come; the message is one readable line."""


class Outlet(Protocol):
    """Where samples go: `replay_topics.ReplayTopics`."""

    def send(self, batch: Batch) -> None: ...
    def send_state(self, player: Player, tally: Tally, block: int, rate: float) -> None: ...
    def has_room(self, now: float, on_time: bool) -> bool: ...  # for more, at the wall time now
    def wait_for_room(self) -> None: ...  # a moment
    def look(self) -> None: ...  # called where there is time to see what has arrived
    def test_has_arrived(self) -> bool: ...
    def all_have_arrived(self) -> bool: ...

    @property
    def audience(self) -> "Listening": ...


class Listening(Protocol):
    """Who listens: `audience.Audience`."""

    def ready(self) -> int: ...  # subscribers on samples
    def subscribed(self) -> list[str]: ...  # names of all
    def not_ready(self, names: Sequence[str]) -> list[str]: ...
    def forget_gone(self) -> None: ...
    def behind(self, run: int, sent: int) -> list[str]: ...  # who is there and lacks some of these samples
    def lacking(self, run: int, sent: int) -> list[str]: ...  # a line on each who lacks some, gone or not
    def warn(self, text: str) -> None: ...


class Pacing:
    """The player of a recording, run by `play` in one thread and changed by `command` from any."""

    def __init__(self, recording: Recording, player: Player, outlet: Outlet, block: int = 0):
        self.recording, self.outlet, self.asked_block = recording, outlet, block
        self.audience = outlet.audience
        self.changed = Condition()  # guards the player; notified of commands and of what has been sent
        self.player, self.block = player, self._block(player)
        self.tally = Tally()
        self.stopped = False  # set by a signal: ends the replay between two messages
        self.sending = False
        self.state_due = 0.0

    def command(self, command: Callable[..., Player], *arguments) -> None:
        """Put the player that a method of Player gives in the place of the present one."""
        with self.changed:
            rate = self.player.rate
            self.player = command(self.player, *arguments, time.perf_counter())
            if self.player.rate != rate:
                self.tally.forget_recent()
            self.block = self._block(self.player)
            self.state_due = 0.0
            self.changed.notify_all()

    def send_at_once(self, command: Callable[..., Player], n: int) -> tuple[str, int]:
        """Let `play` follow Player.step or Player.burst; one line on it and the number of samples it sent."""
        with self.changed:
            self.changed.wait_for(lambda: not self.sending)
            before = self.tally.samples
            self.command(command, n)
            self.changed.wait_for(lambda: not self.player.pending and not self.sending, ANSWER_WITHIN)
            sent, player = self.tally.samples - before, self.player
        rest = f", {player.pending} still to send" if player.pending else ""
        return f"{sent} samples sent{rest}, the next is sample {player.next}", sent

    def wait_for_subscribers(self, wanted: int, timeout: float, names: Sequence[str] = ()) -> None:
        """Wait until `wanted` subscribers listen and the nodes of these names say that they are ready, or a command
        comes, and until all have the test; raises SubscribersMissing."""
        limit = time.perf_counter() + (timeout if wanted or names else DISCOVERY)
        while self._waits() and not self._all_are_there(wanted, names):
            if time.perf_counter() > limit:
                if wanted or names:
                    raise SubscribersMissing(self._who_is_missing(wanted, timeout, names))
                break
            self._send_state_if_due()
            time.sleep(WAITING)
        limit = time.perf_counter() + DISCOVERY
        while not (self.stopped or self.outlet.test_has_arrived()) and time.perf_counter() < limit:
            time.sleep(0.001)  # whatever command has come: samples without their test are lost on whom they reach
        self.audience.forget_gone()

    def _all_are_there(self, wanted: int, names: Sequence[str]) -> bool:
        """False also where nobody is asked for: then there is a time in which to come."""
        if not (wanted or names) or self.audience.ready() < wanted:
            return False
        return not self.audience.not_ready(names)

    def start(self, paused: bool = False, delay: float = 0.0) -> None:
        """After `delay` s play from the first sample, or wait for commands; where one has come already, it stands."""
        limit = time.perf_counter() + delay
        while self._waits() and time.perf_counter() < limit:
            self._send_state_if_due()
            time.sleep(min(0.005, delay))
        if self._waits():
            self.command(Player.pause if paused else Player.resume)

    def play(self, keep_alive: bool = False) -> None:
        """Send what is due until a signal stops it or, without keep_alive, the last sample is sent."""
        sleep_exactly()
        while not self.stopped and (keep_alive or self.player.mode != Mode.FINISHED):
            player, block = self.player, self.block
            due, now = player.due(block), time.perf_counter()
            spare = math.inf if due is None else due - now
            self._send_state_if_due(spare)
            if spare > 0:
                self.outlet.look()
                self._wait(player, min(now + spare, self.state_due))
            elif self.outlet.has_room(now, on_time=-ON_TIME < spare):
                self._send_due(block)
            else:
                self.outlet.wait_for_room()

    def finish(self, timeout: float = 0.0) -> Outcome:
        """Let subscribers take what has been sent and, up to `timeout` s, those who take part get what they lack."""
        self._send_state()
        limit = time.perf_counter() + (DISCOVERY if self.stopped else LAST_ACKNOWLEDGEMENT)
        player, stopped, self.stopped = self.player, self.stopped, False  # a signal from now on ends the waiting here
        while not (arrived := self.outlet.all_have_arrived()) and not self.stopped and time.perf_counter() < limit:
            self._send_state_if_due()
            time.sleep(0.001)
        if not stopped:
            self._wait_for_listeners(timeout)
        lacking = [] if stopped else self.audience.lacking(player.run, player.next)
        tally = self.tally
        finished = player.mode == Mode.FINISHED
        text = (
            ("finished" if finished else f"stopped before sample {player.next} of {len(self.recording)}")
            + f": {tally.samples} samples sent in {tally.messages} messages, rate {tally.rate:.4g} of {player.rate:g} "
            f"asked for, at worst {tally.worst_lateness * 1e3:.2f} ms late"
            + ("" if arrived or lacking else "; a subscriber has not taken all of them")
        )
        return Outcome(text, lacking, stopped)

    def _wait_for_listeners(self, timeout: float) -> None:
        """Who has been stopped, or came late, asks for what he lacks: the samples can be had while this waits."""
        began, said = time.perf_counter(), 0.0
        while not self.stopped and (behind := self.audience.behind(self.player.run, self.player.next)):
            waited = time.perf_counter() - began
            if waited > timeout:
                break
            if waited > SAY_AFTER and (not said or waited - said > SAY_AGAIN):
                said = waited
                lines = "; ".join(self.audience.lacking(self.player.run, self.player.next)) or ", ".join(behind)
                self.audience.warn(f"waiting up to {timeout - waited:.0f} s for who lacks samples: {lines}")
            self._send_state_if_due()
            time.sleep(WAITING)

    def late(self) -> float:
        """s by which the next samples are late."""
        return self.player.late(time.perf_counter(), self.block)

    def rate_now(self) -> float:
        """Times real time, over the last second of playing; 0 while it does not play."""
        return self.tally.rate_now(self.late()) if self.player.mode == Mode.PLAYING else 0.0

    def _block(self, player: Player) -> int:
        channels = len(self.recording.test.channels)
        return self.asked_block or suitable_block(self.recording.sample_period, player.rate, channels)

    def _waits(self) -> bool:
        return self.player.mode == Mode.WAITING and not self.stopped

    def _who_is_missing(self, wanted: int, timeout: float, names: Sequence[str]) -> str:
        there = ", ".join(sorted(self.audience.subscribed())) or "none"
        if missing := self.audience.not_ready(names):
            return (
                f"after {timeout:g} s not ready: {', '.join(missing)} (on samples: {there}): start them, look at what "
                "they say, or leave them out of listeners"
            )
        return (
            f"only {self.audience.ready()} of {wanted} subscribers on samples after {timeout:g} s (there: "
            f"{there}): start the others, or lower wait_for"
        )

    def _send_due(self, block: int) -> None:
        now = time.perf_counter()
        with self.changed:  # a command may have come in between: then less is due, or nothing
            self.player, batch = self.player.take(now, block)
            self.sending = batch is not None
        if batch is None:
            return
        self.outlet.send(batch)
        with self.changed:
            self.tally.count(batch, self.recording.time_ns.item(batch.stop - 1), now)
            self.sending = False
            if self.player.mode != Mode.PLAYING and not self.player.pending:
                self.state_due = 0.0
            self.changed.notify_all()

    def _wait(self, player: Player, until: float) -> None:
        """Wait for the wall time `until`, less if `player` is changed: asleep at first, awake for the last 0.1 ms."""
        left = until - time.perf_counter()
        if left > 0.002:
            with self.changed:
                if self.player is player:
                    self.changed.wait(left - 0.001)
        elif left > 0.0002:
            time.sleep(left - 0.0001)
        else:
            while time.perf_counter() < until:
                pass

    def _send_state_if_due(self, spare: float = math.inf) -> None:
        """Report the state where it takes no time from a sample, or has been put off for long."""
        late = time.perf_counter() - self.state_due
        if late > 0 and (spare > 0.0003 or late > STATE_PERIOD):
            self._send_state()

    def _send_state(self) -> None:
        self.state_due = time.perf_counter() + STATE_PERIOD
        self.outlet.send_state(self.player, self.tally, self.block, self.rate_now())
