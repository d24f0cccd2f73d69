"""How far a long piece of work is, with the seconds that it has taken: lines on standard error, none for a short one."""

import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from typing import TypeVar

from .fault import tell

Item = TypeVar("Item")
FIRST_AFTER, THEN_EVERY = 3.0, 5.0
"""s: who waits longer than the first wants to know; a terminal's line is renewed more often."""
ON_A_TERMINAL = 0.2
"""s between renewals of a terminal's line."""


def with_progress(items: Sequence[Item], what: str) -> Iterator[Item]:
    """The items one by one; `what` is "reading curve"."""
    yield from counted(items, len(items), what)


def counted(items: Iterable[Item], total: int, what: str) -> Iterator[Item]:
    """The same where the number of items is known otherwise."""
    began = last = time.monotonic()
    shown, terminal = False, _is_terminal()
    for number, item in enumerate(items, start=1):
        yield item
        now = time.monotonic()
        pause = ON_A_TERMINAL if terminal else THEN_EVERY
        if now - began > FIRST_AFTER and now - last > pause:
            shown, last = True, now
            _show(f"{what} {number} of {total}, {now - began:.0f} s", terminal)
    if shown:
        _show(f"{what} {total} of {total}, {time.monotonic() - began:.0f} s", terminal, ends=True)


def _is_terminal() -> bool:
    with suppress(AttributeError, ValueError):
        return sys.stderr.isatty()
    return False


def _show(line: str, terminal: bool, ends: bool = False) -> None:
    if not terminal:
        tell(line)
        return
    with suppress(OSError, ValueError):
        print(f"\r\x1b[K{line}", end="\n" if ends else "", file=sys.stderr, flush=True)
