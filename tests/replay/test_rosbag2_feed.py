"""What rosbag2's own player publishes of a bag feeds the estimators: the channels one by one, aligned by their stamps.

rosbag2 is no Python package: its player is imitated. As that does, it publishes each message of the bag as it is,
serialized, on its topic, with its type and the quality of service that the bag states (or rosbag2's default).
"""

from itertools import islice

import crash_msgs.msg
import numpy as np
import pytest
from helpers_estimator_node import Stage, joined
from helpers_paths import BAGS
from mcap.reader import make_reader
from numpy.testing import assert_array_equal
from rclpy.qos import QoSDurabilityPolicy, QoSProfile, QoSReliabilityPolicy
from ruamel.yaml import YAML

from crash_estimator.core.fold import run
from crash_estimator.core.methods import make_estimator
from crash_estimator.model_file import load_model
from crash_replay.bag import read_bag
from crash_replay.qos import STREAM
from crash_replay.ros_messages import CHANNEL_TYPES

BAG = BAGS / "frontal_engine_cab.mcap"
MODEL = "frontal_engine_cab"
CHANNELS = 3
SAMPLES = 300  # of the bag's, for most tests
TYPES = CHANNEL_TYPES | {"crash_msgs/msg/TestInfo": crash_msgs.msg.TestInfo}


class Player:
    """`ros2 bag play`, as fast as it is taken."""

    def __init__(self, stage: Stage, offered: bool = True):
        """offered: with the bag's quality of service; else rosbag2's default."""
        self.stage = stage
        stage.node.destroy_publisher(stage.samples)
        stage.node.destroy_publisher(stage.test)
        with BAG.open("rb") as stream:
            reader = make_reader(stream)
            channels = reader.get_summary().channels.values()
            schemas = reader.get_summary().schemas
            self.messages = [(channel.topic, message.data) for _, channel, message in reader.iter_messages()]
        node = stage.others.add("player")
        self.publishers = {
            c.topic: node.create_publisher(
                TYPES[schemas[c.schema_id].name],
                c.topic,
                _qos(c.metadata["offered_qos_profiles"]) if offered else QoSProfile(depth=5000),
            )
            for c in channels
        }

    def found(self) -> bool:
        return all(p.get_subscription_count() for topic, p in self.publishers.items() if topic != "/test")

    def play(self, start: int = 0, stop: int = SAMPLES, leave_out=lambda topic, number: False) -> None:
        """The test and the messages of the samples start, ..., stop - 1."""
        self.publishers["/test"].publish(self.messages[0][1])
        seen = dict.fromkeys(self.publishers, 0)
        for k, (topic, data) in enumerate(islice(self.messages, 1, 1 + stop * CHANNELS)):
            if seen[topic] >= start and not leave_out(topic, seen[topic]):
                self.publishers[topic].publish(data)
            seen[topic] += 1
            if k % CHANNELS == 0:
                self.stage.executor.spin_once(timeout_sec=0.0)


def _qos(text: str) -> QoSProfile:
    (stated,) = YAML(typ="safe").load(text)
    durability = {"volatile": QoSDurabilityPolicy.VOLATILE, "transient_local": QoSDurabilityPolicy.TRANSIENT_LOCAL}
    assert stated["reliability"] == "reliable"
    return QoSProfile(
        depth=stated["depth"], durability=durability[stated["durability"]], reliability=QoSReliabilityPolicy.RELIABLE
    )


@pytest.fixture(scope="module")
def whole():
    """Parameters after every sample, as the one loop gives them."""
    recording = read_bag(BAG)
    estimator = make_estimator(load_model(MODEL), recording.test, "mrls")
    return np.array([e.parameters for e in run(estimator, recording.samples())])


def numbers(messages) -> list[int]:
    return [message.number for message in messages]


@pytest.mark.parametrize("offered", [True, False])
def test_the_bag_played_twice_gives_what_the_loop_gives(stage, whole, offered):
    stage.add_estimator(model=MODEL, method="mrls")
    player = Player(stage, offered)
    stage.spin_until(player.found, "the estimator listens to the channels")
    player.play()
    player.play()  # --loop
    heard = stage.wait_for("estimator", 2 * SAMPLES)
    assert numbers(heard["parameters"]) == 2 * list(range(SAMPLES))
    assert [message.run for message in heard["parameters"]] == [0] * SAMPLES + [1] * SAMPLES
    assert_array_equal(joined(heard["parameters"], "value"), np.tile(whole[:SAMPLES], (2, 1)))
    assert not [event for event in heard["events"] if event.kind == "lost"]


def test_what_is_lost_on_the_way_is_said(stage, whole):
    stage.add_estimator(model=MODEL, method="mrls")
    player = Player(stage)
    stage.spin_until(player.found, "the estimator listens to the channels")
    player.play(stop=200, leave_out=lambda topic, number: 100 <= number < 103 or (number == 150 and "barrier" in topic))
    heard = stage.wait_for("estimator", 197)
    assert numbers(heard["parameters"]) == [*range(100), *range(103, 200)]
    text = "3 samples before number 103 were not seen; the estimates rest on every sample from number 103 on"
    assert [(e.number, e.text) for e in heard["events"] if e.kind == "lost"] == [(103, text)]
    assert [(e.number, e.target) for e in heard["events"] if e.kind == "dropout"] == [(150, "barrier")]
    assert_array_equal(joined(heard["parameters"], "value")[:100], whole[:100])


def test_the_replay_itself_is_not_made_to_send_channels(stage, whole):
    """Where `samples` come the channels are not listened to."""
    stage.add_estimator(model=MODEL, method="mrls")
    stage.replay(BAG, wait_for=1, rate=1.0, block=20, until=0.02, keep_alive=True)
    heard = stage.wait_for("estimator", 5)

    def channels() -> list[str]:
        return [topic for topic, _ in stage.node.get_topic_names_and_types() if topic.startswith("/channels/")]

    stage.spin_until(lambda: len(channels()) == CHANNELS, "the replay's channels are found")
    stage.spin(0.3)  # the estimator looks for them ten times a second
    assert not any(stage.node.count_subscribers(topic) for topic in channels())
    assert_array_equal(joined(heard["parameters"], "value"), whole[: sum(len(m.time_ns) for m in heard["parameters"])])


def test_the_channels_of_a_replay_that_ends_are_not_listened_to(stage):
    """Its topics go one by one: for a moment the channels are there without the samples.

    Who listened to them from then on would hear the next replay twice, until that is found out.
    """
    stage.add_estimator(model=MODEL, method="mrls")
    replay = stage.others.add("replay")
    samples = replay.create_publisher(crash_msgs.msg.Samples, "samples", STREAM)
    stage.node.destroy_publisher(stage.samples)
    stage.spin_until(lambda: samples.get_subscription_count(), "the replay's samples are listened to")
    stage.spin(0.3)  # the estimator looks around ten times a second
    channel = replay.create_publisher(TYPES["geometry_msgs/msg/AccelStamped"], "channels/engine_ax", STREAM)
    replay.destroy_publisher(samples)
    stage.spin(0.5)
    assert not channel.get_subscription_count()
    player = Player(stage)  # of another process
    stage.spin_until(player.found, "the estimator listens to the channels")
