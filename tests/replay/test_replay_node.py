"""The replay over ROS: a process of its own, as `ros2 run` starts it, and a listener here."""

import re
import signal
from dataclasses import replace

import numpy as np
import pytest
from crash_msgs.msg import ReplayState
from crash_msgs.srv import Burst, Seek, SetRate, Step
from geometry_msgs.msg import PointStamped
from helpers_replay import Listener, Replay, as_arguments, some_recording, wait_until
from numpy.testing import assert_array_equal
from rcl_interfaces.srv import DescribeParameters, SetParameters
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger

from crash_replay.bag import time_zero_ns, write_bag
from crash_replay.player import Batch
from crash_replay.qos import STREAM
from crash_replay.recording import Recording
from crash_replay.replay_node import main
from crash_replay.replay_topics import ReplayTopics
from crash_replay.ros_messages import channel_from_msg, channel_type, stamp_ns, test_to_msg

RECORDING = some_recording()  # 40 samples at 1 kHz, the impact at number 10
FINISHED = r"finished: 40 samples sent in 40 messages, rate [\d.]+ of 1 asked for, at worst [\d.]+ ms late\n"


def test_a_whole_replay(bag, listener):
    """Every sample, every channel, the test and the state."""
    channels = [[] for _ in RECORDING.test.channels]
    for channel, messages in zip(RECORDING.test.channels, channels):
        listener.listen(channel_type(channel), f"channels/{channel.name}", messages.append, STREAM)
    with Replay(bag, wait_for=1, start_paused=True) as replay:
        wait_until(lambda: listener.states and listener.states[-1].subscribers)
        listener.call(Trigger, "resume")
        status, output, errors = replay.end()
    assert (status, errors) == (0, "")
    assert re.fullmatch(FINISHED, output)
    wait_until(lambda: all(len(messages) == 40 for messages in channels))

    assert listener.tests == [test_to_msg(RECORDING)]
    assert listener.numbers() == [(0, number) for number in range(40)]
    assert [sample.time_ns for sample in listener.samples()] == RECORDING.time_ns.tolist()
    assert_array_equal(np.array([sample.values for sample in listener.samples()]), RECORDING.values)
    stamps = (RECORDING.time_ns + time_zero_ns(RECORDING)).tolist()
    assert [stamp_ns(message.header.stamp) for message in listener.messages] == stamps
    for k, (channel, messages) in enumerate(zip(RECORDING.test.channels, channels)):
        assert [stamp_ns(message.header.stamp) for message in messages] == stamps
        assert_array_equal([channel_from_msg(channel, message) for message in messages], RECORDING.values[:, k])
    last = listener.states[-1]
    assert (last.state, last.number, last.total, last.sent, last.block) == (ReplayState.FINISHED, 40, 40, 40, 1)
    assert (last.time, last.rate_asked) == (0.029, 1.0)
    assert last.rate_actual == 0.0  # it plays no more
    assert stamp_ns(last.header.stamp) == stamps[-1]


def test_only_channels_that_somebody_listens_to_are_made(listener, monkeypatch):
    made = []
    make = "crash_replay.replay_topics.channel_to_msg"
    monkeypatch.setattr(make, lambda channel, *_: made.append(channel.name) or PointStamped())
    topics = ReplayTopics(listener.node, RECORDING, clock="true")
    topics.send(Batch(0, 2, 0, None, None))
    assert made == []
    heard = []
    listener.listen(PointStamped, "channels/nose_travel", heard.append, STREAM)
    wait_until(lambda: topics.find_subscribers() or topics.heard)
    topics.send(Batch(2, 5, 0, None, None))
    assert made == ["nose_travel"] * 3
    wait_until(lambda: len(heard) == 3)


def test_blocks_hold_the_same_samples(tmp_path, listener):
    recording = some_recording(503, period_ns=100_000)  # 10 kHz: 400 messages a second with 25 samples each
    with Replay(write_bag(recording, tmp_path / "b"), wait_for=1) as replay:
        status, output, errors = replay.end()
    assert (status, errors) == (0, "")
    assert output.startswith("finished: 503 samples sent in 21 messages")
    wait_until(lambda: len(listener.messages) == 21)
    assert listener.numbers() == [(0, number) for number in range(503)]
    assert [sample.time_ns for sample in listener.samples()] == recording.time_ns.tolist()
    assert_array_equal(np.array([sample.values for sample in listener.samples()]), recording.values)


