"""`/clock`: before the samples, ticking while nothing is sent, and of one replay only unless told otherwise."""

import signal
import time
from types import SimpleNamespace

from helpers_replay import Listener, Replay, some_recording, wait_until
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Trigger

from crash_replay.bag import time_zero_ns
from crash_replay.player import Batch
from crash_replay.qos import STREAM
from crash_replay.replay_topics import ReplayTopics
from crash_replay.ros_messages import stamp_ns
from crash_replay.subscribers import UNNAMED

RECORDING = some_recording()
STAMPS = (RECORDING.time_ns + time_zero_ns(RECORDING)).tolist()


def clocks_of(listener) -> list[int]:
    """ns, filled as they come."""
    heard = []
    listener.listen(Clock, "/clock", lambda message: heard.append(stamp_ns(message.clock)), STREAM)
    return heard


def publishers(listener) -> list[str]:
    """By name, once the listener knows each by name: a publisher may be seen before the node that it belongs to."""
    found = listener.node.get_publishers_info_by_topic
    wait_until(lambda: all(info.node_name != UNNAMED for info in found("/clock")))
    return sorted(info.node_name for info in found("/clock"))


def test_it_is_told_before_the_samples_of_its_time(listener):
    topics = ReplayTopics(listener.node, RECORDING, clock="true")
    told = []
    topics.clock.heard = [SimpleNamespace(publish=lambda message: told.append(("clock", stamp_ns(message.clock))))]
    topics.samples = SimpleNamespace(publish=lambda message: told.append(("samples", message.number)))
    topics.send(Batch(0, 2, 0, None, None))
    topics.send(Batch(2, 3, 0, None, None))
    assert told == [("clock", STAMPS[1]), ("samples", 0), ("clock", STAMPS[2]), ("samples", 2)]


def test_it_ticks_while_the_replay_is_paused_and_never_goes_back(bag, listener):
    heard = clocks_of(listener)
    with Replay(bag, wait_for=1, start_paused=True) as replay:
        wait_until(lambda: heard.count(STAMPS[0]) > 5)
        assert set(heard) == {STAMPS[0]} and not listener.messages
        listener.call(Trigger, "resume")
        assert replay.end()[0] == 0
    wait_until(lambda: heard and heard[-1] == STAMPS[-1])
    assert set(STAMPS) <= set(heard) and heard == sorted(heard)


def test_of_two_replays_one_publishes_it(bag, listener):
    with Replay(bag, start_paused=True) as first, Replay(bag, ["__node:=second"], start_paused=True) as second:
        both = {first: "replay", second: "second"}
        wait_until(lambda: listener.node.count_publishers("samples") == 2)
        time.sleep(2.0)  # else one may be all that the listener has seen so far
        wait_until(lambda: len(publishers(listener)) == 1)
        (keeps,) = publishers(listener)
        said = {name: process.interrupt()[2] for process, name in both.items()}
    (gives_way,) = set(both.values()) - {keeps}
    assert said[keeps] == ""
    assert f"/{keeps} publishes /clock: this replay does not; clock:=true makes it" in said[gives_way]


def test_it_leaves_it_to_a_simulator(bag, listener):
    listener.node.create_publisher(Clock, "/clock", 1)
    with Replay(bag, start_paused=True, wait_for=1) as replay:
        wait_until(lambda: listener.states and listener.node.count_publishers("/clock") == 1)
        assert "/listener publishes /clock" in replay.interrupt()[2]


def test_in_a_namespace_only_where_it_is_asked_for(bag, listener):
    quiet, asked = (["__ns:=/sled_a"], ["__ns:=/sled_b"])
    with (
        Replay(bag, quiet, start_paused=True) as first,
        Replay(bag, asked, start_paused=True, clock=True) as second,
        Listener("a", namespace="/sled_a") as a,
        Listener("b", namespace="/sled_b") as b,
    ):
        wait_until(lambda: a.states and b.states)
        heard = clocks_of(listener)
        wait_until(lambda: heard)
        assert publishers(listener) == ["replay"]
        first.process.send_signal(signal.SIGINT)
        assert first.end()[0] == 0
        before = len(heard)
        wait_until(lambda: len(heard) > before)  # the other's
        assert second.interrupt()[0] == 0
