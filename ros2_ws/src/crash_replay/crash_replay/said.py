"""What a command says on standard output, and its command line: the one place that prints."""

import argparse
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from .fault import NobodyReads, Usage
from .foreign_text import visible, visible_lines
from .output import OutputError


def say(text: object = "") -> None:
    """Print lines, at once. Raises NobodyReads where a pipe's reader has gone, OutputError where they cannot go out."""
    with going_out():
        print(_in_its_letters(visible_lines(text)), flush=True)


@contextmanager
def going_out() -> Iterator[None]:
    """What writing to standard output may raise, in the terms in which a command ends."""
    try:
        yield
    except BrokenPipeError:
        _say_no_more()
        raise NobodyReads from None
    except OSError as error:
        _say_no_more()
        raise OutputError(f"standard output: cannot be written: {error.strerror or error}") from None


def _say_no_more() -> None:
    """What is still to be written would fail once more when Python ends."""
    sys.stdout = open(os.devnull, "w")


def _in_its_letters(text: str) -> str:
    """What standard output's encoding has no letter for is escaped."""
    encoding = getattr(sys.stdout, "encoding", None) or "utf-8"
    return text.encode(encoding, "backslashreplace").decode(encoding)


class Parser(argparse.ArgumentParser):
    """A command line whose end a command tells from a user's effect that calls sys.exit."""

    def exit(self, status: int = 0, message: str | None = None):
        if message:
            self._print_message(message, sys.stderr)
        raise Usage(status)

    def error(self, message: str):
        super().error(visible(message))

    def print_help(self, file=None) -> None:
        if file is None:
            say(self.format_help().rstrip())
        else:
            super().print_help(file)
