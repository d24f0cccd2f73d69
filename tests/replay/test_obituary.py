"""Who is killed is forgotten by the middleware when somebody says so, long before its lease ends."""

import subprocess
import sys
import time

import pytest
from helpers_replay import Listener, environment, wait_until

from crash_replay.obituary import announce_end, discovery_port, disposal
from crash_replay.subscribers import process_of

MORTAL = """
import rclpy
from crash_msgs.msg import Samples
from crash_replay.middleware import prepare_middleware
prepare_middleware()
rclpy.init()
node = rclpy.create_node("mortal")
node.create_subscription(Samples, "samples", lambda message: None, 10)
rclpy.spin(node)
"""


def test_the_message_is_a_disposal_as_the_protocol_has_it():
    participant = bytes(range(12))
    message = disposal(participant)
    assert message[:20] == b"RTPS\x02\x03\x01\x0f" + participant
    assert message[20] == 0x15 and int.from_bytes(message[22:24], "little") == len(message) - 24
    assert participant + b"\x00\x00\x01\xc1" in message and message.endswith(
        b"\x71\x00\x04\x00\x00\x00\x00\x03\x01\x00\x00\x00"
    )
    assert [discovery_port(0, 0), discovery_port(1, 2)] == [7410, 7664]


@pytest.mark.parametrize("said", [True, False])
def test_one_that_was_killed_is_forgotten_when_it_is_said(said):
    with Listener() as listener:
        mortal = subprocess.Popen([sys.executable, "-c", MORTAL], env=environment())
        there = lambda: listener.node.get_subscriptions_info_by_topic("samples")  # noqa: E731
        try:
            mine = {process_of(info) for info in there()}
            wait_until(lambda: {process_of(info) for info in there()} - mine)
            (participant,) = {process_of(info) for info in there()} - mine
            mortal.kill()
            mortal.wait()
            gone = lambda: participant not in {process_of(info) for info in there()}  # noqa: E731
            if said:
                announce_end(participant, listener.context.get_domain_id())
                wait_until(gone)
            else:
                time.sleep(7.0)
                assert not gone(), "a lease that ends soon drops those who are stopped as well"
        finally:
            mortal.kill()
            mortal.wait()
