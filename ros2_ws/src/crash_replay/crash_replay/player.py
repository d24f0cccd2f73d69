"""The clockwork of a replay: which samples are due, and when. No ROS, no threads; the wall clock is handed in.

Sample k, at time t_k in the crash, is due at the wall time

    due(k) = anchor.wall + (t_k - anchor.time) / rate

The anchor moves only when the replay is resumed, sought, looped or given another rate, so that delays
do not add up. Every command gives a new Player; the old one stays as it was.
"""

from collections import deque
from dataclasses import dataclass, field, replace
from enum import IntEnum
from typing import NamedTuple, Self

import numpy as np

from .fault import Fault
from .time_unit import SECOND

LOWEST_RATE, HIGHEST_RATE = 0.001, 1000.0
SINGLES, BLOCKS = 1000.0, 400.0
"""Messages a second: at most of one sample each, and about so many of several."""
NOW = 1.0
"""s of playing, but two messages at least, over which the present rate is taken."""


class CommandError(Fault):
    """A command that cannot be followed; the message says why in one line."""


class Mode(IntEnum):
    """As in crash_msgs/ReplayState."""

    WAITING = 0  # for its subscribers
    PLAYING = 1
    PAUSED = 2
    FINISHED = 3


class Anchor(NamedTuple):
    """A moment at which the wall clock and the time in the crash belong together."""

    wall: float  # s
    time_ns: float  # ns since the impact


class Batch(NamedTuple):
    """Samples to send now: the numbers start, ..., stop - 1."""

    start: int
    stop: int
    run: int  # passes over the recording before this one
    due: float | None  # s on the wall clock, of the last of them; None: at once, by a step or a burst
    anchor: Anchor | None  # that `due` was counted from


