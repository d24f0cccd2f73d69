"""The HTTP client: says who it is, asks one thing at a time, waits longer after each failure, gives up with a reason.

Nothing that an answer says is followed but a package's own URL, and that only on the database's hosts.
"""

import json
import time
import urllib.error
import urllib.request
from collections.abc import Callable
from dataclasses import dataclass
from email.message import Message
from http.client import HTTPException
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from .. import limits
from ..progress import Counter
from ..recording import RecordingError

API = "https://nrd.api.nhtsa.dot.gov/nhtsa/vehicle/api/v1"
CURVES = "https://nrd-static.nhtsa.dot.gov/tsv/vehdb"
DOMAIN = ".nhtsa.dot.gov"
AGENT = "crash_replay/0.1 (crash test research; one request at a time)"
CHUNK = 1 << 18  # bytes
TRY_AGAIN = (408, 429, 500, 502, 503, 504)
LONGEST_WAIT = 60.0
"""s: a server that asks for a longer pause is not waited for."""


class Missing(Exception):
    """The server answers that it has not got what was asked for."""


class Unreachable(RecordingError):
    """The server did not answer, as often as it was asked."""


@dataclass(frozen=True)
class PoliteClient:
    api: str = API
    curves: str = CURVES
    timeout: float = 120.0  # s; answers of a minute are normal
    attempts: int = 4
    first_wait: float = 2.0  # s, doubled after each failure
    wait: Callable[[float], None] = time.sleep

    def answer(self, path: str) -> Any:
        """What the API says under a path: `results` of its JSON. Raises Missing, Unreachable or RecordingError."""
        url = f"{self.api}/{path}"
        body = self._again(url, lambda: self._whole(url, limits.ANSWER))
        try:
            content = json.loads(body)
            return content["results"]
        except (ValueError, KeyError, TypeError, RecursionError):
            raise RecordingError(f"{url}: expected JSON with `results`, found {limits.shown(body[:60])}") from None

    def curve(self, number: int, curve: int) -> bytes:
        """A curve's text. Raises as `answer` does."""
        folder = f"v{number // 10_000 * 10_000:05d}/v{number // 100 * 100:05d}/v{number:05d}"
        url = f"{self.curves}/{folder}/v{number:05d}tsv.{curve:03d}"
        return self._again(url, lambda: self._whole(url, limits.CURVE_FILE))

    def download(self, url: str, to: Path) -> None:
        """A file, from where an earlier attempt has left `to`. Raises as `answer` does."""
        self._check_host(url)
        self._again(url, lambda: self._append(url, to))

    def _again(self, url: str, attempt: Callable[[], Any]) -> Any:
        pause, why = self.first_wait, ""
        for k in range(self.attempts):
            if k:
                self.wait(pause)
                pause *= 2.0
            try:
                return attempt()
            except urllib.error.HTTPError as error:
                why = f"status {error.code} {error.reason}"
                if error.code in (404, 410):
                    raise Missing(url) from None
                if error.code not in TRY_AGAIN:
                    break
                pause = max(pause, _asked_pause(error.headers))
                if pause > LONGEST_WAIT:
                    break
            except (OSError, HTTPException) as error:  # time-outs, broken connections, URLError
                why = str(getattr(error, "reason", error)) or type(error).__name__
        raise Unreachable(f"{url}: no answer in {self.attempts} attempts ({why}): try again later")

    def _open(self, url: str, start: int = 0):
        headers = {"User-Agent": AGENT} | ({"Range": f"bytes={start}-"} if start else {})
        request = urllib.request.Request(url, headers=headers)
        opener = urllib.request.build_opener(_SameHosts(self))
        return opener.open(request, timeout=self.timeout)

    def _whole(self, url: str, limit: limits.Range) -> bytes:
        with self._open(url) as response:
            body = response.read(int(limit.highest) + 1)
            _check_whole(response.headers, len(body))
        if wrong := limits.count_wrong("has", len(body), limit):
            raise RecordingError(f"{url}: {wrong}")
        return body

    def _append(self, url: str, to: Path) -> None:
        had = to.stat().st_size if to.exists() else 0
        try:
            response = self._open(url, had)
        except urllib.error.HTTPError as error:
            if error.code == 416:  # nothing after what is here: complete, or another file by now
                return
            raise
        with response:
            if had and response.status != 206:  # it sends all of it again
                had = 0
            length = int(response.headers.get("Content-Length") or 0)
            total = had + length
            if wrong := limits.count_wrong("has", total, limits.PACKAGE):
                raise RecordingError(f"{url}: {wrong}")
            with to.open("ab" if had else "wb") as file:
                come = had
                counter = Counter("downloading, MB", max(1, total // 1_000_000))
                while chunk := response.read(CHUNK):
                    come += len(chunk)
                    if wrong := limits.count_wrong("has", come, limits.PACKAGE):
                        raise RecordingError(f"{url}: {wrong}")
                    file.write(chunk)
                    counter.at(come // 1_000_000)
            if length and come < total:
                raise ConnectionError(f"{come} of {total} bytes came")

    def _check_host(self, url: str) -> None:
        parts, ours = urlsplit(url), {urlsplit(self.api).netloc, urlsplit(self.curves).netloc}
        if parts.netloc in ours or (parts.scheme == "https" and f".{parts.hostname}".endswith(DOMAIN)):
            return
        raise RecordingError(f"{limits.shown(url)}: not on a host of NHTSA's: not followed")


class _SameHosts(urllib.request.HTTPRedirectHandler):
    """Redirections stay on the database's hosts."""

    def __init__(self, client: PoliteClient):
        self.client = client

    def redirect_request(self, request, file, code, message, headers: Message, url: str):
        self.client._check_host(url)
        return super().redirect_request(request, file, code, message, headers, url)


def _check_whole(headers: Message, length: int) -> None:
    stated = headers.get("Content-Length", "")
    if stated.isdigit() and length < int(stated):
        raise ConnectionError(f"{length} of {stated} bytes came")


def _asked_pause(headers: Message) -> float:
    """s, of Retry-After where it is a number."""
    stated = (headers or {}).get("Retry-After", "") or ""
    return float(stated) if stated.isdigit() else 0.0
