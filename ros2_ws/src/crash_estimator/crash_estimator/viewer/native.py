"""Rerun's native viewer, where there is a screen."""

import os
import subprocess
from pathlib import Path

import rerun_cli


def viewer_binary() -> str:
    """The viewer itself; `rerun` on the PATH is a wrapper that would have to be ended as well."""
    return str(Path(rerun_cli.__file__).with_name("rerun"))


def has_display() -> bool:
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def open_viewer(url: str) -> subprocess.Popen:
    """Show what the server at `url` has; the window stays when this program ends. Raises OSError."""
    return subprocess.Popen(
        [viewer_binary(), "--connect", url, "--hide-welcome-screen"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,  # Ctrl-C ends the demonstration, not the window that shows its result
        env={**os.environ, "RERUN_APP_ONLY": "true"},
    )
