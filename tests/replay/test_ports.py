"""What ports listen where: on the loopback interface only, however a node is started; elsewhere only if told to.

The nodes that wait here are looked at for what they take of the processor, too.
"""

import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from helpers_nodes import BAG, MODULES, end, environment, executable, family, node, parameters
from helpers_ports import bound, elsewhere
from helpers_waiting import PATIENCE

PORTS_OF_A_NODE = 4  # UDP: discovery, data, another one of Fast DDS, and the one that it sends from


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


def watched(command: list[str], given: dict[str, str], enough: Callable, seconds: float = 1.0) -> set:
    """All that a command has bound till `enough` has come, and for some seconds more."""
    process = subprocess.Popen(command, env=given, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    seen, limit, last = set(), time.monotonic() + PATIENCE, None
    try:
        while last is None or time.monotonic() < last:
            assert process.poll() is None, process.stderr.read()
            assert time.monotonic() < limit, f"{command} has bound only {seen}"
            seen |= bound(process.pid)
            if last is None and enough(seen):
                last = time.monotonic() + seconds
            time.sleep(0.05)
    finally:
        end([process])
    return seen


def a_node(sockets: set) -> bool:
    return sum(protocol == "udp" for protocol, _, _ in sockets) >= PORTS_OF_A_NODE


def a_viewer(sockets: set) -> bool:
    return a_node(sockets) and any(protocol.startswith("tcp") for protocol, _, _ in sockets)


@pytest.fixture(scope="module")
def waiting(tmp_path_factory) -> dict[str, tuple[set, float]]:
    """All nodes there are, waiting beside each other -> what each has bound and the least share of a core it took."""
    given, folder = environment(), tmp_path_factory.mktemp("waiting")
    nodes = {
        name: subprocess.Popen(node(name, folder), env=given, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        for name in MODULES
    }
    seen, shares = {name: set() for name in nodes}, dict.fromkeys(nodes, 1.0)
    limit = time.monotonic() + 2 * PATIENCE  # what is not compiled yet is so at the start, on a busy machine
    started = lambda: all(map(a_node, seen.values())) and a_viewer(seen["viewer"])  # noqa: E731
    try:
        while time.monotonic() < limit and not (started() and max(shares.values()) <= SHARE):
            before, began = {name: processor_time(process.pid) for name, process in nodes.items()}, time.monotonic()
            while time.monotonic() < began + SECONDS:
                for name, process in nodes.items():
                    assert process.poll() is None, f"{name} has ended"
                    seen[name] |= bound(process.pid)
                time.sleep(0.2)
            for name, process in nodes.items():
                took = processor_time(process.pid) - before[name]
                shares[name] = min(shares[name], took / (time.monotonic() - began))
    finally:
        end(list(nodes.values()))
    return {name: (seen[name], shares[name]) for name in nodes}


@pytest.mark.parametrize("name", MODULES)
def test_a_node_listens_on_this_machine_only(name, waiting):
    seen, _ = waiting[name]
    assert a_viewer(seen) if name == "viewer" else a_node(seen)
    assert not elsewhere(seen), seen


def test_nodes_that_wait_take_next_to_nothing(waiting):
    """Who waits leaves the processor to those who work: above all the replay beside a compilation it waits for."""
    least = {name: share for name, (_, share) in waiting.items()}
    assert least == pytest.approx(dict.fromkeys(waiting, 0.0), abs=SHARE)


def test_so_it_does_as_a_module_and_where_ros_alone_is_told_to_stay_on_this_machine(tmp_path):
    command = [sys.executable, "-m", MODULES["estimator"], *parameters("estimator", tmp_path)]
    for given in ({"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}, {"ROS_LOCALHOST_ONLY": "1"}):
        seen = watched(command, environment(**given), a_node)
        assert not elsewhere(seen), seen


def test_the_demonstration_and_all_that_it_starts_listen_on_this_machine_only(tmp_path):
    options = ["--recording", str(BAG), "--model", "frontal_single", "--out", str(tmp_path), "--rate", "0.01"]
    processes = 6  # of which each that knows ROS has a node: demo, replay, estimator, diagnosis, viewer
    enough = lambda seen: a_viewer(seen) and len(seen) > (processes - 1) * PORTS_OF_A_NODE  # noqa: E731
    seen = watched(executable("crash_estimator", "demo") + options, environment(), enough, seconds=3.0)
    assert not elsewhere(seen), seen


@pytest.mark.parametrize("opened", [{"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, {"ROS_STATIC_PEERS": "192.0.2.1"}])
def test_it_listens_elsewhere_where_it_is_told_to(opened, tmp_path):
    seen = watched(node("replay", tmp_path), environment(**opened), lambda sockets: bool(elsewhere(sockets)))
    assert {address for _, address, _ in elsewhere(seen)} >= {"0.0.0.0"}, seen


def test_what_is_bound_is_found():
    with socket.socket() as listening, socket.socket(socket.AF_INET6, socket.SOCK_DGRAM) as datagrams:
        listening.bind(("0.0.0.0", 0))
        listening.listen()
        datagrams.bind(("::1", 0))
        own = bound(os.getpid())
        assert ("tcp", "0.0.0.0", listening.getsockname()[1]) in elsewhere(own)
        assert ("udp6", "::1", datagrams.getsockname()[1]) in own - elsewhere(own)
