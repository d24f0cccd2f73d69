"""Recordings from files, one format a file; the format is found from what is there."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from .. import forms
from ..bag import read_bag
from ..bag_namespace import parted
from ..recording import Recording, RecordingError
from . import csv_yaml, isomme, nhtsa, nhtsa_uds
from .description import apply_names

NHTSA = "nhtsa:"


class Reader(NamedTuple):
    """A format: how it is recognised and read, and which options it takes."""

    expects: str
    found: Callable[[Path], bool]
    read: Callable[..., Recording]
    options: tuple[str, ...] = ()


def is_bag(path: Path) -> bool:
    """A rosbag2 folder or an .mcap file, as far as its names tell."""
    path, _ = parted(path)
    return path.suffix == ".mcap" or (path.is_dir() and ((path / "metadata.yaml").exists() or any(path.glob("*.mcap"))))


READERS = (
    Reader(forms.CSV, csv_yaml.found, csv_yaml.read),
    Reader(forms.EV5, nhtsa.found, nhtsa.read, ("cells", "all_sensors")),
    Reader(forms.UDS, nhtsa_uds.found, nhtsa_uds.read, ("cells", "all_sensors")),
    Reader(forms.MME, isomme.found, isomme.read, ("all_sensors",)),
    Reader(forms.BAG, is_bag, read_bag, ("recover",)),
)


def read_source(path: str | Path, names: str | Path | None = None, **options: Any) -> Recording:
    """The recording at `path` (or of NHTSA's test `nhtsa:NUMBER`), in whichever format it is.

    `options` that are None or False are not given. `names` is a YAML file that renames channels and sets bodies (see
    `description.Names`); without it, `import.yaml` in the folder does. Raises RecordingError with one readable line.
    """
    path = _folder_or_file(path)
    reader = _reader_for(path)
    given = {option: value for option, value in options.items() if value not in (None, False)}
    for option in given:
        if option not in reader.options:
            raise RecordingError(f"{path}: {reader.expects} takes no option {option!r}; leave it out")
    recording = reader.read(path, **given)
    if not recording.has_values:
        raise RecordingError(f"{path}: no channel has a valid value at any sample: there is nothing in it to use")
    beside = path / "import.yaml"
    if names is None and path.is_dir() and beside.is_file():
        names = beside
    return apply_names(recording, Path(names)) if names else recording


def name_of(source: str | Path) -> str:
    """What files made of a recording are called after: crash of crash.csv, two-sled_a of two.mcap#sled_a, nhtsa-10146
    of nhtsa:10146."""
    if str(source).startswith(NHTSA):
        return str(source).replace(":", "-")
    path, namespace = parted(source)
    name = path.resolve().name if path.is_dir() else path.stem
    return name + (namespace or "").replace("/", "-")


def _folder_or_file(source: str | Path) -> Path:
    if not str(source).startswith(NHTSA):
        return Path(source)
    from ..nhtsa_database.by_number import folder_of  # takes the HTTP client, which no other source needs

    return folder_of(str(source))


def _reader_for(path: Path) -> Reader:
    if not parted(path)[0].exists():
        raise RecordingError(f"{path}: there is no such file or folder")
    for reader in READERS:
        if reader.found(path):
            return reader
    expected = "; ".join(reader.expects for reader in READERS)
    raise RecordingError(f"{path}: no recording of a known form; expected one of: {expected}")
