"""A folder of its own for each demonstration, so that two side by side do not write into each other's files."""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path

from crash_replay.output import named
from crash_replay.readers import name_of


@contextmanager
def claim(out: Path, source: Path) -> Iterator[Path]:
    """out/NAME, by the recording's name, or out/NAME-2 and so on while another demonstration has it, or where it is the
    recording itself. Raises OutputError where it cannot be made."""
    name = name_of(source)
    for k in count(1):
        folder = out / (name if k == 1 else f"{name}-{k}")
        with named(folder):
            folder.mkdir(parents=True, exist_ok=True)
            if source.is_dir() and folder.samefile(source):
                continue
            mark = os.open(folder, os.O_RDONLY)
        try:
            fcntl.flock(mark, fcntl.LOCK_EX | fcntl.LOCK_NB)  # gone with the process, however that ends
        except BlockingIOError:
            os.close(mark)
            continue
        except OSError:
            pass  # a file system without locks: two demonstrations at once are not told apart there
        try:
            yield folder
        finally:
            os.close(mark)
            with suppress(OSError):  # it stays where something is in it
                folder.rmdir()
        return
