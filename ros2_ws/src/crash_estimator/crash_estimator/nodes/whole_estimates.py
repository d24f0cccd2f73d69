"""All that an estimator says of a test, in its order: what this node has missed is asked for at ~/get_estimates.

A process that was stopped for longer than the middleware waits for it has lost what was said meanwhile.
"""

import struct
import time
from collections.abc import Callable
from functools import partial

from crash_msgs.msg import EstimatorState, Forces, ParametersBlock, ResidualsBlock
from crash_msgs.srv import GetEstimates
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.task import Future

from crash_replay.attendance import GONE
from crash_replay.attending import Attending
from crash_replay.cdr import PLAIN, aligned
from crash_replay.qos import LATCHED, STREAM

from ..following.in_order import About, InOrder

TOPICS = {"block/parameters": ParametersBlock, "block/residuals": ResidualsBlock, "forces": Forces}
"""What is said of every sample."""

LOOK = 0.1
"""s between two looks at what is missing."""
QUIET = 1.0
"""s without a message after which what has been said and has not come is not on its way any more."""
PATIENCE = 10.0
"""s for an answer; then it is asked for again, for the call or its answer was lost with who was stopped."""
STAYS = 300.0
"""s for which an estimator that is there and does not answer, because it was stopped, is asked again and again."""
DISCOVERY = 3.0
"""s in which more may come of a node that takes no part in the attendance, or its service be found."""


