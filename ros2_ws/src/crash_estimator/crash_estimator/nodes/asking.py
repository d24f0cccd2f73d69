"""Asks the replay for samples that this node has missed, a piece at a time."""

import time
from collections.abc import Callable

from crash_msgs.srv import GetSamples
from rclpy.node import Node
from rclpy.task import Future

from ..kept import Rows
from .samples import rows_of

PATIENCE = 10.0
"""s of wall clock for an answer; a replay that has ended is gone before."""
DISCOVERY = 1.0
"""s after the test has come in which the replay's service may still be found: topics are found before it."""


class Asking:
    def __init__(self, node: Node, service: str, done: Callable[[Rows | None], None]):
        """done: called with the samples, or with None where there are none to be had."""
        self.node, self.done = node, done
        self.client = node.create_client(GetSamples, service)
        self.wanted: GetSamples.Request | None = None
        self.call: Future | None = None  # None: nothing is wanted, or the service not found yet
        self.test_came = self.asked = 0.0  # monotonic s
        node.create_timer(0.05, self._look)

    @property
    def busy(self) -> bool:
        return self.wanted is not None

    def begin_test(self) -> None:
        """What was asked is no longer wanted."""
        self._forget()
        self.test_came = time.monotonic()

    def ask(self, start: int, stop: int) -> bool:
        """False: there is nobody to ask."""
        self.wanted = GetSamples.Request(start=start, stop=stop)
        self._call_if_found()
        if not self.call and self._in_vain():
            self.wanted = None
        return self.busy

    def _in_vain(self) -> bool:
        return time.monotonic() - self.test_came > DISCOVERY

    def _call_if_found(self) -> None:
        if self.client.service_is_ready():
            self.asked = time.monotonic()
            self.call = self.client.call_async(self.wanted)
            self.call.add_done_callback(self._answered)

    def _forget(self) -> None:
        if self.call:
            self.client.remove_pending_request(self.call)
        self.call = self.wanted = None

    def _answered(self, call: Future) -> None:
        if call is not self.call:
            return
        self._forget()
        response = call.result()
        if not response.success:
            self.node.get_logger().warning(f"{self.client.srv_name}: {response.message}")
        self.done(rows_of(response.samples) if response.success else None)

    def _look(self) -> None:
        if not self.wanted:
            return
        if not self.call:
            self._call_if_found()
        late = time.monotonic() - self.asked > PATIENCE or not self.client.service_is_ready()
        if late if self.call else self._in_vain():
            if self.call:
                self.node.get_logger().warning(f"{self.client.srv_name} has not answered: going on without")
            self._forget()
            self.done(None)
