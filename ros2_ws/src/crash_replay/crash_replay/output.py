"""The one way of writing files: whole or not at all, and never onto what the same command reads.

A file is written in a folder of its own beside its place and put there when it is complete and on the disk: where the
disk is full, or the command is stopped, what was there before is there still.
"""

import errno
import os
import shutil
import stat
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

from .bag_namespace import parted
from .fault import Fault
from .foreign_text import visible

DESCRIPTIONS = (".yaml", ".yml")
"""Beside a CSV."""


class OutputError(Fault):
    """A file cannot be written, or must not be; the message is one readable line."""


def write_text(path: str | Path, text: str) -> None:
    write_bytes(path, text.encode("utf-8", "backslashreplace"))


def write_bytes(path: str | Path, content: bytes) -> None:
    with written(path) as file:
        file.write_bytes(content)


@contextmanager
def written(path: str | Path) -> Iterator[Path]:
    """A place of the same name to write a file or a folder to; what is there at the end takes the place of `path`.

    Folders on the way are made; a link stays and what it names is written. A device or a pipe is written directly.
    Raises OutputError where it cannot be written, and leaves nothing then.
    """
    path = Path(path)
    with named(path):
        if path.exists() and not (path.is_file() or path.is_dir()):
            yield path
            return
        target = Path(os.path.realpath(path))
        _writable(target)
        target.parent.mkdir(parents=True, exist_ok=True)
        with _scratch(target.parent, target.name) as folder:
            yield folder / target.name
            _put(folder / target.name, target)


@contextmanager
def written_into(folder: str | Path) -> Iterator[Path]:
    """A place to write files to that belong together; they go to `folder`, beside what else is there, when the last is
    complete. Raises OutputError as `written` does."""
    folder = Path(folder)
    with named(folder):
        made = not folder.exists()
        folder.mkdir(parents=True, exist_ok=True)
        try:
            with _scratch(folder) as scratch:
                yield scratch
                files = sorted(scratch.iterdir())
                for file in files:
                    _writable(folder / file.name)
                for file in files:
                    _put(file, Path(os.path.realpath(folder / file.name)))
        except BaseException:
            if made:
                with suppress(OSError):  # it stays where something is in it
                    folder.rmdir()
            raise


@contextmanager
def named(path: str | Path) -> Iterator[None]:
    """What the system says while `path` is written, with its name."""
    try:
        yield
    except OSError as error:
        raise OutputError(f"{visible(path)}: cannot be written: {error.strerror or error}") from None


def check_outputs(
    files: Mapping[str, str | Path | None],
    inputs: Iterable[str | Path | None],
    folders: Mapping[str, str | Path | None] = {},
) -> None:
    """Before anything is read: every output, by the option that names it, can be made and is none of the inputs.

    folders: outputs that may be one. What lies in an input's folder, and the description beside a CSV, are inputs too.
    None: not given. Raises OutputError with option and file.
    """
    read = [parted(path)[0] for path in inputs if path is not None]
    outputs = {option: Path(path) for option, path in {**folders, **files}.items() if path is not None}
    for option, path in outputs.items():
        if option not in folders and path.is_dir():
            raise OutputError(f"{option} {visible(path)} is a folder: give the file to write")
        _check_not_read(option, path, read)
        _check_can_be_made(option, path)
    first = {}
    for option, path in outputs.items():
        other = first.setdefault(os.path.realpath(path), option)
        if other != option:
            raise OutputError(f"{other} and {option} both name {visible(path)}: give two files")


def _check_not_read(option: str, path: Path, inputs: Iterable[Path]) -> None:
    for given in inputs:
        if any(_same(path, file) for file in _read_with(given)):
            raise OutputError(f"{option} {visible(path)} is what this command reads: give another name")
        if given.is_dir() and _same(path.parent, given):
            raise OutputError(
                f"{option} {visible(path)} lies in {visible(given)}, which this command reads: write elsewhere"
            )


def _read_with(path: Path) -> list[Path]:
    """A recording's or a model's files: of a folder two levels, which is as deep as any form of recording goes."""
    if path.is_dir():
        return [path, *path.glob("*"), *path.glob("*/*")]
    beside = [path.with_suffix(ending) for ending in DESCRIPTIONS] if path.suffix.lower() == ".csv" else []
    return [path, *beside]


def _same(one: Path, other: Path) -> bool:
    """Whether both are the same file: by links of either kind, and where it does not exist by its path."""
    with suppress(OSError):
        return one.samefile(other)
    return os.path.realpath(one) == os.path.realpath(other)


def _check_can_be_made(option: str, path: Path) -> None:
    above = next(folder for folder in Path(os.path.realpath(path)).parents if folder.exists())
    if not above.is_dir():
        raise OutputError(f"{option} {visible(path)}: {visible(above)} cannot be a folder: it is a file")
    if not os.access(above, os.W_OK):
        raise OutputError(f"{option} {visible(path)}: nothing can be written in {visible(above)}")


def _writable(target: Path) -> None:
    """A file that nobody may write is not replaced either."""
    if target.exists() and not os.access(target, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))


@contextmanager
def _scratch(beside: Path, name: str = "") -> Iterator[Path]:
    """A folder of nobody else's, gone at the end."""
    with TemporaryDirectory(dir=beside, prefix=f".{name[:100]}.", ignore_cleanup_errors=True) as folder:
        yield Path(folder)


def _put(complete: Path, target: Path) -> None:
    """In the place of what is there: a file at once; a folder, which cannot be, by way of a name beside it."""
    for file in [complete, *complete.rglob("*")]:
        _to_disk(file)
    if target.is_file():
        complete.chmod(stat.S_IMODE(target.stat().st_mode))
    if not (complete.is_dir() and target.is_dir()):
        complete.replace(target)
        return
    before = complete.with_name(f"{complete.name}.before")
    target.replace(before)
    try:
        complete.replace(target)
    except OSError:
        before.replace(target)
        raise
    shutil.rmtree(before)


def _to_disk(path: Path) -> None:
    opened = os.open(path, os.O_RDONLY)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)