@dataclass(frozen=True, eq=False)
class Player:
    """Where the replay of the samples `first` to `end` - 1 stands."""

    time_ns: np.ndarray  # (n,) int64, ns since the impact, increasing
    rate: float = 1.0  # times real time
    loop: bool = False
    first: int = 0
    end: int = -1  # -1: to the recording's end
    mode: Mode = Mode.WAITING
    run: int = 0
    next: int = field(default=-1)  # number of the next sample; -1: first
    pending: int = 0  # samples to send at once while paused
    anchor: Anchor | None = None  # None: paused before `next`, nothing of the way to it has passed

    def __post_init__(self):
        check_rate(self.rate)
        if self.end < 0:
            object.__setattr__(self, "end", len(self.time_ns))
        if not 0 <= self.first < self.end <= len(self.time_ns):
            raise CommandError(f"nothing to play: samples {self.first} to {self.end} of {len(self.time_ns)}")
        if self.next < 0:
            object.__setattr__(self, "next", self.first)

    def resume(self, now: float) -> Self:
        """Play on; from the first sample again, as a new run, where the last has been sent."""
        if self.mode == Mode.PLAYING:
            return self
        if self.mode == Mode.FINISHED:
            return self._at(self.first, now, Mode.PLAYING)
        reached = self._time_ns(self.next) if self.anchor is None else self.anchor.time_ns
        return replace(self, mode=Mode.PLAYING, pending=0, anchor=Anchor(now, reached))

    def pause(self, now: float) -> Self:
        """Stop before the next sample; what is left of the way to it is played after `resume`."""
        if self.mode == Mode.FINISHED:
            return self
        return replace(self, mode=Mode.PAUSED, pending=0, anchor=self._reached(now))

    def toggle(self, now: float) -> Self:
        return self.pause(now) if self.mode == Mode.PLAYING else self.resume(now)

    def set_rate(self, rate: float, now: float) -> Self:
        """Go on at `rate` times real time from where the replay is."""
        check_rate(rate)
        return replace(self, rate=rate, anchor=self._reached(now))

    def set_loop(self, loop: bool, now: float) -> Self:
        """Whether the first sample follows the last."""
        return replace(self, loop=loop)

    def set_window(self, first: int, end: int, now: float) -> Self:
        """Play the samples first to end - 1 only; where the next is none of them, go to the first, as a new run."""
        changed = replace(self, first=first, end=end, pending=0)
        if self.mode == Mode.WAITING:
            return replace(changed, next=first)
        if self.mode == Mode.FINISHED:
            return replace(changed, next=end)
        return changed if first <= self.next < end else changed._at(first, now, self.mode)

    def seek(self, time_ns: int, now: float) -> Self:
        """Make the first sample at or after a time the next one, as a new run; playing or paused as before."""
        number = int(np.searchsorted(self.time_ns, time_ns))
        if not self.first <= number < self.end or time_ns < self._time_ns(self.first):
            low, high = self._time_ns(self.first) / SECOND, self._time_ns(self.end - 1) / SECOND
            raise CommandError(f"time must be between {low:g} and {high:g} s, got {time_ns / SECOND:g} s")
        return self._at(number, now, Mode.PLAYING if self.mode == Mode.PLAYING else Mode.PAUSED)

    def step(self, n: int, now: float) -> Self:
        """Pause; send n samples at once (n > 0), or go back by -n as a new run, at most to the first (n < 0).

        Steps add up: what earlier ones have yet to send is sent as well, or taken off the way back.
        """
        n += self.pending
        if n >= 0:
            return self._send_at_once(n, now)
        if self.next == self.first:
            raise CommandError(f"cannot go back: sample {self.first} is the first")
        return self._at(max(self.first, self.next + n), now, Mode.PAUSED)

    def burst(self, n: int, now: float) -> Self:
        """Pause; send n samples at once beside those that are still to be sent, or all that are left (0)."""
        return self._send_at_once(self.pending + n if n else max(1, self.end - self.next), now)

    def _send_at_once(self, n: int, now: float) -> Self:
        if self.mode == Mode.FINISHED and n:
            raise CommandError(f"no sample is left: sample {self.end - 1} was the last; go back, seek or resume first")
        return replace(self.pause(now), pending=n, anchor=None if n else self._reached(now))

    def position_ns(self, now: float) -> int:
        """Where the replay is, ns since the impact: on the way to the next sample, or at the last of all."""
        reached = self._reached(now)
        return round(reached.time_ns) if reached else self._time_ns(min(self.next, self.end - 1))

    def due(self, block: int = 1) -> float | None:
        """Wall time in s at which the next `block` samples are to be sent; -inf: at once; None: not before a command.

        A block is due with its last sample: no value is sent before its time.
        """
        if self.mode == Mode.PLAYING:
            return self._due(min(self.next + block, self.end) - 1)
        return -np.inf if self.pending else None

    def late(self, now: float, block: int = 1) -> float:
        """s by which the next samples are late; 0 where none are due."""
        due = self.due(block)
        return max(0.0, now - due) if due is not None and self.mode == Mode.PLAYING else 0.0

    def take(self, now: float, block: int = 1) -> tuple[Self, Batch | None]:
        """The samples that are due now, at most `block` of them, and the player after them."""
        due = self.due(block)
        if due is None or due > now:
            return self, None
        playing = self.mode == Mode.PLAYING
        stop = min(self.next + (block if playing else min(block, self.pending)), self.end)
        batch = Batch(self.next, stop, self.run, due if playing else None, self.anchor if playing else None)
        if stop < self.end:
            return replace(self, next=stop, pending=0 if playing else self.pending - (stop - self.next)), batch
        if not self.loop:
            return replace(self, next=stop, pending=0, mode=Mode.FINISHED, anchor=None), batch
        # the next pass follows one sample period after the last sample, however late that was sent
        again = self._at(self.first, self._due(stop - 1) + self._period if playing else now, self.mode)
        return replace(again, pending=0 if playing else self.pending - (stop - self.next)), batch

    @property
    def _period(self) -> float:
        """Wall time from one sample to the next, s."""
        return float(np.median(np.diff(self.time_ns[: self.end]))) / SECOND / self.rate if self.end > 1 else 0.0

    def _time_ns(self, number: int) -> int:
        return self.time_ns.item(number)

    def _due(self, number: int) -> float:
        return self.anchor.wall + (self._time_ns(number) - self.anchor.time_ns) / (SECOND * self.rate)

    def _reached(self, now: float) -> Anchor | None:
        """The present as an anchor: time passes while playing, never beyond the next sample, which is to be sent."""
        if self.mode != Mode.PLAYING:
            return self.anchor
        passed = self.anchor.time_ns + (now - self.anchor.wall) * SECOND * self.rate
        return Anchor(now, min(passed, self._time_ns(self.next)))

    def _at(self, number: int, now: float, mode: Mode) -> Self:
        """A new run, about to send sample `number`."""
        anchor = Anchor(now, self._time_ns(number)) if mode == Mode.PLAYING else None
        return replace(self, next=number, run=self.run + 1, mode=mode, pending=0, anchor=anchor)


