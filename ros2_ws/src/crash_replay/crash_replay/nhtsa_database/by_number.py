"""`nhtsa:10146`: the folder of a test, from the cache or from NHTSA's database.

What has come once is kept below CRASH_CACHE (or the user's cache folder) as an EV5 folder, and not asked again. What an
interrupted attempt has left is gone on with: the package from its last byte, the curves from the last one.
"""

import fcntl
import os
import re
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ..fault import tell
from ..limits import TEST_NUMBER
from ..output import named
from ..recording import RecordingError
from .curve_by_curve import assemble
from .package import DamagedPackage, unpack
from .polite_client import API, CURVES, Missing, PoliteClient, Unreachable

PREFIX = "nhtsa:"
CACHE, OTHER_API, OTHER_CURVES = "CRASH_CACHE", "CRASH_NHTSA_API", "CRASH_NHTSA_CURVES"
"""Environment: where tests are kept, and a mirror of the database."""
FORMS = tuple(
    re.compile(rf"(^|[\W_]){form}(files)?([\W_]|$)", re.IGNORECASE) for form in ("ev5?", "iso", "uds")
)  # fmt: skip
"""What answers call the packages that can be read, the preferred first: evFiles, "EV5 data", URL_EV5."""


def folder_of(source: str, client: PoliteClient | None = None) -> Path:
    """The folder of `nhtsa:NUMBER`, fetched where it is not there yet. Raises RecordingError with one readable line."""
    number = _number(source)
    cache = cache_folder()
    folder = cache / f"v{number:05d}"
    with named(cache):
        cache.mkdir(parents=True, exist_ok=True)
        with _alone(cache / f"v{number:05d}.lock"):
            if not folder.is_dir():
                _fetch(client or _client(), number, folder)
    return folder


def cache_folder() -> Path:
    if given := os.environ.get(CACHE):
        return Path(given)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "crash_replay" / "nhtsa"


def _client() -> PoliteClient:
    return PoliteClient(os.environ.get(OTHER_API) or API, os.environ.get(OTHER_CURVES) or CURVES)


def _number(source: str) -> int:
    text = source.removeprefix(PREFIX)
    if not re.fullmatch(r"\d{1,5}", text, re.ASCII) or TEST_NUMBER.wrong(int(text)):
        raise RecordingError(
            f"{source}: expected {PREFIX}NUMBER with the number of a vehicle test in NHTSA's database, such as "
            f"{PREFIX}10146"
        )
    return int(text)


@contextmanager
def _alone(lock: Path) -> Iterator[None]:
    """Of two processes that want the same test, one waits for the other."""
    with lock.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def _fetch(client: PoliteClient, number: int, folder: Path) -> None:
    """The package, or where there is none that can be read, the curves; the folder appears when it is complete."""
    tell(f"{PREFIX}{number}: asking NHTSA's database; it may take minutes, once (kept in {folder})")
    parts = folder.with_suffix(".part")  # what has come so far
    parts.mkdir(exist_ok=True)
    try:
        why = _by_package(client, number, parts)
        if why:
            tell(f"{PREFIX}{number}: {why}: curve by curve instead")
            assemble(client, number, parts)
    except Unreachable as error:
        raise RecordingError(
            f"{PREFIX}{number}: {error}; what has come is kept and gone on with. An EV5 folder of the test that you "
            f"have can be put at {folder}"
        ) from None
    parts.replace(folder)


def _by_package(client: PoliteClient, number: int, parts: Path) -> str:
    """Why there is no package that can be used, or "" when its content is in `parts`."""
    url = _package_url(client, number)
    if not url:
        return "no package of a form that can be read"
    package, scratch = parts.with_suffix(".zip"), parts.with_suffix(".unpacked")
    for _ in range(2):  # once more from the beginning where what was gone on with does not fit together
        try:
            client.download(url, package)
        except Missing:
            return "its package is missing"
        shutil.rmtree(scratch, ignore_errors=True)
        scratch.mkdir()
        try:
            unpack(package, scratch)
        except (DamagedPackage, RecordingError) as error:
            why = f"its package cannot be used ({error})"
            package.unlink()
            shutil.rmtree(scratch)
            if isinstance(error, RecordingError):
                break
            continue
        shutil.rmtree(parts)
        scratch.replace(parts)
        package.unlink()
        return ""
    return why


def _package_url(client: PoliteClient, number: int) -> str:
    """Of the test's zip; "" where no answer names one."""
    for path in (f"vehicle-documents/test-no/{number}", f"vehicle-database-test-results/get-multimedia-files/{number}"):
        try:
            found = list(_urls(client.answer(path)))
        except Missing:
            continue
        for form in FORMS:
            for kind, url in found:
                if form.search(kind):
                    return url
    return ""


def _urls(answer: Any, kind: str = "") -> Iterator[tuple[str, str]]:
    """(what it is, URL) of every zip that an answer names: under its kind's key, or in rows of url and documentType."""
    if isinstance(answer, str):
        if answer.lower().split("?")[0].endswith(".zip"):
            yield kind, answer
    elif isinstance(answer, list):
        for item in answer:
            yield from _urls(item, kind)
    elif isinstance(answer, Mapping):
        own = str(answer.get("documentType") or "") or kind
        for key, value in answer.items():
            yield from _urls(value, own if key.lower() == "url" else key)
