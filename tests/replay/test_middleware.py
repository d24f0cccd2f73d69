"""What the environment makes of the middleware's settings, and that others who set nothing still hear us."""

import os
import subprocess
import sys
import xml.etree.ElementTree as ElementTree

import pytest
from helpers_replay import Replay, environment, some_recording
from helpers_waiting import PATIENCE

from crash_replay.bag import write_bag
from crash_replay.middleware import NETWORK, OPENING, PROFILES, RANGE, THIS_MACHINE, prepare_middleware

ALL = (PROFILES, RANGE, "ROS_LOCALHOST_ONLY", *OPENING)
CLOSED = {PROFILES: str(THIS_MACHINE), RANGE: "SYSTEM_DEFAULT"}


@pytest.mark.parametrize(
    "given, made",
    [
        ({}, CLOSED),
        ({RANGE: "LOCALHOST"}, CLOSED),
        ({"ROS_LOCALHOST_ONLY": "1"}, CLOSED),
        ({RANGE: "OFF"}, {PROFILES: str(THIS_MACHINE), RANGE: "OFF"}),
        ({RANGE: "SUBNET"}, {PROFILES: str(NETWORK), RANGE: "SUBNET"}),
        ({RANGE: "SYSTEM_DEFAULT"}, {PROFILES: str(NETWORK), RANGE: "SYSTEM_DEFAULT"}),
        ({"ROS_STATIC_PEERS": "there"}, {PROFILES: str(NETWORK), "ROS_STATIC_PEERS": "there"}),
        ({PROFILES: "/their.xml"}, {PROFILES: "/their.xml", RANGE: "LOCALHOST"}),
        ({PROFILES: "/their.xml", RANGE: "SUBNET"}, {PROFILES: "/their.xml", RANGE: "SUBNET"}),
        (CLOSED, CLOSED),
        (CLOSED | {RANGE: "SUBNET"}, {PROFILES: str(NETWORK), RANGE: "SUBNET"}),
    ],
    ids=lambda value: " ".join(f"{k.split('_')[-1]}={v.rpartition('/')[2]}" for k, v in value.items()) or "nothing",
)
def test_it_is_closed_unless_the_environment_opens_it(given, made, monkeypatch):
    for name in ALL:
        monkeypatch.setenv(name, "")  # so that all is as it was after the test
        monkeypatch.delenv(name)
    for name, value in given.items():
        monkeypatch.setenv(name, value)
    prepare_middleware()
    assert {name: os.environ[name] for name in ALL if name in os.environ} == made


def test_both_profiles_tell_as_soon_what_is_lost_and_who_has_gone():
    def settings(file) -> list[str]:
        times = ("leaseDuration", "leaseAnnouncement", "heartbeatPeriod", "heartbeatResponseDelay")
        elements = [e for e in ElementTree.parse(file).iter() if e.tag.rpartition("}")[2] in times]
        return [ElementTree.tostring(element, encoding="unicode").strip() for element in elements]

    assert len(settings(NETWORK)) == 4 and settings(NETWORK) == settings(THIS_MACHINE)


PLAIN = """
import rclpy
from crash_msgs.msg import Samples
from rclpy.task import Future
rclpy.init()
node, done = rclpy.create_node("plain"), Future()
node.create_subscription(Samples, "samples", lambda m: m.number + len(m.time_ns) == 40 and done.set_result(None), 100)
rclpy.spin_until_future_complete(node, done, timeout_sec=60.0)
print("heard" if done.done() else "heard nothing")
"""


@pytest.mark.parametrize("range_of_it", ["LOCALHOST", "SUBNET", ""])
def test_a_node_without_our_settings_hears_the_replay(range_of_it, tmp_path):
    """`ros2 topic echo`, rosbag2, PlotJuggler: on the same machine, whatever they are told."""
    bag = write_bag(some_recording(), tmp_path / "some.mcap")
    kept = {k: v for k, v in environment().items() if k not in ALL} | {RANGE: range_of_it}
    plain = subprocess.Popen([sys.executable, "-c", PLAIN], env=kept, stdout=subprocess.PIPE, text=True)
    try:
        with Replay(bag, wait_for=1, wait_timeout=PATIENCE, progress=False) as replay:
            assert replay.end()[0] == 0
        assert plain.communicate(timeout=PATIENCE)[0] == "heard\n"
    finally:
        plain.kill()
        plain.communicate()
