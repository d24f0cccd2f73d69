"""The first thing that a program of ours does: what Ctrl-C and its like find while the rest is still being imported.

Python would show a traceback of the imports. The packages call `begin_program` before anything else, and it takes hold
in their programs alone: who imports them from a program of his own keeps his signals. Python itself takes some 50 ms
before that; who starts a program with `held` signals makes them wait until then.
"""

import atexit
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager

ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def begin_program(package: str, folder: str) -> None:
    """Call it as a package is imported: where a program of it is being started, a signal ends that with a line.

    folder: of the package. Its programs are those that Python runs by `-m` (then "-m" stands for the name until the
    module is found), the processes that these start by multiprocessing, and the executables lib/PACKAGE/NAME.
    """
    program = sys.argv[0] if sys.argv else ""
    started_by_us = program.startswith(os.path.join(folder, ""))
    if program == "-m" or started_by_us or os.path.basename(os.path.dirname(program)) == package:
        begin()


def begin() -> None:
    """From now on, and for signals that were held: the first that a process of a pool does, too."""
    for number in ENDING:
        if signal.getsignal(number) in (signal.SIG_DFL, signal.default_int_handler):  # nohup is respected
            signal.signal(number, leave)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDING)
    atexit.register(end)


def end() -> None:
    """It is through, and its exit status stands: Python takes its handlers down now, and a signal would kill it."""
    for number in ENDING:
        if callable(signal.getsignal(number)):
            signal.signal(number, signal.SIG_IGN)


def leave(number: int, _) -> None:
    """End at once: nothing has been begun, and an exception may be lost in the imports, or shown in part."""
    try:
        os.write(sys.__stderr__.fileno(), b"interrupted while it was being started\n")
    except (OSError, ValueError, AttributeError):
        pass  # there is nobody to read it
    os._exit(128 + number)


@contextmanager
def held(*numbers: int) -> Iterator[None]:
    """What this thread starts meanwhile gets these signals only when it asks for them, as our programs do."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, numbers or ENDING)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