def test_control_by_services(bag, listener):
    with Replay(bag, start_paused=True, keep_alive=True, wait_for=1) as replay:
        answer = listener.call(Step, "step", n=3)
        assert (answer.success, answer.number, answer.message) == (True, 3, "3 samples sent, the next is sample 3")
        wait_until(lambda: listener.numbers() == [(0, 0), (0, 1), (0, 2)])

        answer = listener.call(Step, "step", n=-2)
        assert (answer.success, answer.number) == (True, 1)
        listener.call(Step, "step", n=1)
        wait_until(lambda: listener.numbers()[3:] == [(1, 1)])

        answer = listener.call(Seek, "seek", time=0.0)
        assert (answer.success, answer.number) == (True, 10)
        answer = listener.call(Burst, "burst", n=5)
        assert (answer.success, answer.sent) == (True, 5)
        wait_until(lambda: listener.numbers()[4:] == [(2, number) for number in range(10, 15)])
        wait_until(lambda: listener.states[-1].number == 15)
        state = listener.states[-1]
        assert (state.state, state.run, state.sent) == (ReplayState.PAUSED, 2, 9)
        assert (state.time, state.rate_actual) == (0.005, 0.0)  # where it is, and that it does not play

        assert listener.call(SetRate, "set_rate", rate=0.01).message == "rate 0.01"  # 0.1 s from sample to sample
        assert listener.call(Trigger, "resume").message == "playing, the next is sample 15"
        wait_until(lambda: len(listener.numbers()) == 11)
        assert listener.call(Trigger, "pause").message.startswith("paused, the next is sample")
        assert listener.call(Trigger, "toggle").message.startswith("playing, ")
        assert listener.call(SetRate, "set_rate", rate=10.0).success
        wait_until(lambda: listener.states[-1].state == ReplayState.FINISHED)
        assert listener.numbers()[9:] == [(2, number) for number in range(15, 40)]
        assert listener.states[-1].rate_asked == 10.0

        answer = listener.call(Burst, "burst", n=1)
        assert (answer.success, answer.sent) == (False, 0)
        assert answer.message.startswith("no sample is left: sample 39 was the last")
        assert replay.process.poll() is None
        assert replay.interrupt()[0] == 0


def test_a_burst_to_the_end_is_answered_before_the_replay_ends(bag, listener):
    with Replay(bag, start_paused=True, wait_for=1) as replay:
        assert listener.call(Burst, "burst", n=1000).sent == 40
        assert replay.end()[0] == 0
    wait_until(lambda: len(listener.numbers()) == 40)


def test_what_cannot_be_done_is_refused_with_a_reason(bag, listener):
    with Replay(bag, start_paused=True, wait_for=1):
        for service, name, request, reason in (
            (Seek, "seek", {"time": 1.0}, "time must be between -0.01 and 0.029 s, got 1 s"),
            (Seek, "seek", {"time": float("nan")}, "time must be a number of seconds, got nan"),
            (Step, "step", {"n": -1}, "cannot go back: sample 0 is the first"),
            (SetRate, "set_rate", {"rate": 0.0}, "Parameter rate out of range Min: 0.001, Max: 1000.0, value: 0.0"),
        ):
            answer = listener.call(service, name, **request)
            assert (answer.success, answer.message) == (False, reason)
    assert listener.messages == []


def test_the_rate_is_a_parameter_that_can_be_set(bag, listener):
    def set_parameter(name, value):
        parameters = [Parameter(name, value=value).to_parameter_msg()]
        return listener.call(SetParameters, "set_parameters", parameters=parameters).results[0]

    with Replay(bag, start_paused=True, wait_for=1):
        assert set_parameter("rate", 2.5).successful
        wait_until(lambda: listener.states and listener.states[-1].rate_asked == 2.5)
        assert set_parameter("rate", 3).successful  # an integer is a number too
        wait_until(lambda: listener.states[-1].rate_asked == 3.0)
        for wrong in (1001.0, 1001, "fast", True):
            refused = set_parameter("rate", wrong)
            assert not refused.successful and refused.reason, wrong
        assert not set_parameter("block", 3).successful  # only the rate can be changed
        names = ["rate", "block", "bag"]
        described = listener.call(DescribeParameters, "describe_parameters", names=names).descriptors
        assert all(descriptor.description for descriptor in described)
        assert described[0].floating_point_range[0].to_value == 1000.0


