"""A test's zip package: is it whole, is it no bomb, and what of it is a recording."""

import re
import zipfile
import zlib
from pathlib import Path

from .. import limits
from ..recording import RecordingError

WANTED = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9_.-]{0,60}\.(EV5|MME|CHN|UDS|\d{3,4})", re.IGNORECASE)
HEADERS = (".EV5", ".MME", ".UDS")
"""A header or a curve; whatever else lies in the package stays there."""
COPIED = 1 << 20


class DamagedPackage(Exception):
    """The package is not whole, or holds no recording."""


def unpack(package: Path, folder: Path) -> None:
    """The headers and curves of a package, all into one folder that exists.

    Sizes are counted as they come out, not believed. Raises DamagedPackage, and RecordingError for what is too large.
    """
    try:
        with zipfile.ZipFile(package) as archive:
            wanted = [entry for entry in archive.infolist() if WANTED.fullmatch(Path(entry.filename).name)]
            if wrong := limits.count_wrong("has", len(archive.infolist()), limits.PACKED_FILES):
                raise RecordingError(f"{package.name}: {wrong}")
            if not any(entry.filename.upper().endswith(HEADERS) for entry in wanted):
                raise DamagedPackage("it has no .EV5 and no .mme header, and no UDS file")
            allowed = max(limits.UNPACKED_SMALL, limits.UNPACKED_RATIO * package.stat().st_size)
            left = int(min(limits.UNPACKED.highest, allowed))
            for entry in wanted:
                left -= _copy(archive, entry, folder / Path(entry.filename).name, left, package.name)
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError) as error:
        raise DamagedPackage(str(error) or type(error).__name__) from None


def _copy(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, to: Path, left: int, package: str) -> int:
    """Bytes of one entry; its checksum is tested at its end."""
    most = min(left, int(limits.CURVE_FILE.highest))
    come = 0
    with archive.open(entry) as source, to.open("wb") as target:
        while chunk := source.read(COPIED):
            come += len(chunk)
            if come > most:
                raise RecordingError(
                    f"{package}: {limits.shown(entry.filename)} unpacks to more than the {most} bytes allowed: "
                    "it is no package of NHTSA's"
                )
            target.write(chunk)
    return come
