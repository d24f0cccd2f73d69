"""The viewer's own thread: a bounded queue on one side, Rerun on the other. Nobody who hands data over ever waits."""

import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Hashable
from functools import partial
from typing import NamedTuple

from crash_replay.complaints import Complaints
from crash_replay.scheduling import step_back

from ..core.structure import Structure
from ..rush import Rush
from .blocks import Block, EventBlock, TestBlock
from .cast import Cast
from .findings import Finding
from .judged import Jury
from .passes import Pass
from .sinks import Sinks, let_go

Item = Block | EventBlock | Finding | TestBlock
Make = Callable[[], Item]

PERIOD = 0.05
"""s between batches while little is going on."""
SHARE = 0.2
"""Of the time that writing may take: the longer a batch takes, the rarer, larger and so cheaper they become."""
LONGEST = 0.5
"""s between batches at most: what a new pass costs becomes no cheaper, and what waits must not grow without end."""

RUSH, HOLD = 30e6, 256e6
"""While more than RUSH bytes come in a second, drawing is put off until HOLD bytes wait: nobody can look at what goes
by so fast. Two estimators at 20 kHz say two thirds as much in real time, and are drawn as they speak."""
BACK = 10
"""Niceness of the viewer meanwhile."""
MOST = 2.0 * HOLD
"""Bytes that wait at most while others are drawn; beyond that, curves become coarser."""

MOST_FAULTS = 5
"""Kinds of what could not be drawn that are listed in the end."""

AT_THE_END = 30_000
"""Items that are written within about two seconds when the end has come."""


class Entry(NamedTuple):
    """What waits in the queue."""

    stream: Hashable  # None: not to be left out
    index: int  # type: ignore[assignment]  # in its stream; hides the tuple's own method
    make: Make
    size: int  # bytes


class Queue(NamedTuple):
    """How full it is, and what has not come through."""

    items: int
    size: int  # bytes
    dropped: int  # items
    troubles: int  # kinds of items that could not be drawn
    test: str  # id of the one that is drawn


