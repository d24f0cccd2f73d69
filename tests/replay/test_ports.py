"""What ports listen where: on the loopback interface only, however a node is started; elsewhere only if told to."""

import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable

import pytest
from helpers_nodes import BAG, MODULES, end, environment, executable, node, parameters
from helpers_ports import bound, elsewhere
from helpers_waiting import PATIENCE

PORTS_OF_A_NODE = 4  # UDP: discovery, data, another one of Fast DDS, and the one that it sends from


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


@pytest.mark.parametrize("name", MODULES)
def test_a_node_listens_on_this_machine_only(name, tmp_path):
    seen = watched(node(name, tmp_path), environment(), a_viewer if name == "viewer" else a_node)
    assert not elsewhere(seen), seen


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
