"""The processes of a run: started, disturbed and looked at by name."""

import fcntl
import os
import pty
import select
import signal
import subprocess
import sys
import termios
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from threading import Thread

from ament_index_python.packages import get_package_prefix

from crash_replay.processes import end_with, has_ended
from crash_replay.starting import held

LOOK = 0.05
"""s between two looks whether a terminal is to be closed."""


class Member:
    """One of them, in a session of its own; with a terminal of its own where that is to be closed."""

    def __init__(self, name: str, command: Sequence[str], environment: Mapping[str, str], log: Path, terminal: bool):
        self.name, self.command, self.environment, self.log = name, list(command), dict(environment), log
        self.terminal = terminal
        self.hung_up = False
        self.disturbed = False  # the process that runs, or ran last, was killed by us
        self.start()

    def start(self) -> None:
        self.started_at, self.disturbed, self.hung_up = time.monotonic(), False, False
        with self.log.open("ab") as file:
            out = file.fileno()
            if self.terminal:
                master, out = pty.openpty()
            with held():
                self.process = subprocess.Popen(
                    self.command,
                    stdin=out if self.terminal else subprocess.DEVNULL,
                    stdout=out,
                    stderr=subprocess.STDOUT,
                    env=self.environment,
                    start_new_session=True,
                    preexec_fn=partial(_prepare, os.getpid(), self.terminal),
                )
        if self.terminal:
            os.close(out)
            Thread(target=self._show, args=(master,), daemon=True).start()

    @property
    def status(self) -> int | None:
        return self.process.poll()

    def kill(self) -> None:
        self.disturbed = True
        self.process.kill()
        self.process.wait()

    def hang_up(self) -> None:
        """Its terminal is closed."""
        self.disturbed = self.hung_up = True

    def _show(self, master: int) -> None:
        """What comes on the terminal, until it is closed: here, as a file that is being read from is not."""
        with self.log.open("ab", buffering=0) as file, suppress(OSError):
            while not self.hung_up:
                if select.select([master], [], [], LOOK)[0]:
                    file.write(os.read(master, 4096))
        os.close(master)

    def said(self) -> str:
        return self.log.read_text(encoding="utf-8", errors="replace")


def node_command(package: str, executable: str, name: str = "", **parameters) -> list[str]:
    """Of a node, or of another program of ours where it has no parameters."""
    path = Path(get_package_prefix(package)) / "lib" / package / executable
    command = [sys.executable, str(path)]
    if name or parameters:
        command += ["--ros-args", *(["-r", f"__node:={name}"] if name else [])]
    for key, value in parameters.items():
        command += ["-p", f"{key}:={_written(value)}"]
    return command


def _written(value) -> str:
    if isinstance(value, list):
        return f"[{', '.join(value)}]"
    return str(value).lower() if isinstance(value, bool) else str(value)


def children_of(parent: int) -> list[int]:
    """Numbers of the processes that it has started, and of those that these have."""
    found: list[int] = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(") ")[2].split()
        except OSError:  # it has ended meanwhile
            continue
        if int(fields[1]) == parent and not has_ended(int(stat.parent.name)):
            found.append(int(stat.parent.name))
    return found + [grandchild for child in found for grandchild in children_of(child)]


def furthest_written(process: int) -> int:
    """Bytes up to which a process has written its longest file, which may have room reserved behind them."""
    furthest = 0
    for handle in Path(f"/proc/{process}/fd").glob("*"):
        with suppress(OSError):
            position, flags = Path(f"/proc/{process}/fdinfo/{handle.name}").read_text().split()[1:4:2]
            on_disk = handle.is_file() and not handle.readlink().is_relative_to("/dev")
            if on_disk and int(flags, 8) & os.O_ACCMODE:
                furthest = max(furthest, int(position))
    return furthest


def command_line(process: int) -> str:
    """Empty where there is no such process."""
    try:
        return Path(f"/proc/{process}/cmdline").read_bytes().replace(b"\0", b" ").decode()
    except OSError:
        return ""


def send(process: int, number: signal.Signals) -> None:
    try:
        os.kill(process, number)
    except ProcessLookupError:
        pass  # it has ended by itself


def _prepare(parent: int, terminal: bool) -> None:
    end_with(parent)
    if terminal:
        fcntl.ioctl(0, termios.TIOCSCTTY, 0)
