"""The demonstration on the terminal: one line that is kept up to date, and lines that stay."""

import shutil
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TextIO

from crash_replay.foreign_text import visible, visible_lines
from crash_replay.said import going_out

REDRAWN_EVERY = 0.1
"""s, on a terminal."""
SAID_EVERY = 2.0
"""s, where the output goes into a file or a pipe."""
BAR = 24
ERASE = "\r\x1b[K"


class Terminal:
    """Prints lines; the last one may be replaced where the output is a terminal."""

    def __init__(self, stream: TextIO | None = None):
        self.stream = stream or sys.stdout
        self.live = self.stream.isatty()
        self.progress_line = self.waiting = ""
        self.due = 0.0

    def say(self, text: str = "") -> None:
        """Lines that stay, above the progress line."""
        text = visible_lines(text)
        self._write(f"{ERASE}{text}\n{self.progress_line}" if self.progress_line else f"{text}\n")

    def progress(self, line: str) -> None:
        """Replace the progress line; where that cannot be done it is printed every 2 s instead."""
        now = time.monotonic()
        if now >= self.due:
            self.due = now + (REDRAWN_EVERY if self.live else SAID_EVERY)
            self._show(line)

    def wait(self, what: str, seconds: float) -> None:
        """What is waited for, and how long already; where lines stay, each only once."""
        if self.live:
            self.progress(f"{what} ({seconds:.0f} s)")
        elif what != self.waiting:
            self._show(what)
        self.waiting = what

    def waiting_for(self, what: str) -> Callable[[float], None]:
        """Tells it when it is called with the s for which it is waited."""
        return lambda seconds: self.wait(what, seconds)

    def _show(self, line: str) -> None:
        line = visible(line)
        if self.live:
            self.progress_line = line[: shutil.get_terminal_size().columns - 1]
            self._write(ERASE + self.progress_line)
        else:
            self._write(f"{line}\n")

    def end_progress(self, line: str) -> None:
        """The progress line as it shall stay."""
        self.progress_line = ""
        self._write(f"{ERASE if self.live else ''}{visible(line)}\n")

    def clear(self) -> None:
        """Take the progress line away."""
        if self.progress_line:
            self.progress_line = ""
            self._write(ERASE)

    def _write(self, text: str) -> None:
        with going_out():
            self.stream.write(text)
            self.stream.flush()


def near(path: Path | str) -> str:
    """From the working folder where the path is below it; a name stays as it is."""
    path = Path(path)
    return str(path.relative_to(Path.cwd()) if path.is_absolute() and path.is_relative_to(Path.cwd()) else path)


def bar(share: float, encoding: str | None) -> str:
    """A bar filled to `share`, in characters that the output's encoding has."""
    full, empty = ("█", "░") if "utf" in (encoding or "").lower() else ("#", ".")
    filled = round(min(max(share, 0.0), 1.0) * BAR)
    return full * filled + empty * (BAR - filled)
