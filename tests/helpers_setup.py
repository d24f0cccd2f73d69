"""A fresh clone to try the set-up and tools/run in, without the network and without minutes.

A stand-in for python notes what the set-up asks of it; the real set-up has run already when tests run.
"""

import shutil
import subprocess
from pathlib import Path

import pytest
from helpers_paths import ROOT

ROS_IS_INSTALLED = shutil.which("ros2") is not None or Path("/opt/ros/jazzy").exists()
wheels_only = pytest.mark.skipif(ROS_IS_INSTALLED, reason="here the installed ROS 2 Jazzy is used, not the wheels")

PREREQUISITES = ["git", "make", "g++", "cmake"]
COMMANDS = "bash cat cp dirname env find flock grep head mkdir readlink rm sed sha256sum sh sleep sort tail".split()
COMMANDS += ["touch", "tr", "uname", "xargs"]

# Notes in $CALLS what it is asked for, and leaves behind what the real one would.
PYTHON = """#!/bin/sh
case "$*" in
    *"-m venv "*) echo venv >>"$CALLS"; for last; do :; done; mkdir -p "$last/bin"; cp "$0" "$last/bin/python" ;;
    *"-m pip "*)
        echo pip >>"$CALLS"
        sleep "${PIP_SECONDS:-0}"
        echo "connection broken: no route to host"
        exit "${PIP_STATUS:-0}" ;;
    *colcon_core*) echo colcon >>"$CALLS"; mkdir -p install; touch install/local_setup.bash ;;
    *get_path*) echo "$INCLUDE" ;;
esac
"""


def script(path: Path, text: str) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    path.chmod(0o755)
    return path


class Clone:
    """A fresh clone with only what the set-up reads, on a machine with only what it needs."""

    def __init__(self, folder: Path):
        self.root = folder / "a clone"  # with a space
        shutil.copytree(ROOT / "tools", self.root / "tools")
        self.message = self.root / "ros2_ws/src/crash_msgs/msg/Event.msg"
        self.message.parent.mkdir(parents=True)
        self.message.write_text("float64 value\n")
        self.bin = folder / "bin"
        self.bin.mkdir()
        for name in COMMANDS:
            (self.bin / name).symlink_to(shutil.which(name))
        for name in PREREQUISITES:
            script(self.bin / name, "#!/bin/sh\n")
        script(self.bin / "python3", PYTHON)
        self.include = folder / "include/python3.11"
        script(self.include / "Python.h", "")
        self.calls_file = folder / "calls"

    def start(self, *command: str, **environment: str) -> subprocess.Popen:
        given = {"PATH": str(self.bin), "CALLS": str(self.calls_file), "INCLUDE": str(self.include)}
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        return subprocess.Popen(command, cwd=self.root, env={**given, **environment}, text=True, **pipes)

    def setup(self, **environment: str) -> tuple[int, str, str]:
        process = self.start("tools/setup", **environment)
        output, errors = process.communicate(timeout=60)
        return process.returncode, output, errors

    def calls(self) -> list[str]:
        """What python was asked for since the last time."""
        calls = self.calls_file.read_text().split() if self.calls_file.exists() else []
        self.calls_file.write_text("")
        return calls
