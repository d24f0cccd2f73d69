"""What a recorder has missed is asked for: samples of the replay, estimates of each estimator.

A process that was stopped longer than the middleware waits for it has lost what was said meanwhile. What has been said
by a node's own word, and has not come for a second, is not on its way any more.
"""

import time
from collections.abc import Callable, Sequence
from functools import partial

from crash_msgs.srv import GetEstimates, GetSamples
from rclpy.node import Node
from rclpy.serialization import serialize_message
from rclpy.task import Future

from .attendance import GONE
from .attending import REPLAY
from .completeness import ESTIMATOR, SILENT_FOR, Completeness
from .numbers import Numbers, Span
from .recorded_topics import About
from .recorder import Heard

OVERDUE = 1.0
"""s without a change after which what is missing is asked for."""
PATIENCE, TRIES = 10.0, 3
"""s to wait for an answer, or for a service to be found, and how often."""


class Source:
    """One node's service, of which one piece after the other is asked."""

    def __init__(self, client, topics: Callable[[], Sequence[str]], take: Callable):
        """topics: that it can give something of; take: writes what a response holds."""
        self.client, self.topics, self.take = client, topics, take
        self.call: Future | None = None
        self.gap: Span = (0, 0)
        self.since = self.asked_at = time.monotonic()
        self.most = 1 << 20  # numbers in a request; halved where only some of them can be had
        self.tries = 0

    def forget(self) -> None:
        if self.call:
            self.client.remove_pending_request(self.call)
            self.call = None


class Fetching:
    def __init__(self, node: Node, account: Completeness, write: Callable[[Heard, bytes], None]):
        """write: a message into the recording and its account."""
        self.node, self.account, self.write = node, account, write
        self.sources: dict[str, Source] = {}  # by node

    def look(self) -> bool:
        """Ask for what is overdue; whether anything is still to be had."""
        self._find_sources()
        return any([self._look_at(name, source) for name, source in self.sources.items()])

    def _find_sources(self) -> None:
        for name in set(self.account.others.names(REPLAY)) - set(self.sources):
            client = self.node.create_client(GetSamples, f"{name}/get_samples")
            self.sources[name] = Source(client, self.account.samples, self._take_samples)
        for name in set(self.account.others.names(ESTIMATOR)) - set(self.sources):
            client = self.node.create_client(GetEstimates, f"{name}/get_estimates")
            self.sources[name] = Source(client, partial(self.account.estimates, name), self._take_estimates)

    def _look_at(self, name: str, source: Source) -> bool:
        gap, now = self._gap(name, source), time.monotonic()
        if not gap:
            source.forget()
            return False
        if gap[0] != source.gap[0]:
            source.since, source.tries = now, 0
        source.gap = gap
        if source.call and now - source.asked_at > PATIENCE:
            source.forget()
            source.tries += 1
        if self._in_vain(name, source, now):
            return False
        if not source.call and now - source.since > OVERDUE and source.client.service_is_ready():
            self._ask(name, source)
        return True

    def _gap(self, name: str, source: Source) -> Span | None:
        """The first numbers that one of its topics lacks, of those that the node says it has dealt with."""
        of, word = self.account.last_pass, self.account.others.word(name)
        upto = of.sent if word.role == REPLAY else min(of.sent, word.next if word.run == of.run else 0)
        found = Numbers()
        for topic in source.topics():
            written = self.account.of(topic)
            there = Numbers([*written.last.spans, *written.given_up.spans] if written.run == of.run else [])
            for span in there.missing(of.first, upto):
                found.add(*span)
        return found.spans[0] if found.spans else None

    def _in_vain(self, name: str, source: Source, now: float) -> bool:
        others, why = self.account.others, ""
        if others.state(name) in GONE:
            why = f"{name} {others.how(name, others.state(name))}"
        elif others.silence(name) > SILENT_FOR or source.tries >= TRIES:
            why = f"{source.client.srv_name} has not answered"
        elif not source.client.service_is_ready() and now - source.since > PATIENCE:
            why = f"there is no service {source.client.srv_name}"
        if why:
            source.forget()
            self._give_up(source, source.gap, why)
        return bool(why)

    def _give_up(self, source: Source, span: Span, why: str) -> None:
        for topic in source.topics():
            self.account.give_up(topic, span, why)

    def _ask(self, name: str, source: Source) -> None:
        start, stop = source.gap[0], min(source.gap[1], source.gap[0] + source.most)
        request = source.client.srv_type.Request(start=start, stop=stop)
        if isinstance(request, GetEstimates.Request):
            request.run, request.revision = self.account.last_pass.run, self.account.revisions.get(name, 0)
        source.asked_at, source.call = time.monotonic(), source.client.call_async(request)
        source.call.add_done_callback(lambda call: self._answered(name, source, call, (start, stop)))

    def _answered(self, name: str, source: Source, call: Future, span: Span) -> None:
        if call is not source.call:
            return
        source.call = None
        response = call.result()
        if response.success:
            source.tries, source.most = 0, 1 << 20
            source.take(name, response)
        elif span[1] - span[0] > 1:
            source.most = (span[1] - span[0]) // 2
        else:
            self._give_up(source, span, response.message)
        gap = self._gap(name, source)
        if gap and (gap[0] > span[0] or not response.success):
            source.gap, source.since = gap, time.monotonic() - OVERDUE
            self._ask(name, source)
        elif gap:
            self._give_up(source, gap, f"{source.client.srv_name} gave something else")

    def _take_samples(self, _: str, response: GetSamples.Response) -> None:
        response.samples.run = self.account.last_pass.run
        for topic in self.account.samples():
            self._take(topic, response.samples)

    def _take_estimates(self, name: str, response: GetEstimates.Response) -> None:
        for topic in self.account.estimates(name):
            self._take(topic, getattr(response, topic.rpartition("/")[2]))

    def _take(self, topic: str, message) -> None:
        about = About(message.run, message.number, len(message.time_ns))
        if self.account.lacks(topic, about):
            kind = f"crash_msgs/msg/{type(message).__name__}"
            self.write(Heard(topic, kind, latched=False), serialize_message(message))
            self.account.of(topic).fetched.add(about.number, about.number + about.count)
