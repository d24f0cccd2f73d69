"""Ctrl-C and its like: a KeyboardInterrupt, but none that rises where it would be lost."""

import signal
from collections.abc import Iterator
from contextlib import contextmanager

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def interrupted_by_signals() -> Iterator[None]:
    """SIGTERM and SIGHUP as Ctrl-C; Ctrl-C also where a shell without job control has it ignored."""
    try:
        for number in SIGNALS:
            signal.signal(number, _interrupt)
        yield
    finally:
        for number in SIGNALS:
            signal.signal(number, signal.SIG_DFL)


@contextmanager
def held_back() -> Iterator[None]:
    """Signals that come meanwhile rise at the end.

    An exception that rises while rclpy converts an argument for a callback is lost: instead comes a RuntimeError
    about a value that cannot be converted.
    """
    came: list[int] = []
    handlers = {number: signal.signal(number, lambda number, _: came.append(number)) for number in SIGNALS}
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
    if came:
        raise KeyboardInterrupt


def _interrupt(*_) -> None:
    raise KeyboardInterrupt
