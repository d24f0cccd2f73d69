"""Signals at unlucky moments: a node and the demonstration end as if they had come a moment later."""

import os
import signal
import time
from threading import Timer

import pytest
from helpers_domain import own_domain
from rclpy.node import Node

from crash_estimator.demo.interrupts import SIGNALS, held_back, interrupted_by_signals
from crash_replay.ros_runtime import run


@pytest.fixture(autouse=True)
def handlers(monkeypatch):
    """As they were, after the test."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(own_domain()))
    before = {number: signal.getsignal(number) for number in SIGNALS}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_an_idle_node_at_once(number):
    sent, closed = [], []

    def send() -> None:
        sent.append(time.monotonic())
        os.kill(os.getpid(), number)

    Timer(0.5, send).start()
    assert run(lambda: Node("idle"), close=closed.append) == 0
    assert len(closed) == 1
    assert 0.0 <= time.monotonic() - sent[0] < 3.0  # it has nothing to do and no event comes: else it never ends


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_in_a_callback_and_while_the_node_is_made_takes_nothing_away(number):
    """What comes after it in the callback is still done, and the context is still there."""
    done = []

    def make() -> Node:
        os.kill(os.getpid(), number)
        node = Node("busy")
        node.create_timer(0.01, lambda: callback(node))
        done.append("made")
        return node

    def callback(node: Node) -> None:
        os.kill(os.getpid(), number)
        done.append(node.context.ok())

    assert run(make) == 0
    assert done[0] == "made" and all(done[1:]) and len(done) > 1


@pytest.mark.parametrize("number", SIGNALS)
def test_what_the_demonstration_is_at_is_finished_before_an_interrupt(number):
    done = []
    with interrupted_by_signals():
        with pytest.raises(KeyboardInterrupt):
            with held_back():
                os.kill(os.getpid(), number)
                done.append(1)
            done.append(2)
        assert done == [1]
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), number)
            done.append(3)
    assert done == [1]
