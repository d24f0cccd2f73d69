"""Which machine this is, and whether a process of it still runs: from /proc, where the system has it."""

import ctypes
import os
import platform
import signal
import sys
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path

PROCESSES = Path("/proc")
LIBC = ctypes.CDLL(None) if sys.platform == "linux" else None  # loaded before any fork
SET_PARENT_DEATH_SIGNAL = 1


@cache
def this_host() -> str:
    """This machine since it was started and, in a container, its own process numbers: equal where both are."""
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text().strip()
        return f"{platform.node()}/{boot}/{os.stat('/proc/self/ns/pid').st_ino}"
    except OSError:
        return platform.node()


def state_of(process: int) -> str:
    """Its letter in /proc: R, S, ...; T stopped, Z ended but not waited for; "" where there is none, or no /proc."""
    try:
        return (PROCESSES / str(process) / "stat").read_text().rpartition(")")[2].split()[0]
    except (OSError, IndexError):
        return ""


def has_ended(process: int) -> bool:
    """Whether a process of this machine runs no more; False where that cannot be known."""
    return PROCESSES.is_dir() and state_of(process) in ("", "Z", "X")


def is_stopped(process: int) -> bool:
    """Whether something has stopped it: a debugger, Ctrl-Z, SIGSTOP."""
    return state_of(process) in ("T", "t")


def ends_with_this() -> Callable[[], None] | None:
    """For `preexec_fn` of a process to start: on Linux it ends when this one is gone, even where that was killed."""
    return partial(end_with, os.getpid()) if LIBC else None


def end_with(parent: int) -> None:
    """Ask Linux to end this process when that one, its parent, is gone."""
    LIBC.prctl(SET_PARENT_DEATH_SIGNAL, signal.SIGTERM)
    if os.getppid() != parent:  # it was gone already
        os._exit(1)
