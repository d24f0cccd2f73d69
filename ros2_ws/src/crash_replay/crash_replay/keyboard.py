"""The terminal that `replay` was started in: keys as they are pressed, and the terminal as it was afterwards."""

import os
import select
import signal
import sys
import termios
import tty
from types import FrameType
from typing import Any

from .keys import decode


class Keyboard:
    """Keys of a terminal, without waiting for Enter and without showing them; use as a context, in the main thread.

    Ctrl-C stays what it is. After Ctrl-Z the terminal is the shell's; keys count again when the replay is brought
    to the foreground.
    """

    def __init__(self, descriptor: int | None = None):
        self.descriptor = sys.stdin.fileno() if descriptor is None else descriptor
        self.rest = b""  # beginning of a key that is not complete
        self.before: list | None = None
        self.handlers: dict[int, Any] = {}

    def __enter__(self) -> "Keyboard":
        self.before = termios.tcgetattr(self.descriptor)
        # a process in the background that changes or reads the terminal is stopped unless it ignores these
        for number, handler in (
            (signal.SIGTTOU, signal.SIG_IGN),
            (signal.SIGTTIN, signal.SIG_IGN),
            (signal.SIGCONT, self._take),
        ):
            self.handlers[number] = signal.signal(number, handler)
        self._take()
        return self

    def __exit__(self, *_) -> None:
        if self._ours():
            try:
                termios.tcsetattr(self.descriptor, termios.TCSADRAIN, self.before)
            except termios.error:  # the terminal is gone
                pass
        for number, handler in self.handlers.items():
            signal.signal(number, handler)

    def pressed(self, seconds: float) -> list[str]:
        """Names of the keys pressed within so many seconds."""
        if not self._ours():  # in the background the keys are the shell's
            select.select([], [], [], seconds)
            return []
        ready, _, _ = select.select([self.descriptor], [], [], seconds)
        try:
            data = os.read(self.descriptor, 1024) if ready else b""
        except OSError:  # the terminal is gone, or was given to another process just now
            data = b""
        if ready and not data:
            select.select([], [], [], seconds)
        keys, self.rest = decode(self.rest + data)
        return keys

    def _ours(self) -> bool:
        """Whether this process is the one that the terminal belongs to."""
        try:
            return os.tcgetpgrp(self.descriptor) == os.getpgrp()
        except OSError:
            return False

    def _take(self, _number: int = 0, _frame: FrameType | None = None) -> None:
        if self._ours():
            tty.setcbreak(self.descriptor)