def check_rate(rate: float) -> None:
    if not LOWEST_RATE <= rate <= HIGHEST_RATE:
        raise CommandError(f"rate must be between {LOWEST_RATE:g} and {HIGHEST_RATE:g} times real time, got {rate:g}")


def suitable_block(period: float, rate: float, channels: int) -> int:
    """Samples in a message: one where single messages carry them.

    period in s between samples. A message costs its receivers the same however many samples it holds. Two cores
    carry 1000 a second with several estimators, diagnosis and viewer; what needs blocks goes in so few that other
    work on the machine does not make it late. A message stays below 64 kB, which the transport takes in one piece.
    """
    per_second = rate / period if period > 0 else 0.0
    wanted = np.ceil(per_second / BLOCKS - 1e-6) if per_second > SINGLES * (1 + 1e-6) else 1
    return int(max(1, min(wanted, 65_000 // (8 * (channels + 1)))))


@dataclass
class Tally:
    """What has been sent, and how well the clock was kept."""

    samples: int = 0
    messages: int = 0
    worst_lateness: float = 0.0  # s on the wall clock
    played: float = 0.0  # s in the crash, steps and bursts left out
    took: float = 0.0  # s on the wall clock, for `played`
    previous: tuple[Anchor, Anchor] | None = None  # what the last message was timed by, and when it went out
    recent: deque[tuple[float, float]] = field(default_factory=lambda: deque([(0.0, 0.0)]))  # played, took; see NOW

    def count(self, batch: Batch, last_time_ns: int, wall: float) -> None:
        """A batch whose last sample lies at `last_time_ns` in the crash has gone out at the time `wall`."""
        self.samples += batch.stop - batch.start
        self.messages += 1
        if batch.due is None:
            self.previous = None
            return
        self.worst_lateness = max(self.worst_lateness, wall - batch.due)
        if self.previous is None:
            self.previous = (batch.anchor, batch.anchor)
        anchor, last = self.previous
        if anchor != batch.anchor:  # a pass that begins late begins when the last message went out
            last = Anchor(max(last.wall, batch.anchor.wall), batch.anchor.time_ns)
        self.played += (last_time_ns - last.time_ns) / SECOND
        self.took += wall - last.wall
        self.previous = (batch.anchor, Anchor(wall, last_time_ns))
        self.recent.append((self.played, self.took))
        while len(self.recent) > 2 and self.took - self.recent[1][1] > NOW:
            self.recent.popleft()

    def forget_recent(self) -> None:
        """The rate that is asked for is another one: what was kept before says nothing of it."""
        self.recent = deque([(self.played, self.took)])

    @property
    def rate(self) -> float:
        """Times real time, over what has been played; 0 before there is anything to tell it from."""
        return self.played / self.took if self.took > 0 else 0.0

    def rate_now(self, late: float = 0.0) -> float:
        """Times real time, over the last second of playing; late: s by which the next samples are."""
        played, took = self.recent[0]
        took = self.took - took + late
        return (self.played - played) / took if took > 0 else 0.0
