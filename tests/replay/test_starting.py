"""Ctrl-C while a program is still being started, at many moments: it ends, and no traceback is shown."""

import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from pathlib import Path

import pytest
from helpers_domain import own_domain
from helpers_paths import ROOT
from helpers_setup import wheels_only

from crash_estimator.chaos.members import node_command
from crash_replay.starting import ENDING, held

BAG = str(ROOT / "bags/impactor_single.mcap")
OF_A_BAG = [BAG, "--model", "impactor_single"]
FULL, FEW = 10, 2
"""Moments: of those that take longest to start, and of others that start in the same way."""
STARTED = 2.5
"""s, on an idle machine, in which all of them have been started."""
TOGETHER = 4
PROGRAMS = {
    "replay": (node_command("crash_replay", "replay", bag=BAG, keep_alive=True), FULL),
    "estimator": (node_command("crash_estimator", "estimator", model="impactor_single"), FULL),
    "diagnosis": (node_command("crash_estimator", "diagnosis", model="impactor_single"), FULL),
    "viewer": (node_command("crash_estimator", "viewer", rrd="", port=0, open=False), FEW),
    "record": (node_command("crash_replay", "record", to="r.mcap"), FEW),
    "demo": ([*node_command("crash_estimator", "demo"), "--no-viewer"], FEW),
    "diagnose": ([*node_command("crash_estimator", "diagnose"), *OF_A_BAG], FEW),
    "estimate": ([*node_command("crash_estimator", "estimate"), *OF_A_BAG], FEW),
    "report": ([*node_command("crash_estimator", "report"), *OF_A_BAG, "--to", "report"], FEW),
    "synthesize": ([*node_command("crash_replay", "synthesize"), "impactor_single", "--to", "s.mcap"], FEW),
    "estimator, -m": ([sys.executable, "-m", "crash_estimator.nodes.estimator_node"], FEW),
    "warm_up": ([sys.executable, "-m", "crash_estimator.warm_up"], FEW),
}
ENDED = {0, 1, *(128 + number for number in ENDING)}


def interrupted(
    command: list[str], moment: float, number: int, folder: Path, environment: dict, waiting=held
) -> tuple[int, str]:
    """Exit status and what was said, by it and by what it has started."""
    folder.mkdir(parents=True)
    log = folder / "said.log"
    with log.open("wb") as out, waiting():
        process = subprocess.Popen(
            command, cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=out, stderr=subprocess.STDOUT,
            start_new_session=True,
        )  # fmt: skip
    time.sleep(moment)
    try:
        os.killpg(process.pid, number)  # all of them, as from a terminal
    except ProcessLookupError:
        pass
    try:
        status = process.wait(60.0)
    finally:
        process.kill()
    return status, log.read_text(errors="replace") + "".join(f.read_text() for f in folder.rglob("log/*.log"))


def test_whenever_it_comes_ctrl_c_shows_no_traceback(tmp_path):
    environment = os.environ | {"ROS_DOMAIN_ID": str(own_domain()), "PYTHONUNBUFFERED": "1"}
    tries = [
        (name, command, STARTED * (k + 0.5 * (n % 2)) / moments, ENDING[k % len(ENDING)] if k % 2 else signal.SIGINT)
        for n, (name, (command, moments)) in enumerate(PROGRAMS.items())
        for k in range(moments)
    ]

    def run(at: int) -> str:
        name, command, moment, number = tries[at]
        status, said = interrupted(command, moment, number, tmp_path / str(at), environment)
        well = status in ENDED and "Traceback" not in said and "Fatal Python error" not in said
        return "" if well else f"{name}, {number.name} after {moment:.2f} s: status {status}, {said}"

    with ThreadPoolExecutor(TOGETHER) as pool:
        wrong = [line for line in pool.map(run, range(len(tries))) if line]
    assert not wrong, "\n".join(wrong)


@wheels_only
def test_tools_run_shows_none_either(tmp_path):
    """Though what it starts is not ready for a signal from the first: see what it does with those that come."""
    command = [str(ROOT / "tools/run"), "crash_replay", "synthesize", "impactor_single", "--to", "s.mcap"]
    begun = time.monotonic()
    subprocess.run(command, cwd=tmp_path, capture_output=True, check=True)
    takes = time.monotonic() - begun  # a fast machine is done within 0.3 s: the signal must come before
    for k in range(12):
        moment = 0.5 * takes * k / 11
        status, said = interrupted(command, moment, signal.SIGINT, tmp_path / str(k), dict(os.environ), nullcontext)
        assert status in (130, -signal.SIGINT) and said in ("", "interrupted while it was being started\n"), (k, said)


def test_before_it_is_started_it_says_so(tmp_path):
    command, _ = PROGRAMS["estimator"]
    assert interrupted(command, 0.0, signal.SIGINT, tmp_path / "a", dict(os.environ)) == (
        130, "interrupted while it was being started\n",
    )  # fmt: skip
    ignored = ["sh", "-c", 'trap "" HUP; exec "$@"', "sh", *PROGRAMS["synthesize"][0]]
    status, said = interrupted(ignored, 0.0, signal.SIGHUP, tmp_path / "b", dict(os.environ))
    assert status == 0, said


def test_who_imports_the_packages_keeps_his_signals():
    code = "import signal, crash_estimator, crash_replay; print(signal.getsignal(signal.SIGINT).__name__)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "default_int_handler\n"


@pytest.mark.parametrize("number", ENDING)
def test_what_is_held_comes_afterwards(number):
    came, before = [], signal.signal(number, lambda number, _: came.append(number))
    try:
        with held(number):
            signal.pthread_kill(threading.get_ident(), number)
            assert came == []
        assert came == [number]
    finally:
        signal.signal(number, before)


def test_one_that_comes_as_it_ends_changes_nothing():
    """Between the end of the command and that of Python: the exit status stands."""
    lines = (
        "import os, signal, sys", "from crash_replay.fault import guarded", "from crash_replay.starting import begin",
        "begin()", "status = guarded(lambda: print('done'))", "os.kill(os.getpid(), signal.SIGINT)", "sys.exit(status)",
    )  # fmt: skip
    ended = subprocess.run([sys.executable, "-c", "\n".join(lines)], capture_output=True, text=True)
    assert (ended.returncode, ended.stdout, ended.stderr) == (0, "done\n", "")