class Recorder:
    """Takes the blocks of each estimator in their order and writes them in batches."""

    def __init__(
        self,
        sinks: Sinks,
        expected: tuple[str, ...] = (),
        limit: int = 100_000,
        say: Callable[[str], None] = print,
        structure_of: Callable[[str, int, str], Structure | None] = lambda estimator, revision, model: None,
    ):
        """expected: estimators that the layout waits for a little; limit: items in the queue; say: told of trouble;
        structure_of: as in Jury."""
        self.sinks, self.expected, self.limit, self.say = sinks, expected, limit, say
        self.structure_of = structure_of
        self.dropped = 0
        self.last_put = time.monotonic()
        self._queue: deque[Entry] = deque()
        self._counts: Counter[Hashable] = Counter()  # items of each stream so far
        self._stride = 1  # every how manyth of them is kept
        self._guard = threading.Lock()
        self._stop = threading.Event()
        self._incomplete = ""  # what the newest pass lacks, as it ends
        self._faults_of_files: list[str] = []
        self._busy = False
        self._held = 0  # bytes in the queue
        self._rush, self._stepped_back = Rush(RUSH), False
        self._test: TestBlock | None = None
        self._replay = 0  # a replay that is started again counts its runs from 0 again
        self._passes: dict[tuple[int, int], Pass] = {}  # by (replay, run), the newest last: the first, the last two and
        self._over = (-1, 0)  # those with a file; the newest of the others, which have ended and been forgotten
        self._sent: list[Cast] = []  # whose layouts the live viewers have
        self._spare: Pass | None = self._open()  # its server is up before the first sample
        self._troubles = Complaints(say)
        self._left_out: dict[str, None] = {}  # what could not be drawn, and why
        self._thread = threading.Thread(target=self._work, name="rerun", daemon=True)
        self._thread.start()

    def put(self, make: Make, stream: Hashable = None, size: int = 0) -> None:
        """Hand over what makes an item; it is called in the recorder's thread, so decoding costs the caller nothing.

        size: bytes that it is made of.

        When the queue is full every second item of each stream goes, and of those that follow until it is empty:
        coarser curves rather than a caller that waits. What belongs to no stream is kept.
        """
        self.last_put = time.monotonic()
        with self._guard:
            index = self._counts[stream]
            self._counts[stream] += 1
            self._rush.count(size)
            entry = Entry(stream, index, make, size)
            if len(self._queue) >= self.limit or self._held > MOST:
                self._thin()
            if self._is_kept(entry):
                self._queue.append(entry)
                self._held += size
            else:
                self.dropped += 1

    def _thin(self) -> None:
        self._stride *= 2
        before = len(self._queue)
        self._queue = deque(filter(self._is_kept, self._queue))
        self._held = sum(entry.size for entry in self._queue)
        self.dropped += before - len(self._queue)

    def _is_kept(self, entry: Entry) -> bool:
        return entry.stream is None or entry.index % self._stride == 0

    def queue(self) -> Queue:
        """How it stands."""
        with self._guard:
            test = self._test.id if self._test else ""
            return Queue(len(self._queue), self._held, self.dropped, len(self._left_out), test)

    @property
    def idle(self) -> bool:
        """Whether all that was handed over has been written."""
        with self._guard:
            return not self._queue and not self._busy

    @property
    def saved(self) -> bool:
        """Whether it has been handed to the file too."""
        return self.idle and all(pass_.saved for pass_ in list(self._passes.values())[-1:])

    @property
    def complete(self) -> bool:
        """Whether the newest pass has been drawn to its last sample."""
        newest = list(self._passes.values())[-1:]
        return bool(newest) and newest[0].complete

    @property
    def faults(self) -> list[str]:
        """What was handed over and is not in the picture, and after `close` what is wrong with the files."""
        lines = [f"left out: {trouble}" for trouble in self._left_out]
        if self.dropped:
            lines.append(f"{self.dropped} messages were left out of the picture: they came faster than it can be drawn")
        return lines + self._faults_of_files

    def close(self, timeout: float = 6.0, incomplete: str = "") -> list[str]:
        """Write what is left, end the files properly, and say in lines what was written; takes `timeout` s at most.

        incomplete: said in the summary of the newest pass.
        """
        with self._guard:
            self.limit = min(self.limit, AT_THE_END)
            while len(self._queue) > self.limit and self._stride < AT_THE_END:
                self._thin()
        self._incomplete = "; ".join(filter(None, [incomplete, *self.faults]))
        self._stop.set()
        self._thread.join(timeout)
        if self._thread.is_alive():
            self._faults_of_files = [f"not finished within {timeout:g} s: the last samples may be missing"]
            return []
        written = [pass_ for pass_ in self._passes.values() if pass_.path]
        self._faults_of_files = [fault for pass_ in written if (fault := pass_.fault_of_file())]
        return [pass_.report() for pass_ in written]

    def _work(self) -> None:
        pause = PERIOD
        while not self._stop.wait(pause):
            began, pause, was_rush = time.monotonic(), PERIOD, self._stepped_back
            if self._put_off():
                continue
            self._write_batch()
            if not was_rush or self._stepped_back:  # after a rush what was put off comes at once, and nothing is slowed
                took = time.monotonic() - began
                pause = min(max(PERIOD, took * (1 - SHARE) / SHARE), LONGEST)
        self._write_batch()
        incomplete = self._incomplete
        for pass_ in reversed([*filter(None, [self._spare]), *self._passes.values()]):  # the one with the server last
            self._guarded(partial(pass_.end, incomplete))
            incomplete = ""

    def _put_off(self) -> bool:
        """Whether so much comes that drawing it can wait: the estimators may need what it would take."""
        with self._guard:
            rush = self._rush.look()
            put_off = rush and self._held < HOLD
        if rush != self._stepped_back:
            self._stepped_back = rush
            step_back(BACK if rush else 0)
        return put_off

    def _write_batch(self) -> None:
        with self._guard:
            batch, self._queue, self._stride, self._held = self._queue, deque(), 1, 0
            self._busy = True
        said: list[Block | EventBlock | Finding] = []  # on the test that was met last
        nothing = True
        for item in (self._guarded(entry.make) for entry in batch):
            if isinstance(item, TestBlock):
                self._write(said)
                self._meet_test(item)
                said = []
            elif item is not None:
                said.append(item)
                nothing = False
        self._write(said)
        if nothing and self._passes:  # who waits for an estimator that does not come waits no longer
            self._guarded(lambda: list(self._passes.values())[-1].write([]))
        if not self._queue and self._passes:  # passes that follow faster than they can be judged are only drawn
            self._guarded(list(self._passes.values())[-1].judge)
        with self._guard:
            self._busy = False

    def _write(self, items: list[Block | EventBlock | Finding]) -> None:
        by_run: dict[int, list[Block | EventBlock | Finding]] = {}
        for item in items:
            by_run.setdefault(item.run, []).append(item)
        for run in sorted(by_run):
            self._guarded(lambda run=run: self._write_pass(run, by_run[run]))

    def _meet_test(self, test: TestBlock) -> None:
        if self._test is not None and self._passes:
            self._replay += 1
        self._test = test

    def _write_pass(self, run: int, items: list[Block | EventBlock | Finding]) -> None:
        key = (self._replay, run)
        if key in self._passes or key > self._over:
            self._pass(key).write(items)

    def _pass(self, key: tuple[int, int]) -> Pass:
        if key not in self._passes:
            for before in list(self._passes)[1:-1]:  # the first one keeps the server, the last may get more
                self._end_pass(before)
            let_go()
            self._passes[key], self._spare = self._spare or self._open(), None
        pass_ = self._passes[key]
        if pass_.test is None and self._test:
            pass_.set_test(self._test)
        return pass_

    def _end_pass(self, key: tuple[int, int]) -> None:
        self._passes[key].end(overtaken=True)
        self._over = max(self._over, key)
        if not self._passes[key].path:
            del self._passes[key]

    def _open(self) -> Pass:
        """One complete pass in a file is enough: a test that is replayed in a loop must not fill the disk."""
        have_one = any(pass_.path and pass_.complete for pass_ in self._passes.values())
        file = None if have_one else self.sinks.open_file()
        live, jury = self.sinks.open_live(), Jury(self.structure_of)
        return Pass(live, file, self.expected, not self._passes, self._guarded, jury, self._sent)

    def _guarded(self, action: Callable):
        """A block that cannot be drawn is said and left out; the rest goes on."""
        try:
            return action()
        except Exception as error:  # whatever it is, the thread must live
            trouble = f"{type(error).__name__}: {' '.join(str(error).split())}"
            if len(self._left_out) < MOST_FAULTS:
                self._left_out[trouble] = None
            self._troubles.complain(type(error).__name__, f"the viewer leaves something out: {trouble}")
            return None
