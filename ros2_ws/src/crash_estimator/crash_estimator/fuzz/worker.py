"""One input after the other in a process of its own, each under an alarm and a limit of memory."""

import os
import resource
import signal
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from time import process_time
from typing import NamedTuple

from crash_replay.node_parameters import ParameterError
from crash_replay.recording import RecordingError

from ..core.structure import ModelError
from .targets import TARGETS
from .valid import Files

OURS = (RecordingError, ModelError, ParameterError, OSError)
"""What commands and nodes expect, and say in one line."""
LONGEST, WAITING = 5.0, 30.0
"""s for an input: of the processor, and by the clock, where it waits for something that never comes."""
MOST = 500_000_000
"""Bytes of memory that the process may ever have taken, with all its libraries (300 MB)."""
LINE = 1500
"""Characters of an error at most."""


class Result(NamedTuple):
    target: str
    seed: str  # makes the same input again
    outcome: str  # taken, refused, or what is wrong
    detail: str
    seconds: float
    bytes: int  # the process's most so far

    @property
    def failed(self) -> bool:
        return self.outcome not in ("taken", "refused")


class Slow(BaseException):
    """Not an Exception: nothing that guards against any of them is to swallow it."""


def input_of(target: str, seed: str) -> Files:
    return TARGETS[target].spoil(Random(seed))


def laid_out(files: Files, folder: Path) -> None:
    """The files in a folder; a name's end says what is there instead: / a folder, | a pipe, @ a device."""
    for name, content in files.items():
        path = folder / name.rstrip("/|@")
        path.parent.mkdir(parents=True, exist_ok=True)
        match name[-1]:
            case "/":
                path.mkdir()
            case "|":
                os.mkfifo(path)
            case "@":
                path.symlink_to("/dev/zero")
            case _:
                path.write_bytes(content)


def tried(target: str, seed: str, files: Files) -> Result:
    """What becomes of an input."""
    TARGETS[target].prepare()
    with TemporaryDirectory(prefix="fuzz-") as scratch:
        folder = Path(scratch)
        laid_out(files, folder)
        start = process_time()
        try:
            with _alarm():
                TARGETS[target].take(folder)
            outcome, detail = "taken", ""
        except OURS as error:
            outcome, detail = _judged(str(error))
        except Slow:
            outcome, detail = f"longer than {LONGEST:g} s", traceback.format_exc()
        except BaseException as error:  # what this is all about
            outcome, detail = f"{type(error).__name__}", traceback.format_exc()
        seconds = process_time() - start
    most = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    if most > MOST and outcome in ("taken", "refused"):
        outcome, detail = f"more than {MOST / 1e6:.0f} MB", f"{most / 1e6:.0f} MB"
    return Result(target, seed, outcome, detail, seconds, most)


def _judged(line: str) -> tuple[str, str]:
    if not line.isprintable():
        return "not one printable line", repr(line)[:LINE]
    return ("refused", line) if line and len(line) <= LINE else ("no line that can be read", line[:LINE])


@contextmanager
def _alarm() -> Iterator[None]:
    def on_alarm(*_) -> None:
        raise Slow

    timers = {signal.ITIMER_PROF: (signal.SIGPROF, LONGEST), signal.ITIMER_REAL: (signal.SIGALRM, WAITING)}
    for timer, (number, seconds) in timers.items():
        signal.signal(number, on_alarm)
        signal.setitimer(timer, seconds, 1.0)
    try:
        yield
    finally:
        for timer in timers:
            signal.setitimer(timer, 0.0)


def restrict() -> None:
    """For a process that tries inputs: a warning is a failure, and a claim of terabytes cannot be met."""
    warnings.simplefilter("error")
    warnings.simplefilter("ignore", DeprecationWarning)  # of libraries that others import late
    resource.setrlimit(resource.RLIMIT_AS, (8 * 2**30, 8 * 2**30))
