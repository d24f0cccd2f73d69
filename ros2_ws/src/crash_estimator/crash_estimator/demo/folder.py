"""A folder of its own for each demonstration, so that two side by side do not write into each other's files."""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path


@contextmanager
def claim(out: Path, source: Path) -> Iterator[Path]:
    """out/NAME, by the recording's name, or out/NAME-2 and so on while another demonstration has it."""
    name = source.resolve().name if source.is_dir() else source.stem
    for k in count(1):
        folder = out / (name if k == 1 else f"{name}-{k}")
        folder.mkdir(parents=True, exist_ok=True)
        mark = os.open(folder, os.O_RDONLY)
        try:
            fcntl.flock(mark, fcntl.LOCK_EX | fcntl.LOCK_NB)  # gone with the process, however that ends
        except OSError:
            os.close(mark)
            continue
        try:
            yield folder
        finally:
            os.close(mark)
            with suppress(OSError):  # it stays where something is in it
                folder.rmdir()
        return