class WholeEstimates:
    """Of one estimator."""

    def __init__(self, node: Node, name: str, attending: Attending, hand_out: Callable[[str, bytes], None]):
        """hand_out: is given topic and message."""
        self.node, self.attending = node, attending
        self.streams = {topic: InOrder(partial(hand_out, topic)) for topic in TOPICS}
        self.inputs = [
            node.create_subscription(kind, f"{name}/{topic}", partial(self._on_said, topic), STREAM, raw=True)
            for topic, kind in TOPICS.items()
        ]
        self.name = self.inputs[0].topic_name.removesuffix("/block/parameters")
        self.states: list[EstimatorState] = []  # from which sample on the estimates come from which model
        node.create_subscription(EstimatorState, f"{name}/state", self._on_state, LATCHED)
        self.client = node.create_client(GetEstimates, f"{name}/get_estimates")
        self.call: Future | None = None
        self.most = 1 << 20  # samples in a request: fewer where only some of them can be had
        self.why_not = ""  # why something could not be had
        self.came = self.looked = time.monotonic()  # a message, this node's last look
        self.since = self.asked = 0.0  # when the present gap was asked for first, last; 0: not yet
        node.create_timer(LOOK, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def begin_test(self) -> None:
        for stream in self.streams.values():
            stream.begin_test()
        self._forget()
        self.why_not = ""

    @property
    def found(self) -> bool:
        """Whether the estimator can be heard."""
        return all(subscription.get_publisher_count() for subscription in self.inputs)

    @property
    def revision(self) -> int:
        """Of its model: how often an effect was added or taken out, as it has said last."""
        return self.states[-1].revision if self.states else 0

    def has(self, run: int) -> int:
        """Samples of a pass of which everything has come."""
        return min(stream.has(run) for stream in self.streams.values())

    def reached(self, run: int, number: int) -> bool:
        return all(stream.reached(run, number) for stream in self.streams.values())

    def lacks(self, run: int, first: int, sent: int) -> str:
        """What has not come of samples first, ..., sent - 1 of a pass, and why; "" where all has."""
        has, of = self.has(run), sent - first
        if has >= of:
            return ""
        others = self.attending.others
        word = others.word(self.name)
        how = others.how(self.name, others.state(self.name, run, sent)) if word else "it has said nothing"
        return f"{has} of {of} samples ({(word.reason if word else '') or self.why_not or how})"

    def waits_for_nothing(self) -> bool:
        """Whether nothing more is to be expected of the estimator: it has gone, or fallen silent, and nothing comes."""
        others, quiet = self.attending.others, time.monotonic() - self.came
        if others.word(self.name) is None:
            return quiet > DISCOVERY
        return quiet > QUIET and (others.state(self.name) in GONE or others.silence(self.name) > STAYS)

    def _on_said(self, topic: str, raw: bytes) -> None:
        self.came = time.monotonic()
        try:
            about = about_of(raw, TOPICS[topic])
        except (struct.error, RuntimeError):
            return self.node.get_logger().error(
                f"{self.name}/{topic}: no such message: left out", throttle_duration_sec=5.0
            )
        state = self.attending.replay_state
        first = state.first if state and state.run == about.run else about.number
        self.streams[topic].receive(about, raw, first)
        if self.streams[topic].gap():
            self._look()

    def _on_state(self, message: EstimatorState) -> None:
        at = message.run, message.number
        self.states = [state for state in self.states if (state.run, state.number) < at] + [message]

    def _revision(self, run: int, number: int) -> int:
        """Of the model that has said what there is of a sample."""
        said = [state.revision for state in self.states if (state.run, state.number) <= (run, number)]
        return said[-1] if said else max(0, self.revision - 1)

    # what is missing

    def _look(self) -> None:
        now = time.monotonic()
        if now - self.looked > QUIET:
            self.came = now  # this process was stopped itself: what waits for it comes first
        self.looked = now
        if now - self.came > QUIET:
            self._expect_all_that_was_said()
        if self.call and now - self.asked > PATIENCE:
            self._forget()
        gap = self._gap()
        if not gap:
            self.since = 0.0
        elif not self.call:
            self.since = self.since or now
            if why := self._in_vain(now):
                self._give_up(*gap, why)
            elif self.client.service_is_ready():
                self._ask(*gap)

    def _expect_all_that_was_said(self) -> None:
        word, state = self.attending.others.word(self.name), self.attending.replay_state
        if word and word.done and state and (word.run == state.run or word.reason):
            for stream in self.streams.values():
                stream.expect(state.run, state.first, word.next)

    def _gap(self) -> tuple[int, int, int] | None:
        """Run and samples start, ..., stop - 1: the first that are missing, on one topic or several."""
        return min(((stream.run, *gap) for stream in self.streams.values() if (gap := stream.gap())), default=None)

    def _lacking(self, run: int, start: int) -> list[InOrder]:
        """The topics on which samples are missing from `start` on."""
        streams = [stream for stream in self.streams.values() if stream.run == run]
        return [stream for stream in streams if (gap := stream.gap()) and gap[0] == start]

    def _in_vain(self, now: float) -> str:
        """Why there is nobody to ask any more; "" while there is."""
        others = self.attending.others
        if others.word(self.name) is None:
            late = now - self.since > DISCOVERY and not self.client.service_is_ready()
            return "nobody can give them again" if late else ""
        if (state := others.state(self.name)) in GONE:
            return others.how(self.name, state)
        return f"it has not answered for {STAYS:g} s" if now - self.since > STAYS else ""

    def _ask(self, run: int, start: int, stop: int) -> None:
        stop = min(stop, start + self.most)
        request = GetEstimates.Request(revision=self._revision(run, start), run=run, start=start, stop=stop)
        self.asked, self.call = time.monotonic(), self.client.call_async(request)
        self.call.add_done_callback(lambda call: self._answered(call, run, start, stop))

    def _answered(self, call: Future, run: int, start: int, stop: int) -> None:
        if call is not self.call:
            return
        self.call, response = None, call.result()
        word = self.attending.others.word(self.name)
        if response.success:
            self._fill(response, run, start)
        elif word and 0 < word.missing < stop - start:
            self.most = (stop - start) // 2  # some of them it has
        else:
            self._give_up(run, start, stop, response.message)
        self._look()

    def _fill(self, response: GetEstimates.Response, run: int, start: int) -> None:
        self.since, self.most = 0.0, 1 << 20
        for stream in self._lacking(run, start):
            topic = next(topic for topic, one in self.streams.items() if one is stream)
            message = getattr(response, topic.rpartition("/")[2])
            about = About(message.run, message.number, len(message.time_ns))
            if (about.run, about.number) != (run, start) or not about.count:
                return self._give_up(run, start, start + 1, f"{self.client.srv_name} gave something else")
            stream.fill(about, serialize_message(message))

    def _give_up(self, run: int, start: int, stop: int, why: str) -> None:
        self.since, self.most, self.why_not = 0.0, 1 << 20, why
        for stream in self._lacking(run, start):
            stream.give_up(min(stop, stream.gap()[1]))

    def _forget(self) -> None:
        if self.call:
            self.client.remove_pending_request(self.call)
            self.call = None


HEADER, WORD, REST = struct.Struct("<iII"), struct.Struct("<I"), struct.Struct("<QI")


def about_of(raw: bytes, kind: type) -> About:
    """Of a message that begins with header, run, number, time_ns (see cdr.py): deserialised it is by who draws it."""
    if raw[: len(PLAIN)] != PLAIN:  # from a machine of the other byte order
        message = deserialize_message(raw, kind)
        return About(message.run, message.number, len(message.time_ns))
    return _head(raw)[0]


def revision_of(raw: bytes, kind: type) -> int:
    """Of the model that says it: after the times come the model's name, the method's, and this."""
    if raw[: len(PLAIN)] != PLAIN:
        return deserialize_message(raw, kind).revision
    about, at = _head(raw)
    at += about.count * 8 + (aligned(at, 8) - at if about.count else 0)
    for _ in ("model", "method"):
        at = aligned(at, 4)
        at += WORD.size + WORD.unpack_from(raw, at)[0]
    return WORD.unpack_from(raw, aligned(at, 4))[0]


def _head(raw: bytes) -> tuple[About, int]:
    """And where it ends."""
    at = len(PLAIN)
    text = HEADER.unpack_from(raw, at)[2]
    at = aligned(at + HEADER.size + text, 4)
    (run,) = WORD.unpack_from(raw, at)
    at = aligned(at + WORD.size, 8)
    return About(run, *REST.unpack_from(raw, at)), at + REST.size
