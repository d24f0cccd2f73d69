"""How far a long piece of work is, and the seconds that it has taken: lines on standard error, none for a short one."""

import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import TypeVar

from .fault import tell
from .foreign_text import visible

Item = TypeVar("Item")
FIRST_AFTER, THEN_EVERY = 3.0, 5.0
"""s: who waits longer than the first wants to know; a terminal's line is renewed more often."""
ON_A_TERMINAL = 0.2
"""s between renewals of a terminal's line."""


def with_progress(items: Sequence[Item], what: str) -> Iterator[Item]:
    """The items one by one; `what` is "reading curve"."""
    counter = Counter(what, len(items))
    for number, item in enumerate(items, start=1):
        yield item
        counter.at(number)


class Counter:
    """Says how many of `total` are done, where it takes long."""

    def __init__(self, what: str, total: int):
        self.what, self.total = what, total
        self.began = self.last = time.monotonic()
        self.shown, self.terminal = False, _is_terminal()

    def at(self, number: int) -> None:
        now = time.monotonic()
        ends = self.shown and number >= self.total
        pause = ON_A_TERMINAL if self.terminal else THEN_EVERY
        if ends or (now - self.began > FIRST_AFTER and now - self.last > pause and number < self.total):
            self.shown, self.last = not ends, now
            _show(f"{self.what} {number} of {self.total}, {now - self.began:.0f} s", self.terminal, ends)


def _is_terminal() -> bool:
    with suppress(AttributeError, ValueError):
        return sys.stderr.isatty()
    return False


def _show(line: str, terminal: bool, ends: bool = False) -> None:
    if not terminal:
        tell(line)
        return
    with suppress(OSError, ValueError):
        sys.stderr.write(f"\r\x1b[K{visible(line)}{chr(10) if ends else ''}")
        sys.stderr.flush()
