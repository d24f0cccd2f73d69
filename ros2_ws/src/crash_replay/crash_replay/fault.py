"""How a program ends: with its exit status, and one line on standard error where something is at fault.

Nothing that is raised, whatever it is, reaches the user as a traceback: CRASH_TRACEBACK=1 in the environment shows it.
"""

import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from .foreign_text import visible
from .starting import ENDING, leave

DONE, AT_FAULT = 0, 1
INTERRUPTED, NOBODY_READS = 128 + signal.SIGINT, 128 + signal.SIGPIPE
"""As a shell reports a program that a signal has ended."""

AGAIN = 0.02
"""s after which a signal comes once more whose exception was lost."""

TRACEBACK = "CRASH_TRACEBACK"
LONGEST = 1000
"""Characters of an error that are worth reading, or a little more: its beginning and its end."""


class Fault(ValueError):
    """Data, a model, a file or what was asked for is at fault; the message is one readable line, in a log too."""

    def __str__(self) -> str:
        return one_line(super().__str__())


class NobodyReads(Exception):
    """What is printed goes into a pipe whose reader has gone, as of `| head`."""


class Ended(BaseException):
    """By a signal: what was begun is cleared away."""


class Usage(SystemExit):
    """The command line is at fault, or `--help` was asked for: all has been said."""


def guarded(command: Callable[[], int | None], also: tuple[type[Exception], ...] = ()) -> int:
    """Run a command -> its exit status: what it says, 0 for nothing, 1 where something is at fault.

    also: exceptions that are no fault of the program either, with a message that can be read.
    """
    readable: tuple[type[Exception], ...] = (Fault, *also)
    came: list[int] = []
    try:
        with _signals_end_it(came), _no_signal_is_lost(), _threads_complain() as failed:
            return command() or (AT_FAULT if failed else DONE)
    except Usage:
        raise
    except Ended as ended:
        return 128 + ended.args[0]
    except KeyboardInterrupt:
        return INTERRUPTED
    except NobodyReads:
        return NOBODY_READS
    except readable as error:
        line = str(error)
    except OSError as error:
        line = _of_the_system(error)
    except BaseException as error:  # a user's effect may call sys.exit: that is not how a command ends
        if came:
            return 128 + came[-1]  # a compiled module that was being imported raised its own error in Ended's place
        line = of_the_program(error)
    complain(line)
    return AT_FAULT


@contextmanager
def _signals_end_it(came: list[int]) -> Iterator[None]:
    """Like Ctrl-C, unless they are dealt with already: a file that is half written would stay. came: these signals.

    Who deals with them himself, as a node does, still does so afterwards: no signal changes how it has ended. Nor does
    one that comes between the end of a command and that of its program.
    """
    ours = threading.current_thread() is threading.main_thread()
    found = {number: signal.getsignal(number) for number in ENDING if ours}
    free = {number: handler for number, handler in found.items() if handler in (signal.SIG_DFL, leave)}

    def end(number: int, _) -> None:
        came.append(number)
        raise Ended(number)

    try:
        for number in free:
            signal.signal(number, end)
        yield
    finally:
        for number, handler in free.items():
            if signal.getsignal(number) is end:
                signal.signal(number, signal.SIG_IGN if handler is leave else signal.SIG_DFL)


@contextmanager
def _no_signal_is_lost() -> Iterator[None]:
    """Where Python cannot let an exception rise, in a callback of numba's for one, a signal's comes again."""
    before = sys.unraisablehook

    def again(of) -> None:
        if isinstance(of.exc_value, Ended | KeyboardInterrupt):
            number = of.exc_value.args[0] if isinstance(of.exc_value, Ended) else signal.SIGINT
            threading.Timer(AGAIN, os.kill, (os.getpid(), number)).start()
        else:
            before(of)

    sys.unraisablehook = again
    try:
        yield
    finally:
        sys.unraisablehook = before


@contextmanager
def _threads_complain() -> Iterator[list[BaseException]]:
    """What ends a thread is said in a line too, and remembered."""
    failed: list[BaseException] = []

    def remember(of: threading.ExceptHookArgs) -> None:
        failed.append(of.exc_value)
        complain(of_the_program(of.exc_value))

    before, threading.excepthook = threading.excepthook, remember
    try:
        yield failed
    finally:
        threading.excepthook = before


def complain(line: str) -> None:
    """What is at fault."""
    tell(f"error: {line}")


def tell(line: str) -> None:
    """One line on standard error; nothing where there is nobody to read it."""
    with suppress(OSError, ValueError, AttributeError):
        print(one_line(line), file=sys.stderr, flush=True)


def one_line(text: str) -> str:
    """Line ends as spaces, whatever else does not print as it can be seen, and no more than can be read."""
    line = text if text.isprintable() else visible(" ".join(text.split()))
    return line if len(line) <= LONGEST else f"{line[: LONGEST // 2]} ... {line[-LONGEST // 2 :]}"


def of_the_program(error: BaseException) -> str:
    """What failed and where, and how to see more of it."""
    if os.environ.get(TRACEBACK):
        traceback.print_exception(error)
    what = one_line(f"{type(error).__name__}: {error}" if str(error) else type(error).__name__)
    return f"a fault of the program: {what} (at {_where(error)}; {TRACEBACK}=1 shows the traceback)"


def _of_the_system(error: OSError) -> str:
    if error.errno is None:
        return str(error)  # of ours, in words
    return f"{error.filename}: {error.strerror}" if error.filename is not None else of_the_program(error)


def _where(error: BaseException) -> str:
    """File and line of the innermost call in this project or in a file of the user's."""
    calls, step = [], error.__traceback__
    while step:
        calls.append((step.tb_frame.f_globals.get("__name__", ""), step.tb_frame.f_code.co_filename, step.tb_lineno))
        step = step.tb_next
    ours = [call for call in calls if call[0].startswith(("crash_", "<run_path>", "__main__")) and call[0] != __name__]
    if not calls:
        return "an unknown place"
    _, file, line = (ours or calls)[-1]
    return f"{'/'.join(Path(file).parts[-2:])}:{line}"