def test_a_late_joiner_gets_the_test_and_the_state(bag):
    with Replay(bag, start_paused=True, wait_for=1), Listener("first") as first:
        first.call(Step, "step", n=4)
        wait_until(lambda: first.states[-1].number == 4)
        with Listener("second") as second:
            wait_until(lambda: second.tests == [test_to_msg(RECORDING)] and second.states)
            assert (second.states[0].number, second.messages) == (4, [])
            first.call(Step, "step", n=1)
            wait_until(lambda: second.numbers() == [(0, 4)])


def test_it_loops_until_it_is_interrupted(bag, listener):
    with Replay(bag, loop=True, rate=2.0, wait_for=1) as replay:
        wait_until(lambda: len(listener.numbers()) > 100)
        status, output, errors = replay.interrupt()
    assert (status, errors) == (0, "")
    assert output.startswith("stopped before sample ") and output.count("\n") == 1
    numbers = listener.numbers()
    assert numbers == [divmod(k, 40) for k in range(len(numbers))]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_it_waits_ends_it_cleanly(bag, listener, number):
    with Replay(bag, wait_for=5) as replay:
        wait_until(lambda: listener.states and listener.states[-1].state == ReplayState.WAITING)
        replay.process.send_signal(number)
        status, output, errors = replay.end()
    assert (status, errors) == (0, "")
    assert output.startswith("stopped before sample 0 of 40: 0 samples sent")


def test_it_says_who_is_missing(bag, listener):
    with Replay(bag, wait_for=2, wait_timeout=3) as replay:  # a node may be found a second after its subscription
        status, output, errors = replay.end()
    assert (status, output) == (1, "")
    expected = "only 1 of 2 subscribers on samples after 3 s (there: listener): start the others, or lower wait_for"
    assert errors == f"error: {expected}\n"
    assert listener.messages == []


def test_a_subscriber_that_is_slow_loses_nothing(tmp_path):
    """At full speed it is left behind by more than the 5000 messages that it and the replay could hold."""
    n = 12_000
    test = replace(RECORDING.test, channels=RECORDING.test.channels[:1])
    recording = Recording(test, np.arange(n, dtype=np.int64) * 100_000, np.zeros((n, 1)))
    with (
        Listener(stall=2.0) as listener,
        Replay(write_bag(recording, tmp_path / "long.mcap"), rate=1000, block=1, wait_for=1) as replay,
    ):
        status, output, errors = replay.end()
        assert status == 0
        assert all("waiting for /listener" in line for line in errors.splitlines())
        assert output.startswith(f"finished: {n} samples sent in {n} messages")
        wait_until(lambda: len(listener.messages) >= n)
        assert listener.numbers() == [(0, number) for number in range(n)]


@pytest.mark.parametrize(
    "parameters, message",
    [
        ({}, "parameter bag is not set: give a recording, --ros-args -p bag:=PATH"),
        ({"bag": "no/such.mcap"}, "no/such.mcap"),
        ({"bag": "BAG", "rate": 0}, "parameter rate must be a number from 0.001 to 1000, got 0 (times real time"),
        ({"bag": "BAG", "rate": 5000.0}, "parameter rate must be a number from 0.001 to 1000, got 5000.0 ("),
        ({"bag": "BAG", "rate": "fast"}, "parameter rate must be a number from 0.001 to 1000, got 'fast' ("),
        ({"bag": "BAG", "block": -1}, "parameter block must be a whole number from 0 to 10000, got -1 ("),
        ({"bag": "BAG", "block": 1.5}, "parameter block must be a whole number from 0 to 10000, got 1.5 ("),
        ({"bag": 7}, "parameter bag must be a text, got 7 ("),
        ({"bag": "BAG", "loop": "maybe"}, "parameter loop must be true or false, got 'maybe' ("),
    ],
)
def test_what_is_wrong_is_said_in_one_line(bag, node_ended, parameters, message):
    parameters = {name: bag if value == "BAG" else value for name, value in parameters.items()}
    status, output, errors = node_ended(main, *as_arguments(**parameters))
    assert (status, output) == (1, "")
    assert errors.startswith(f"error: {message}") and errors.count("\n") == 1
