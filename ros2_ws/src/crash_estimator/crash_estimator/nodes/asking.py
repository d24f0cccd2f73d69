"""Asks the replay for samples that this node has missed, a piece at a time."""

import time
from collections.abc import Callable

from crash_msgs.msg import Samples
from crash_msgs.srv import GetSamples
from rclpy.client import Client
from rclpy.node import Node
from rclpy.task import Future

from crash_replay.attending import REPLAY, Attending
from crash_replay.recording import RecordingError

from ..kept import Rows

PATIENCE = 10.0
"""s of wall clock for an answer; then it is asked for again, where the replay is there by its own word."""
STAYS = 300.0
"""s for which a replay that is there and does not answer, because it was stopped, is asked again and again."""
DISCOVERY = 1.0
"""s after the test has come in which the replay's service may still be found: topics are found before it."""


class Asking:
    def __init__(
        self,
        node: Node,
        replay: str,
        attending: Attending,
        done: Callable[[Rows | None], None],
        fitting: Callable[[Samples], Rows],
    ):
        """replay: the node's name, "" for that of the replay that takes part; done: called with the samples, or with
        None where there are none to be had, and `why_not` says why; fitting: what makes them of an answer, and raises
        RecordingError where they cannot be of the test."""
        self.node, self.attending, self.done, self.fitting = node, attending, done, fitting
        self.why_not = ""
        self.replay = replay
        self.clients: dict[str, Client] = {}  # by the name of the replay
        self.asked_of = self.client  # made in advance: its service takes a moment to be found
        self.wanted: GetSamples.Request | None = None
        self.call: Future | None = None  # None: nothing is wanted, or the service not found yet
        self.test_came = self.began = self.asked = 0.0  # monotonic s: when the test came, when it was asked first, last
        node.create_timer(0.05, self._look)

    @property
    def client(self) -> Client:
        """Of the replay that there is now."""
        others = self.attending.others
        there = [name for name in others.names(REPLAY) if others.there(name)]
        name = self.replay or (there[0] if there else REPLAY)
        if name not in self.clients:
            self.clients[name] = self.node.create_client(GetSamples, f"{name}/get_samples")
        return self.clients[name]

    @property
    def busy(self) -> bool:
        return self.wanted is not None

    def begin_test(self) -> None:
        """What was asked is no longer wanted."""
        self._forget()
        self.asked_of = self.client
        self.test_came = time.monotonic()

    def ask(self, start: int, stop: int) -> bool:
        """False: there is nobody to ask."""
        self.wanted, self.began = GetSamples.Request(start=start, stop=stop), time.monotonic()
        self._call_if_found()
        if not self.call and self._in_vain():
            self._forget()
        return self.busy

    def _in_vain(self) -> bool:
        """Whether there is nothing to wait for any more; `why_not` then says it."""
        now, there = time.monotonic(), self.attending.replay_is_there()
        if there is None:  # a replay that says nothing of itself, or none
            if self.call:
                late = now - self.asked > PATIENCE or not self.client.service_is_ready()
            else:
                late = now - self.test_came > DISCOVERY
            self.why_not = "nobody can give them again" if late else ""
        elif not there:
            self.why_not = "the replay had ended"
        else:
            self.why_not = f"the replay has not answered for {STAYS:g} s" if now - self.began > STAYS else ""
        return bool(self.why_not)

    def _call_if_found(self) -> None:
        if self.client.service_is_ready():
            self.asked, self.asked_of = time.monotonic(), self.client
            self.call = self.asked_of.call_async(self.wanted)
            self.call.add_done_callback(self._answered)

    def _forget(self) -> None:
        if self.call:
            self.asked_of.remove_pending_request(self.call)
        self.call = self.wanted = None

    def _answered(self, call: Future) -> None:
        if call is not self.call:
            return
        wanted, response, rows = self.wanted, call.result(), None
        self._forget()
        self.why_not = "" if response.success else response.message or "refused"
        if not self.why_not:
            try:
                rows = self._rows(response.samples, wanted.start)
            except RecordingError as error:
                self.why_not = str(error)
        if self.why_not:
            self.node.get_logger().warning(f"{self.client.srv_name}: {self.why_not}")
        self.done(rows)

    def _rows(self, samples: Samples, start: int) -> Rows:
        rows = self.fitting(samples)
        if not rows.number <= start < rows.end:
            raise RecordingError(f"sent samples from {rows.number} on where those from {start} on were asked for")
        return rows

    def _look(self) -> None:
        if not self.wanted:
            return
        if self._in_vain():
            if self.call:
                self.node.get_logger().warning(f"{self.client.srv_name}: {self.why_not}: going on without")
            self._forget()
            self.done(None)
        elif not self.call:
            self._call_if_found()
        elif time.monotonic() - self.asked > PATIENCE:  # the call or its answer was lost with who was stopped
            self.asked_of.remove_pending_request(self.call)
            self.call = None
            self._call_if_found()
