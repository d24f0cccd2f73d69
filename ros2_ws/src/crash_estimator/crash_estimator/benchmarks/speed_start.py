"""What every command takes of the processor before it can do anything: for `--help`, and until it begins its work."""

import os
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from importlib.metadata import distribution
from pathlib import Path
from statistics import median

from .speed_row import Row

HELP, BEGINS = 0.5, 1.0
"""s of processor: what is promised."""
REPEATS = 5

NOTHING = "nothing.mcap"
OF_A_MODEL = (NOTHING, "--model", "side_dummy")
BEGINNINGS: Mapping[str, Sequence[str]] = {
    "import": (NOTHING, "--to", "out.mcap"),
    "synthesize": ("impactor_single", "--rate", "1000", "--force", "--to", "out.mcap"),
    "record": (),
    "replay": ("--ros-args", "-p", f"bag:={NOTHING}"),
    "demo": ("--recording", NOTHING),
    "diagnose": OF_A_MODEL,
    "estimate": OF_A_MODEL,
    "report": (*OF_A_MODEL, "--to", "out"),
    "simulate": OF_A_MODEL,
    "estimator": ("--ros-args", "-p", "model:=nothing.yaml"),
    "diagnosis": ("--ros-args", "-p", "model:=nothing.yaml"),
    "composed": ("one", "--ros-args", "-p", "one:model:=nothing.yaml"),
    "viewer": ("--ros-args", "-p", "port:=-1"),
}
"""Arguments with which each ends as soon as all is imported and its node is made: what it would begin with is missing.
`synthesize` needs nothing: it writes its smallest recording. `estimate` and `simulate` import numba after that, where a
method is compiled: another 0.3 s."""


def commands() -> dict[str, str]:
    """Every command of the packages, by name: the module that it is."""
    points = [point for package in ("crash_replay", "crash_estimator") for point in distribution(package).entry_points]
    return {point.name: point.module for point in points}


def starts(folder: Path, repeats: int = REPEATS) -> Iterator[Row]:
    """folder: for what is written."""
    for name, module in commands().items():
        for what, arguments, reach in (("--help", ["--help"], HELP), ("until its work", BEGINNINGS[name], BEGINS)):
            spent = median(processor_time(module, arguments, folder) for _ in range(repeats))
            yield Row(f"processor time, `{name}`, {what}", f"{spent:.2f} s", f"{reach:g} s", spent / reach, 1.0, False)


def processor_time(module: str, arguments: Sequence[str], folder: Path) -> float:
    """s, of the process and of those that it has started and waited for."""
    process = subprocess.Popen(
        [sys.executable, "-m", module, *arguments], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    return used.ru_utime + used.ru_stime
