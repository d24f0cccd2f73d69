"""What an estimator says with a changed model on the samples before the change: it has it, and is asked for it.

It publishes only what comes after the change; an observer that compares the revisions wants each of them whole.
"""

import time
from collections.abc import Callable
from typing import NamedTuple

from crash_msgs.msg import EstimatorState
from crash_msgs.srv import GetEstimates
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.serialization import serialize_message
from rclpy.task import Future

from crash_replay.attendance import GONE

from .whole_estimates import LOOK, PATIENCE, STAYS, TOPICS, WholeEstimates, about_of, revision_of


class Wanted(NamedTuple):
    """Samples next, ..., stop - 1 of a pass, as a revision has estimated them."""

    revision: int
    run: int
    next: int
    stop: int


class RevisedEstimates:
    """Of one estimator: hands out what `WholeEstimates` gives it, and each new revision from the first sample on."""

    def __init__(self, node: Node, name: str, hand_out: Callable[[str, bytes], None]):
        """name: of the estimator; hand_out: is given topic and message."""
        self.hand_out, self.client = hand_out, node.create_client(GetEstimates, f"{name}/get_estimates")
        self.whole: WholeEstimates | None = None  # None: nothing is known of it yet
        self.revision = 0  # the newest that has been asked for
        self.wanted: Wanted | None = None
        self.held: list[tuple[str, bytes]] = []  # said meanwhile: drawn after what came before it
        self.call: Future | None = None
        self.asked = self.since = 0.0  # monotonic s: the last call, the first one that was not answered
        self.why_not = ""  # why a revision is not whole
        self.of_before: EstimatorState | None = None  # what it told last on another test
        node.create_timer(LOOK, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def follow(self, whole: WholeEstimates) -> None:
        self.whole = whole

    def begin_test(self) -> None:
        self._end()
        self.revision, self.why_not = 0, ""
        self.of_before = self.whole.states[-1] if self.whole and self.whole.states else None

    def take(self, topic: str, raw: bytes) -> None:
        """What the estimator publishes, in its order."""
        if not self.wanted and (revision := revision_of(raw, TOPICS[topic])) > self.revision:
            about = about_of(raw, TOPICS[topic])
            self._want(revision, about.run, about.number)
        if self.wanted:
            self.held.append((topic, raw))
        else:
            self.hand_out(topic, raw)

    @property
    def settled(self) -> bool:
        """Whether every revision that is known of has been handed out, as far as it can be had."""
        return self.wanted is None and self._news() is None

    def _look(self) -> None:
        now = time.monotonic()
        if self.wanted is None and (state := self._news()):
            self._want(state.revision, state.run, state.number)
        if self.wanted and self.call and now - self.asked > PATIENCE:
            self._forget()
        if self.wanted and not self.call:
            self._ask(now)

    def _news(self) -> EstimatorState | None:
        """What the estimator has told of a revision that has not been asked for, on this test."""
        state = self.whole.states[-1] if self.whole and self.whole.states else None
        return state if state and state is not self.of_before and state.revision > self.revision else None

    def _want(self, revision: int, run: int, stop: int) -> None:
        """What a new revision says of the samples before `stop`; a pass that began with it has none."""
        self.revision = revision
        replay = self.whole.attending.replay_state
        first = replay.first if replay and replay.run == run else 0
        if first < stop:
            self.wanted, self.since = Wanted(revision, run, first, stop), time.monotonic()

    def _ask(self, now: float) -> None:
        others = self.whole.attending.others
        if others.word(self.whole.name) and (how := others.state(self.whole.name)) in GONE:
            self._give_up(others.how(self.whole.name, how))
        elif now - self.since > STAYS:
            self._give_up(f"it has not answered for {STAYS:g} s")
        elif self.client.service_is_ready():
            wanted = self.wanted
            request = GetEstimates.Request(
                revision=wanted.revision, run=wanted.run, start=wanted.next, stop=wanted.stop
            )
            self.asked, self.call = now, self.client.call_async(request)
            self.call.add_done_callback(self._answered)

    def _answered(self, call: Future) -> None:
        if call is not self.call:
            return
        self.call, response, wanted = None, call.result(), self.wanted
        if not response.success:
            return self._give_up(response.message)
        for topic in TOPICS:
            self.hand_out(topic, serialize_message(getattr(response, topic.rpartition("/")[2])))
        self.since, reached = time.monotonic(), wanted.next + len(response.forces.time_ns)
        self.wanted = wanted._replace(next=reached)
        if reached >= wanted.stop:
            self._end()
        else:
            self._ask(self.since)

    def _give_up(self, why: str) -> None:
        self.why_not = f"revision {self.wanted.revision}: {self.wanted.next} of {self.wanted.stop} samples ({why})"
        self._end()

    def _end(self) -> None:
        self.wanted = None
        self._forget()
        held, self.held = self.held, []
        for topic, raw in held:
            self.hand_out(topic, raw)

    def _forget(self) -> None:
        if self.call:
            self.client.remove_pending_request(self.call)
            self.call = None
