"""Who waits leaves the processor to those who work: the replay beside a compilation that it waits for, above all."""

import os
import subprocess
import time
from pathlib import Path

import pytest
from helpers_nodes import MODULES, end, environment, family, node
from helpers_waiting import PATIENCE

SHARE = 0.1
"""Of a core; 0.03 at most where nothing else runs, and a replay that looked at every process all the time took 0.4."""
SECONDS = 3.0
"""Over which the share is taken."""
TICK = 1.0 / os.sysconf("SC_CLK_TCK")


def processor_time(process: int) -> float:
    """s that a process and its children have had of any core."""
    took = 0.0
    for one in family(process):
        try:
            fields = Path(f"/proc/{one}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue  # it has ended
        took += TICK * (int(fields[11]) + int(fields[12]))
    return took


def test_nodes_that_wait_take_next_to_nothing(tmp_path):
    given = environment()
    nodes = {
        name: subprocess.Popen(node(name, tmp_path), env=given, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        for name in MODULES
    }
    shares = dict.fromkeys(nodes, [])
    limit = time.monotonic() + 2 * PATIENCE  # what is not compiled yet is so at the start, on a busy machine
    try:
        while time.monotonic() < limit and any(min(of, default=1.0) > SHARE for of in shares.values()):
            before, began = {name: processor_time(process.pid) for name, process in nodes.items()}, time.monotonic()
            time.sleep(SECONDS)
            for name, process in nodes.items():
                assert process.poll() is None, f"{name} has ended"
                took = processor_time(process.pid) - before[name]
                shares[name] = [*shares[name], took / (time.monotonic() - began)]
    finally:
        end(list(nodes.values()))
    least = {name: min(of) for name, of in shares.items()}
    assert least == pytest.approx(dict.fromkeys(nodes, 0.0), abs=SHARE)
