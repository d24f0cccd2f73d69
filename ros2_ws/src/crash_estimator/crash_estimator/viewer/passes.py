"""One pass over the test: gathers the cast, then lets the show begin."""

import os
import time
from collections import Counter
from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import rerun as rr

from .blocks import UNKNOWN_TEST, Block, EventBlock, ForceBlock, ParameterBlock, ResidualBlock, TestBlock, estimator_of
from .cast import Cast, Member, member
from .findings import Finding, RankingBlock
from .judged import Jury
from .show import Attempt, Show

PATIENCE = 2.0
"""s of wall clock that the first estimator waits for those that are expected before the show begins without them."""
COURTESY = 0.5
"""s that it waits for others where it is not known who will come."""

FILE_PERIOD = 2.0
"""s of wall clock between batches for the file."""

FLUSHING = 30.0
"""s that the last of it may take to reach the disk, or a viewer."""

FILE_END = b"RRF2FOOT"
"""In the last twelve bytes of a .rrd file that was written to its end."""

KINDS = {ParameterBlock, ResidualBlock, ForceBlock}
"""What an estimator says of every sample."""


class Pass:
    """One run's blocks into a live recording and a file; they wait until the layout can be sent before them."""

    def __init__(
        self,
        live: rr.RecordingStream,
        file: tuple[rr.RecordingStream, Path] | None,
        expected: tuple[str, ...],
        first: bool,
        attempt: Attempt,
        jury: Jury,
        sent: list[Cast],
    ):
        """first: of the session; attempt, sent: as in Show, the latter of the live recordings."""
        self.recordings = [live, file[0]] if file else [live]
        self.path = file[1] if file else None
        self.expected, self.first, self.attempt, self.sent = expected, first, attempt, sent
        self.jury: Jury | None = jury  # None: it has ended
        self.shows: list[Show] = []  # one for each recording
        self.test: TestBlock | None = None
        self.began: float | None = None
        self.ended = False
        self.names: tuple[str, ...] = ()  # of the estimators that it showed, once it has ended
        self.drawn: dict[str, Counter[type]] = {}  # samples, by estimator and kind of block
        self._waiting: list[Block | EventBlock | Finding] = []
        self._unsaved: list[Block | EventBlock | Finding] = []
        self._saved_at = 0.0  # monotonic s
        self._heads: dict[str, dict[type, Any]] = {}  # each estimator's newest block of each kind

    def set_test(self, test: TestBlock) -> None:
        self.test = test
        for recording in self.recordings:
            recording.send_recording_name(test.id)

    def write(self, items: Iterable[Block | EventBlock | Finding]) -> None:
        """What comes after the end is left out."""
        if not self.ended:
            self._write(items)

    def _write(self, items: Iterable[Block | EventBlock | Finding], at_once: bool = False) -> None:
        """at_once: wait for no other estimator."""
        self._waiting += items
        self.began = self.began or time.monotonic()
        for item in self._waiting:
            if not isinstance(item, (EventBlock, Finding)):
                self._heads.setdefault(item.estimator, {})[type(item)] = item
        self._meet(at_once)
        if self.shows:
            cast = self.shows[0].cast
            names = {*cast.names, *cast.estimators}  # events have no revision
            waiting, self._waiting, ready = self._waiting, [], []
            for item in waiting:
                on_stage = isinstance(item, Finding) or item.estimator in names
                (ready if on_stage else self._waiting).append(item)
            self._draw(ready)

    def _draw(self, ready: list[Block | EventBlock | Finding]) -> None:
        self.shows[0].write(ready)
        if self.path:
            self._unsaved += ready
            if time.monotonic() - self._saved_at > FILE_PERIOD:
                self._save()
        for item in ready:
            if isinstance(item, Block):
                self.drawn.setdefault(item.estimator, Counter())[type(item)] += len(item.time_ns)
            if self.jury and isinstance(item, Block):
                self.jury.hear(item)

    def judge(self) -> None:
        """Each member once, when all have been drawn to the last sample; a later revision when it has."""
        if not (self.jury and self.complete):
            return
        new = [name for name in self.drawn if name not in self.jury.judged and self._samples(name) >= self.test.samples]
        if new and self._unsaved:
            self._save()  # what is judged is in both
        judged = self.attempt(lambda: self.jury.verdicts(new)) if new else None
        for show in self.shows if new else ():
            show.judge(judged or {})

    def _save(self) -> None:
        unsaved, self._unsaved = self._unsaved, []
        self._saved_at = time.monotonic()
        self.shows[1].write(unsaved)

    def end(self, incomplete: str = "", overtaken: bool = False) -> None:
        """Nothing more comes: draw what waits, write the file's footer, let go of all that took memory.

        incomplete: said in the summary; overtaken: by the next pass, so that only what a file shows is judged still.
        """
        if self.ended:
            return
        self.ended = True
        self._write([], at_once=True)
        if self._unsaved:
            self._save()
        if self.path or not overtaken:
            self.judge()
        self.names = tuple(m.name for m in self.shows[0].cast.newest) if self.shows else ()
        for k in reversed(range(len(self.recordings))):  # the file first, whatever a viewer does
            try:
                if self.shows:
                    self.shows[k].finish(incomplete)
                self.recordings[k].flush(timeout_sec=FLUSHING)
            finally:
                self.recordings[k].disconnect()
        self.recordings, self.shows, self.jury, self._heads = [], [], None, {}

    @property
    def saved(self) -> bool:
        """Whether all that was drawn has been handed to the file too."""
        return not (self.path and self._unsaved)

    def fault_of_file(self) -> str:
        """What is wrong with the file, once it has ended: Rerun writes it in a thread of its own, and says nothing."""
        try:
            with self.path.open("rb") as file:
                file.seek(-12, os.SEEK_END)
                whole = file.read().startswith(FILE_END)
        except OSError:
            whole = False
        return "" if whole else f"{self.path} was not written to its end: is the disk full?"

    @property
    def complete(self) -> bool:
        """Whether every estimator on stage has been drawn to the last sample, by one revision of its model at least."""
        total = self.test.samples if self.test else 0
        most: Counter[str] = Counter()
        for name in self.drawn:
            most[estimator_of(name)] = max(most[estimator_of(name)], self._samples(name))
        return total > 0 and bool(most) and min(most.values()) >= total

    def _samples(self, name: str) -> int:
        """Of an estimator, drawn in all there is to them: after a rush its forces come later than the rest."""
        return min(self.drawn[name][kind] for kind in KINDS) if name in self.drawn else 0

    def report(self) -> str:
        """After the end, in one line: the file, and how much of the test is in it."""
        total = f" of {self.test.samples}" if self.test else ""
        drawn = [f"{name} {self._samples(name)}{total} samples" for name in self.names]
        return f"wrote {self.path}: {', '.join(drawn) or 'no samples'}"

    def _meet(self, at_once: bool) -> None:
        """Begin once all expected estimators are known, or patience ends; take in who comes or changes later."""
        ready = [name for name, heads in self._heads.items() if heads.keys() == KINDS]
        members = {name: self.attempt(partial(self._member, name)) for name in ready}
        present = [name for name in ready if members[name]]
        missing = self.test is None or any(name not in map(estimator_of, present) for name in self.expected)
        if not self.shows:
            wait = PATIENCE if missing else 0.0 if self.expected else COURTESY
            begin = self._begin(present)
            if begin is None or (time.monotonic() - self.began < wait and not at_once):
                return
            order = {name: k for k, name in enumerate(self.expected)}
            present.sort(key=lambda name: (order.get(estimator_of(name), len(order)), name))
            cast = Cast(self.test or UNKNOWN_TEST, self._span(*begin))
        else:
            cast = self.shows[0].cast
        for name in present:
            cast = cast.with_member(members[name])
        if not self.shows:
            sent = [self.sent, None]  # a file has its own
            self.shows = [
                Show(r, cast, self.first, self.attempt, s) for r, s in zip(self.recordings, sent, strict=False)
            ]
        elif cast != self.shows[0].cast:
            for show in self.shows:
                show.set_cast(cast)

    def _member(self, name: str) -> Member:
        heads = self._heads[name]
        return member(heads[ParameterBlock], heads[ResidualBlock], heads[ForceBlock])

    def _begin(self, present: Sequence[str]) -> tuple[int, float] | None:
        """(number, s) of any sample: an estimator's, or one that the diagnosis speaks of; None where there is none."""
        if present:
            block = self._heads[present[0]][ResidualBlock]
            return block.number, float(block.time_ns[0]) * 1e-9
        rankings = [item for item in self._waiting if isinstance(item, RankingBlock)]
        return (rankings[0].number, rankings[0].time) if rankings else None

    def _span(self, number: int, time_: float) -> tuple[float, float]:
        """s, the recording's first and last instant, from any sample's number and time."""
        test = self.test or UNKNOWN_TEST
        start = time_ - number * test.sample_period
        return start, max(start + max(test.samples - 1, 0) * test.sample_period, time_)
