"""The demonstration's processes: started side by side, watched, and ended with it."""

import json
import re
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from ament_index_python.packages import get_package_prefix

from crash_replay.output import named
from crash_replay.processes import ends_with_this
from crash_replay.starting import held

POLITE = 16.0
"""s that a process has to end by itself: the viewer writes its file's end."""
LOG_HEAD = re.compile(r"^\[(?P<level>\w+)\] \[[\d.]+\] \[[^]]+\]: ")
"""[INFO] [1763000000.123] [replay]: in front of what a node says."""


class Child:
    """One process; what it says goes to a file, so that it does not disturb the progress line."""

    def __init__(self, name: str, command: Sequence[str], log: Path, environment: Mapping[str, str]):
        self.name, self.log = name, log
        self._read = 0  # bytes of the log
        with log.open("wb") as file, held():
            self.process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=file,
                stderr=subprocess.STDOUT,
                env=dict(environment),
                start_new_session=True,  # Ctrl-C reaches the demonstration alone, which then ends the others in order
                preexec_fn=ends_with_this(),
            )

    @property
    def status(self) -> int | None:
        """Exit status; None while it runs."""
        return self.process.poll()

    def messages(self) -> list[tuple[str, str]]:
        """(level, text) of the log messages that have come since the last time; other output is left out."""
        with self.log.open("rb") as file:
            file.seek(self._read)
            said = file.read()
        complete = said[: said.rfind(b"\n") + 1]
        self._read += len(complete)
        lines = complete.decode("utf-8", "replace").splitlines()
        return [(head["level"], line[head.end() :]) for line in lines if (head := LOG_HEAD.match(line))]

    def last_line(self) -> str:
        """What it said last."""
        lines = self.log.read_text(encoding="utf-8", errors="replace").split("\n")
        return next((LOG_HEAD.sub("", line) for line in reversed(lines) if line.strip()), "")

    def last_words(self) -> str:
        """Why it ended: its last line and its exit status."""
        status = self.process.returncode
        how = f"signal {-status}" if status and status < 0 else f"exit status {status}"
        return f"{self.last_line()} ({how})" if self.last_line() else how


class Children:
    """Starts processes and ends all of them, whatever happens: use as a context."""

    def __init__(self, logs: Path, environment: Mapping[str, str]):
        with named(logs):
            logs.mkdir(parents=True, exist_ok=True)
        self.logs, self.environment = logs, environment
        self.all: dict[str, Child] = {}

    def __enter__(self) -> "Children":
        return self

    def __exit__(self, *_) -> None:
        end(list(self.all.values()))

    def start(self, name: str, package: str, executable: str, node: str | None = None, **parameters) -> Child:
        """A node of a package, with parameters, under a name of its own."""
        path = Path(get_package_prefix(package)) / "lib" / package / executable
        # By this Python, not by the script's first line, which does not work where the path to it has a space in it.
        command = [sys.executable, str(path), "--ros-args"]
        command += ["-r", f"__node:={node}"] if node else []
        for key, value in parameters.items():
            command += ["-p", f"{key}:={_yaml(value)}"]
        child = self.all[name] = Child(name, command, self.logs / f"{name}.log", self.environment)
        return child


def end(children: Sequence[Child], patience: float = POLITE) -> None:
    """End processes that still run: they are asked to, and killed if they do not or if one does not wait for it."""
    running = [child.process for child in children if child.status is None]
    for process in running:
        process.terminate()
    deadline = time.monotonic() + patience
    try:
        while time.monotonic() < deadline and any(process.poll() is None for process in running):
            time.sleep(0.02)
    finally:
        for process in running:
            if process.poll() is None:
                process.kill()
                process.wait()


def _yaml(value: object) -> str:
    """A parameter's value as ROS reads it: JSON is YAML, and its quotes keep a text a text."""
    return json.dumps(value)
