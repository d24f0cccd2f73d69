"""Rerun's web viewer, where there is no screen: a page on 127.0.0.1 that any browser of this machine shows."""

import os
import subprocess
from pathlib import Path
from urllib.parse import quote

from crash_replay.processes import ends_with_this

from .native import viewer_binary
from .sinks import usable_port


class WebViewer:
    """The page's server: Rerun's own files, and nothing else."""

    def __init__(self, data: str, port: int = 0):
        """data: URL of the gRPC server whose recordings the page shows; port: 0, or one in use: a free one is taken."""
        self.port = usable_port(port)
        self.process = _serve(data, f"--web-viewer-port={self.port}")
        self.page = page(self.port, data)

    def close(self) -> None:
        self.process.terminate()
        self.process.wait()


class WebFile(WebViewer):
    """The page and the data of one finished .rrd file."""

    def __init__(self, rrd: Path, port: int = 0, data_port: int = 0):
        self.port, data_port = usable_port(port), usable_port(data_port)
        self.process = _serve(str(rrd), f"--web-viewer-port={self.port}", f"--port={data_port}")
        self.page = page(self.port, f"rerun+http://127.0.0.1:{data_port}/proxy")


def page(port: int, data: str) -> str:
    """The address for a browser."""
    return f"http://127.0.0.1:{port}/?url={quote(data, safe='')}"


def _serve(what: str, *options: str) -> subprocess.Popen:
    return subprocess.Popen(
        [viewer_binary(), "--serve-web", "--bind=127.0.0.1", *options, what],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "BROWSER": "true", "RERUN_APP_ONLY": "true"},  # the address is said; none is opened
        start_new_session=True,
        preexec_fn=ends_with_this(),
    )
