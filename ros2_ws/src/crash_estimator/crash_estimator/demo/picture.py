"""What a viewer would show at the end of a demonstration, where there is no screen for it: drawn by another process."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from .children import Child

LIMIT = 240.0
"""s for one try, on a slow machine with other work; a few otherwise."""
TRIES = 2
LOOK = 0.1


class Picture:
    def __init__(self, rrd: Path, waiting: Callable[[float], None], limit: float = LIMIT):
        """waiting: called again and again with the s that it has taken so far."""
        self.rrd, self.png, self.waiting, self.limit = rrd, rrd.with_suffix(".png"), waiting, limit

    def draw(self) -> str:
        """Why there is none; "" where it is drawn."""
        why = ""
        for _ in range(TRIES):
            why = self._try()
            if not why:
                return ""
        return why

    def _try(self) -> str:
        self.png.unlink(missing_ok=True)
        command = [sys.executable, "-m", "crash_estimator.viewer.screenshot", str(self.rrd), str(self.png)]
        command += ["--patience", f"{self.limit / 3:g}"]
        child = Child("picture", command, self.rrd.with_name("log") / "picture.log", os.environ)
        try:
            status = self._ended(child.process)
        finally:
            _kill_group(child.process)
        if status is None:
            return f"not drawn within {self.limit:g} s"
        if status:
            return child.last_line().removeprefix("error: ") or f"drawing it ended with status {status}"
        return "" if self.png.is_file() and self.png.stat().st_size else f"{self.png} is empty"

    def _ended(self, process: subprocess.Popen) -> int | None:
        """Exit status; None where it takes too long."""
        waited = 0.0
        while waited < self.limit:
            try:
                return process.wait(LOOK)
            except subprocess.TimeoutExpired:
                waited += LOOK  # not by the clock: while this process is stopped itself nothing is too late
                self.waiting(waited)
        return None


def _kill_group(process: subprocess.Popen) -> None:
    """With the viewer that it has started, though that hangs."""
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        pass
    process.wait()
