"""The HTTP client: says who it is, asks one thing at a time, waits longer after each failure, gives up with a reason.

Nothing that an answer says is followed but a package's own URL, and that only on the database's hosts.
"""

import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any
from urllib.parse import urljoin, urlsplit

import requests
from requests import exceptions as failures
from urllib3.exceptions import HTTPError as BrokenAnswer

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
IN_VAIN = (failures.InvalidURL, failures.InvalidSchema, failures.MissingSchema, failures.SSLError,
           failures.TooManyRedirects, failures.InvalidProxyURL)  # fmt: skip
"""What asking again does not mend."""


class Missing(Exception):
    """The server answers that it has not got what was asked for."""


class Unreachable(RecordingError):
    """The server did not answer, as often as it was asked."""


class Refused(Exception):
    """An answer that is none: its status."""

    def __init__(self, response: requests.Response):
        super().__init__(f"status {response.status_code} {response.reason}")
        self.code, self.headers = response.status_code, response.headers


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
        pause, why, tried = self.first_wait, "", 0
        for tried in range(1, self.attempts + 1):
            if tried > 1:
                self.wait(pause)
                pause *= 2.0
            try:
                return attempt()
            except Refused as error:
                why = str(error)
                if error.code in (404, 410):
                    raise Missing(url) from None
                if error.code not in TRY_AGAIN:
                    break
                pause = max(pause, _asked_pause(error.headers))
                if pause > LONGEST_WAIT:
                    break
            except IN_VAIN as error:
                why = _reason(error)
                break
            except (OSError, BrokenAnswer) as error:  # time-outs, broken connections; those of requests are OSErrors
                why = _reason(error)
        attempts = "1 attempt" if tried == 1 else f"{tried} attempts"
        raise Unreachable(f"{url}: no answer in {attempts} ({why}): try again later")

    @cached_property
    def _session(self) -> requests.Session:
        """One connection for all curves. Packed answers are not asked for: lengths and ranges are in bytes."""
        session = _DatabaseSession(self._check_host)
        session.headers.update({"User-Agent": AGENT, "Accept-Encoding": "identity"})
        return session

    def _open(self, url: str, start: int = 0) -> requests.Response:
        headers = {"Range": f"bytes={start}-"} if start else {}
        response = self._session.get(url, headers=headers, timeout=self.timeout, stream=True)
        if not response.ok:
            response.close()
            raise Refused(response)
        return response

    def _whole(self, url: str, limit: limits.Range) -> bytes:
        body = bytearray()
        with self._open(url) as response:
            while len(body) <= limit.highest and (chunk := response.raw.read1(CHUNK, decode_content=True)):
                body += chunk
            if len(body) <= limit.highest and len(body) < _length(response):
                raise ConnectionError(f"{len(body)} of {_length(response)} bytes came")
        if wrong := limits.count_wrong("has", len(body), limit):
            raise RecordingError(f"{url}: {wrong}")
        return bytes(body)

    def _append(self, url: str, to: Path) -> None:
        had = to.stat().st_size if to.exists() else 0
        try:
            response = self._open(url, had)
        except Refused as error:
            if error.code == 416:  # nothing after what is here: complete, or another file by now
                return
            raise
        with response:
            if had and response.status_code != 206:  # it sends all of it again
                had = 0
            length = _length(response)
            total = had + length
            if wrong := limits.count_wrong("has", total, limits.PACKAGE):
                raise RecordingError(f"{url}: {wrong}")
            with to.open("ab" if had else "wb") as file:
                come = had
                counter = Counter("downloading, MB", max(1, total // 1_000_000))
                # read1: what has come when the connection breaks is written, and gone on with
                while chunk := response.raw.read1(CHUNK):
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


class _DatabaseSession(requests.Session):
    """Redirections stay on the database's hosts."""

    def __init__(self, check_host: Callable[[str], None]):
        super().__init__()
        self.check_host = check_host

    def get_redirect_target(self, resp: requests.Response) -> str | None:
        target = super().get_redirect_target(resp)
        if target:
            self.check_host(urljoin(resp.url, target))
        return target


def _length(response: requests.Response) -> int:
    """Bytes that the server says will come; 0 where it does not, or sends them packed all the same."""
    stated = response.headers.get("Content-Length", "")
    return int(stated) if stated.isdigit() and not response.headers.get("Content-Encoding") else 0


def _reason(error: BaseException) -> str:
    """The innermost cause in its own words: the libraries wrap it in theirs, with the whole URL in each."""
    while cause := error.__cause__ or error.__context__:
        error = cause
    return str(error) or type(error).__name__


def _asked_pause(headers: Mapping[str, str]) -> float:
    """s, of Retry-After where it is a number."""
    stated = headers.get("Retry-After", "") or ""
    return float(stated) if stated.isdigit() else 0.0
