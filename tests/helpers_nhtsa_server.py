"""A server on this machine that answers as NHTSA's database does, faults included."""

import json
import re
import time
import zipfile
from collections.abc import Mapping
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from io import BytesIO
from pathlib import Path
from threading import Thread
from types import MappingProxyType

from crash_replay.nhtsa_database.curve_by_curve import DETAILS, INSTRUMENTATION, TEST
from crash_replay.nhtsa_database.polite_client import PoliteClient


class Database:
    """One test, from an EV5 folder. `faults`: part of a path -> what happens there, one after the other: 500, 404, 429,
    "silent", "cut" (half of the answer), "html"."""

    def __init__(self, folder: Path, number: int):
        self.folder, self.number = folder, number
        self.faults: dict[str, list] = {}
        self.asked: list[tuple[str, str, str]] = []  # path, range, user agent
        self.package = packed(folder)
        self.documents = lambda url: [
            {"evFiles": [f"{url}/files/v{number:05d}ev5.zip"], "udsFiles": [], "isoFiles": None}
        ]
        self.metadata = metadata_of(folder, number)
        self.one_column = False
        self.moved: dict[str, str] = {}  # path -> where the answer says that it is now
        self.url = ""

    def answer(self, path: str) -> bytes | None:
        """The body, None for 404."""
        number = self.number
        if path.startswith("/files/"):
            return self.package
        if found := re.fullmatch(r"/tsv/v00000/v07200/v07292/v07292tsv\.(\d{3})", path):
            file = self.folder / f"v{number:05d}.{found[1]}"
            text = file.read_text() if file.exists() else None
            if text and self.one_column:
                text = "".join(line.split("\t")[1] + "\n" for line in text.splitlines())
            return text and text.encode()
        api = path.removeprefix("/api/").split("?")[0]
        if api in (
            f"vehicle-documents/test-no/{number}",
            f"vehicle-database-test-results/get-multimedia-files/{number}",
        ):
            return enveloped(self.documents(self.url))
        if api == f"vehicle-database-test-results/metadata/{number}":
            return enveloped(self.metadata)
        if api == f"vehicle-database-test-results/get-instrumentation-info/{number}":
            short = ("CURNO", "SENTYP", "SENLOC", "SENATT", "AXIS", "YUNITS", "CHSTAT", "DASTAT")
            return enveloped([{DETAILS[key]: row[key] for key in short} for row in rows_of(self.folder, number)])
        if found := re.fullmatch(rf"vehicle-database-test-results/get-instrumentation-detail-info/(\d+)/{number}", api):
            row = next(row for row in rows_of(self.folder, number) if row["CURNO"] == found[1])
            return enveloped([{theirs: row[ours] for ours, theirs in DETAILS.items()} | {"asciiFile": "ASCII X-Y"}])
        return enveloped([]) if api.startswith("vehicle") else None


def enveloped(results) -> bytes:
    total = len(results) if isinstance(results, list) else 1
    pages = {"pageNumber": 0, "count": 20, "total": total, "currentUrl": "wrong", "nextUrl": None, "previousUrl": None}
    meta = {"pagination": pages, "status": 200, "message": "Success", "error": ""}
    return json.dumps({"meta": meta, "results": results}).encode()


def rows_of(folder: Path, number: int) -> list[dict[str, str]]:
    lines = (folder / f"v{number:05d}.EV5").read_text(encoding="latin-1").splitlines()
    start = next(k for k, line in enumerate(lines) if "INSTRUMENTATION" in line)
    return [dict(zip(INSTRUMENTATION, line.split("|"))) for line in lines[start + 1 :] if "|" in line]


def metadata_of(folder: Path, number: int) -> dict:
    """Numbers as text, as they come."""
    lines = (folder / f"v{number:05d}.EV5").read_text(encoding="latin-1").splitlines()
    test = dict(zip(TEST, lines[3].split("|")[1:], strict=False))
    vehicles = [line.split("|") for line in lines[5 : lines.index("----- INSTRUMENTATION -----")]]
    vehicles = [{"VEHNO": fields[0], "VEHTWT": fields[10], "VEHSPD": "N/A"} for fields in vehicles]
    return {"TEST": [test], "VEHICLE": vehicles, "BARRIER": None, "OCCUPANT": None, "RESTRAINT": None,
            "INSTRUMENTATION": rows_of(folder, number), "URL": "wrong", "REPORTS": None}  # fmt: skip


def packed(folder: Path, more: Mapping[str, bytes] = MappingProxyType({}), inside: str = "ev5/") -> bytes:
    file = BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sorted(folder.iterdir()):
            archive.write(path, inside + path.name)
        for name, content in more.items():
            archive.writestr(name, content)
    return file.getvalue()


@contextmanager
def served(database: Database):
    """The server's URL."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self):
            asked = self.headers.get("Range", "")
            database.asked.append((self.path, asked, self.headers.get("User-Agent", "")))
            waiting = next((faults for part, faults in database.faults.items() if part in self.path and faults), None)
            fault = waiting.pop(0) if waiting else None
            if self.path in database.moved:
                self.send_response(302)
                self.send_header("Location", database.moved[self.path])
                self.end_headers()
                return
            body = database.answer(self.path)
            if fault == "silent":
                time.sleep(0.6)
                self.close_connection = True
                return
            if isinstance(fault, int):
                self.send_error(fault)
                return
            if body is None:
                self.send_error(404)
                return
            if fault == "html":
                body = b"<html>maintenance</html>"
            start = int(asked[6:-1]) if asked else 0
            if start >= len(body):
                self.send_error(416)
                return
            body = body[start:]
            self.send_response(206 if start else 200)
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body[: len(body) // 2] if fault == "cut" else body)

        def log_message(self, *_):
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.daemon_threads = True
    thread = Thread(target=server.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True)
    thread.start()
    database.url = f"http://127.0.0.1:{server.server_address[1]}"
    try:
        yield database.url
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


def client_of(url: str, waited: list[float], timeout: float = 0.4) -> PoliteClient:
    """One that notes its pauses instead of waiting."""
    return PoliteClient(f"{url}/api", f"{url}/tsv", timeout=timeout, wait=waited.append)
