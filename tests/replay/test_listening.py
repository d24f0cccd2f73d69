"""When `record` takes what it has found for all there is to find: the samples come last. No ROS graph here."""

import time
from types import SimpleNamespace

import pytest
from rclpy.qos import DurabilityPolicy

from crash_replay.listening import SETTLED, TO_COME_WITHIN, Listening
from crash_replay.recorded_topics import SAMPLES, Choice
from crash_replay.recorder import Heard

NODE = SimpleNamespace(resolve_topic_name="/{}".format)


@pytest.mark.parametrize(
    ("quiet", "more_to_come", "settled"),
    [
        (0.5 * SETTLED, False, False),
        (2.0 * SETTLED, False, True),
        (2.0 * SETTLED, True, False),  # a channel that the test names has not been found
        (TO_COME_WITHIN + 1.0, True, True),  # who has said so may be a recording, of which nothing more comes
    ],
)
def test_samples_are_waited_with_until_all_that_is_known_of_is_found(quiet, more_to_come, settled):
    listening = Listening(NODE, Choice(), 0, print, lambda: more_to_come)
    listening.newest = time.monotonic() - quiet
    assert listening.settled() == settled


def test_a_while_in_which_it_got_no_processor_is_not_quiet():
    node = SimpleNamespace(get_topic_names_and_types=list)
    listening = Listening(node, Choice(), 0, print)
    listening.newest = time.monotonic() - 10.0 * SETTLED
    listening.looked = listening.newest
    listening.look()
    assert not listening.settled()
    time.sleep(SETTLED)
    assert listening.settled()


class Graph:
    """A node that finds what is put into `topics`, and counts what is subscribed to."""

    def __init__(self):
        self.topics: dict[str, str] = {}  # types, by name
        self.subscribed: list[str] = []

    def get_topic_names_and_types(self):
        return [(name, [kind]) for name, kind in sorted(self.topics.items())]

    def count_publishers(self, _name):
        return 1

    def get_publishers_info_by_topic(self, _name):
        volatile = SimpleNamespace(durability=DurabilityPolicy.VOLATILE)
        return [SimpleNamespace(node_namespace="/", qos_profile=volatile)]

    def get_namespace(self):
        return "/"

    def get_logger(self):
        return SimpleNamespace(info=list)

    def create_subscription(self, _type, name, _heard, _qos, raw):
        assert raw
        self.subscribed.append(name)


def test_samples_that_are_found_first_are_subscribed_to_last():
    """In the first look of all, and in one in which the samples would have waited long enough."""
    graph = Graph()
    listening = Listening(graph, Choice(["samples", "channels/*", "zeros"]), 0, print)
    graph.topics["/samples"] = SAMPLES
    listening.look()
    assert graph.subscribed == []
    listening.newest -= 2.0 * SETTLED
    graph.topics["/zeros"] = "crash_msgs/msg/Forces"
    listening.look()
    assert graph.subscribed == ["/zeros"]
    graph.topics["/channels/rib_ay"] = "geometry_msgs/msg/AccelStamped"
    listening.newest -= 2.0 * SETTLED
    listening.look()
    assert graph.subscribed == ["/zeros", "/channels/rib_ay"]
    listening.newest -= 2.0 * SETTLED
    assert [topic.name for topic in listening.look()] == ["/samples"]


@pytest.mark.parametrize("more_to_come", [False, True])
def test_it_is_ready_when_it_hears_the_samples_and_nothing_more_is_to_come(more_to_come):
    listening = Listening(NODE, Choice(), 0, print, lambda: more_to_come)
    listening.newest = time.monotonic()
    assert not listening.ready()
    listening.heard["/samples"] = Heard("/samples", SAMPLES, latched=False)
    assert listening.ready() != more_to_come
