"""The demonstration as a process, what it starts, and what is in the .rrd it writes."""

import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest
from ament_index_python.packages import get_package_prefix
from helpers_domain import own_domain
from helpers_paths import ROOT

BAG = ROOT / "bags/frontal_engine_cab.mcap"
PATIENCE = 240.0
"""s for a whole demonstration, on a machine with other work."""
TEST = "PYTEST_CURRENT_TEST"
"""pytest's environment variable, which whatever a test starts inherits."""


class Demo:
    """`demo` with its output in a file."""

    def __init__(self, out: Path, *arguments: str):
        self.out, self.text = out, out.with_suffix(".txt")
        executable = Path(get_package_prefix("crash_estimator")) / "lib/crash_estimator/demo"
        environment = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
        with self.text.open("w") as file:
            self.process = subprocess.Popen(
                [sys.executable, str(executable), "--out", str(out), *arguments],
                stdin=subprocess.DEVNULL,
                stdout=file,
                stderr=subprocess.STDOUT,
                env=environment | {"PYTHONIOENCODING": "utf-8", "ROS_DOMAIN_ID": str(own_domain())},
                start_new_session=True,
            )
        self.children: set[int] = set()

    @property
    def folder(self) -> Path:
        """Where the only recording shown is written."""
        (folder,) = self.out.iterdir()
        return folder

    def said(self) -> str:
        return self.text.read_text()

    def wait_until(self, done: Callable[[], object], what: str, patience: float = 60.0) -> None:
        deadline = time.monotonic() + patience
        while not done():
            assert self.process.poll() is None, f"ended with {self.process.returncode} before {what}:\n{self.said()}"
            assert time.monotonic() < deadline, f"waited {patience:g} s in vain until {what}:\n{self.said()}"
            self.children |= set(children_of(self.process.pid))
            time.sleep(0.02)

    def wait_for_samples(self) -> None:
        self.wait_until(lambda: " samples  " in self.said(), "the first sample is shown")

    def end(self, patience: float = PATIENCE) -> int:
        """Exit status, once it has ended by itself."""
        self.children |= set(children_of(self.process.pid))
        return self.process.wait(patience)

    def last_line(self) -> str:
        return self.said().rstrip().splitlines()[-1]

    def ended_complete(self, patience: float = PATIENCE) -> bool:
        """Whether it ends with all there is to have: where nothing can be drawn, all but the picture."""
        status, last = self.end(patience), self.last_line()
        if last.startswith("incomplete: no picture: ") and "apt install" in last and "; " not in last:
            return status == 1
        return status == 0 and "incomplete" not in self.said()

    def stop(self, part: str, seconds: float) -> None:
        """Let a child stand still."""
        pid = self.child(part)
        os.kill(pid, signal.SIGSTOP)
        time.sleep(seconds)
        os.kill(pid, signal.SIGCONT)

    def child(self, part: str) -> int:
        """Process id of the one child that has `part` in its command line."""
        found = [pid for pid in children_of(self.process.pid) if part in command_line(pid)]
        assert len(found) == 1, [command_line(pid) for pid in children_of(self.process.pid)]
        return found[0]

    def left_over(self, patience: float = 0.0) -> list[str]:
        """What it has started and still runs, after `patience` s at most."""
        deadline = time.monotonic() + patience
        while (left := [line for pid in self.children if (line := command_line(pid))]) and time.monotonic() < deadline:
            time.sleep(0.05)
        return left


@pytest.fixture
def demo(tmp_path):
    """demo(*arguments) starts one; it is ended with the test."""
    started = []

    def start(*arguments: str) -> Demo:
        started.append(Demo(tmp_path / f"out{len(started)}", *arguments))
        return started[-1]

    yield start
    for one in started:
        if one.process.poll() is None:
            one.process.send_signal(signal.SIGTERM)
            one.process.wait(20)


def children_of(parent: int) -> list[int]:
    """Process ids, from /proc."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(") ")[2].split()
        except OSError:  # it has ended meanwhile
            continue
        if int(fields[1]) == parent:
            found.append(int(stat.parent.name))
    return found


def left_over_in(domain: str) -> list[str]:
    """Command lines of the processes that this test has started on a ROS domain and that still run."""
    wanted = {f"{name}={value}".encode() for name, value in (("ROS_DOMAIN_ID", domain), (TEST, os.environ[TEST]))}
    found = []
    for environment in Path("/proc").glob("[0-9]*/environ"):
        try:
            variables = environment.read_bytes().split(b"\0")
        except OSError:  # it has ended meanwhile, or is somebody else's
            continue
        if wanted <= set(variables):
            found.append(command_line(int(environment.parent.name)))
    return found


def command_line(pid: int) -> str:
    """Empty where there is no such process, or only its exit status is left."""
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode()
    except OSError:
        return ""


def rows(rrd: Path) -> Counter:
    """Rows of each entity of the recording in a .rrd file."""
    from rerun.chunk import RrdReader

    counts: Counter = Counter()
    for chunk in RrdReader(str(rrd)).stream():
        counts[str(chunk.entity_path)] += chunk.to_record_batch().num_rows
    return counts


def view_origins(rrd: Path) -> set[str]:
    """Where the data of each view come from, in any of the layouts that followed each other."""
    from rerun.chunk import RrdReader

    reader = RrdReader(str(rrd))
    origins = set()
    chunks = (chunk for blueprint in reader.blueprints() for chunk in reader.stream(store=blueprint))
    for chunk in chunks:
        batch = chunk.to_record_batch()
        if "ViewBlueprint:space_origin" in batch.schema.names:
            cells = batch.column("ViewBlueprint:space_origin").to_pylist()
            origins |= {"/" + origin.lstrip("/") for cell in cells for origin in cell or ()}
    return origins
