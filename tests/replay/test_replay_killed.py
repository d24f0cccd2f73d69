"""A subscriber that is killed while the replay waits for it."""

import os
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

from helpers_replay import Replay, environment, wait_until

from crash_replay import subscribers
from crash_replay.middleware import PROFILES, RANGE
from crash_replay.subscribers import PROCESS, is_gone, running

MORTAL = """
import rclpy
from crash_msgs.msg import Samples
rclpy.init()
node = rclpy.create_node("mortal")
node.create_subscription(Samples, "samples", lambda message: None, 10)
rclpy.spin(node)
"""


def test_one_that_is_killed_is_named_and_not_waited_for_until_its_lease_ends(bag, listener):
    mortal = subprocess.Popen([sys.executable, "-c", MORTAL], env=environment())
    try:
        with Replay(bag, rate=1000, loop=True, wait_for=2, progress=False) as replay:
            wait_until(lambda: listener.messages)
            there = partial(listener.node.get_subscriptions_info_by_topic, "samples")
            wait_until(lambda: "mortal" in [endpoint.node_name for endpoint in there()])
            time.sleep(0.5)  # the replay knows it by name a little later or earlier
            mortal.kill()
            wait_until(lambda: "which was killed" in replay.errors_so_far())
            status, _, errors = replay.interrupt()
    finally:
        mortal.kill()
        mortal.wait()
    said = [line for line in errors.splitlines() if "waiting for" in line]
    assert status == 0 and len([line for line in said if "/mortal" in line]) == 1, errors
    assert said[-1].endswith("what was sent is not taken: waiting for /mortal, which was killed")


def test_one_that_is_killed_counts_for_none_that_is_still_to_come(bag, listener):
    """Long before its lease, 20 s without our profiles, has ended."""
    variables = {k: v for k, v in environment().items() if k != PROFILES} | {RANGE: "LOCALHOST"}
    mortal = subprocess.Popen([sys.executable, "-c", MORTAL], env=variables)

    try:
        with Replay(bag, wait_for=3, progress=False):
            wait_until(lambda: listener.states and listener.states[-1].subscribers == 2)
            mortal.kill()
            mortal.wait()
            wait_until(lambda: listener.states[-1].subscribers == 1, timeout=15.0)
    finally:
        mortal.kill()
        mortal.wait()


def test_whether_a_process_is_gone_is_known_of_this_machine_only(monkeypatch):
    """Participants as Fast DDS numbers them: its maker, the machine, the process, and which one in it."""

    def participant(host: bytes, process: int) -> bytes:
        return bytes([1, 15]) + host + (process & 0xFFFF).to_bytes(2, "little") + bytes(6)

    def gone(host: bytes, process: int, own: int) -> bool:
        one = participant(host, process)
        return is_gone(one, [participant(here, own)], running({one[PROCESS]}))

    here, elsewhere, own = b"ab", b"cd", os.getpid()
    ended = subprocess.Popen([sys.executable, "-c", ""])  # not waited for: it has ended but is still listed
    wait_until(lambda: gone(here, ended.pid, own))
    assert not gone(elsewhere, ended.pid, own)
    assert not gone(here, own, own)
    assert not gone(here, ended.pid, own + 1), "another numbering"
    monkeypatch.setattr(subscribers, "PROCESSES", Path("/nowhere"))
    assert not gone(here, ended.pid, own), "no list of processes"
    ended.wait()
