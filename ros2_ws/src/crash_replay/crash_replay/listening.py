"""Finds the topics to record as their publishers come, and subscribes to them: to the samples last."""

import time
from collections.abc import Callable
from functools import partial
from importlib import import_module
from typing import Any

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

from .namespaces import is_own
from .qos import EVERY_SAMPLE, EVERY_SAMPLE_SAID
from .recorded_topics import PARAMETERS, SAMPLES, Choice
from .recorder import Heard

SETTLED = 0.3
"""s without a new topic after which those that are heard reach this node."""
TO_COME_WITHIN = 10.0
"""s without a new topic after which one that is known of is not waited for any more: who said so may be a recording."""


class Listening:
    def __init__(
        self,
        node: Node,
        choice: Choice,
        wait_for: int,
        hear: Callable[[Heard, bytes], None],
        more_to_come: Callable[[], bool] = lambda: False,
    ):
        """wait_for: estimators to hear before the samples; hear: called with each message, serialized; more_to_come:
        whether a topic is known of that has not been found yet."""
        self.node, self.choice, self.wait_for, self.hear, self.more_to_come = node, choice, wait_for, hear, more_to_come
        self.found: set[str] = set()  # names of topics that are wanted and published
        self.heard: dict[str, Heard] = {}  # by name; the samples are found first and heard last
        self.newest = 0.0  # monotonic s, when a topic was found
        self.looked = time.monotonic()

    def look(self) -> list[Heard]:
        """What is heard since this look; a replay that waits for this node begins when all is heard."""
        now, heard = time.monotonic(), list[Heard]()
        self.newest += max(0.0, now - self.looked - SETTLED / 2)  # while this process stands still it finds nothing
        self.looked = now
        for name, (kind, *_) in sorted(self.node.get_topic_names_and_types(), key=_samples_last):
            if name in self.heard or not self.choice.wants(name, kind) or not self.node.count_publishers(name):
                continue
            own = is_own(self.node, name)
            if not self.choice.wants(name, kind, own):
                continue
            if name not in self.found:  # a replay's other topics may be found in any order, and later
                self.found.add(name)
                self.newest = time.monotonic()
            if kind != SAMPLES or self.settled():
                heard.append(self._subscribe(name, kind, own))
        return heard

    def settled(self) -> bool:
        estimators = sum(topic.type == PARAMETERS and topic.own for topic in self.heard.values())
        quiet = time.monotonic() - self.newest > SETTLED
        return estimators >= self.wait_for and quiet and not self._waits_for_more()

    def ready(self) -> bool:
        """Whether all that is to be recorded reaches this node from now on."""
        samples = self.node.resolve_topic_name("samples")
        if self.choice.wants(samples, SAMPLES):
            return samples in self.heard and not self._waits_for_more()
        return self.settled()

    def _waits_for_more(self) -> bool:
        return time.monotonic() - self.newest < TO_COME_WITHIN and self.more_to_come()

    def _subscribe(self, name: str, kind: str, own: bool) -> Heard:
        qos = self._qos(name)
        topic = self.heard[name] = Heard(name, kind, qos is EVERY_SAMPLE_SAID, own)
        package, _, message = kind.split("/")
        message_type = getattr(import_module(f"{package}.msg"), message)
        heard: Any = partial(self.hear, topic)  # raw: it is given bytes, of which rclpy's types know nothing
        self.node.create_subscription(message_type, name, heard, qos, raw=True)
        self.node.get_logger().info(f"recording {name}")
        return topic

    def _qos(self, topic: str) -> QoSProfile:
        """What was said before this node came is heard where it is kept."""
        offered = [info.qos_profile.durability for info in self.node.get_publishers_info_by_topic(topic)]
        return EVERY_SAMPLE_SAID if set(offered) == {DurabilityPolicy.TRANSIENT_LOCAL} else EVERY_SAMPLE


def _samples_last(topic: tuple[str, list[str]]) -> bool:
    return SAMPLES in topic[1]
