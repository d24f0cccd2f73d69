"""Estimators follow a real replay back, ahead and round; who joins late or comes back from the dead misses nothing."""

import numpy as np
import pytest
from crash_msgs.msg import ReplayState
from crash_msgs.srv import Burst, GetEstimates, Seek, SetRate, Step
from helpers_estimator_node import joined
from helpers_paths import BAGS
from numpy.testing import assert_array_equal
from std_srvs.srv import Trigger

from crash_estimator.core.fold import run
from crash_estimator.core.methods import make_estimator
from crash_estimator.model_file import load_model
from crash_replay.bag import read_bag
from crash_replay.qos import LATCHED
from crash_replay.ros_messages import stamp_ns

BAG = BAGS / "frontal_engine_cab.mcap"
MODEL = "frontal_engine_cab"
METHODS = ("mrls", "gauss_newton")  # one compiled, one not


@pytest.fixture(scope="module")
def recording():
    return read_bag(BAG)


@pytest.fixture(scope="module")
def whole(recording):
    """Method -> parameters after every sample, as the one loop gives them."""
    model = load_model(MODEL)
    estimators = {method: make_estimator(model, recording.test, method) for method in METHODS}
    return {name: np.array([e.parameters for e in run(one, recording.samples())]) for name, one in estimators.items()}


def numbers(messages) -> list[int]:
    return [message.number + k for message in messages for k in range(len(message.time_ns))]


def listeners(stage) -> set[bytes]:
    """Who subscribes to the samples; the dead are there for a while."""
    return {bytes(info.endpoint_gid) for info in stage.node.get_subscriptions_info_by_topic("samples")}


def assert_exact(messages, whole) -> None:
    p = whole.shape[1]
    assert_array_equal(joined(messages, "value")[:, :p], whole[numbers(messages)])


def test_back_ahead_round_and_late(stage, recording, whole):
    """One replay, paused and told what to do; at every sample the parameters are those of the whole loop."""
    n = len(recording)
    for method in METHODS:
        stage.add_estimator(method, model=MODEL, method=method)
    stage.replay(BAG, wait_for=2, start_paused=True, keep_alive=True)
    stage.wait_until_found(2)
    expected = []

    def burst(start, count):
        assert stage.call(Burst, "replay/burst", n=count).sent == count
        expected.extend(range(start, start + count))

    def seek(number):
        time = float(recording.time_ns[number]) * 1e-9
        assert stage.call(Seek, "replay/seek", time=time).number == number

    burst(0, 100)
    assert stage.call(Step, "replay/step", n=-70).number == 30  # back
    burst(30, 40)
    seek(n - 150)  # ahead, over samples that were never sent
    burst(n - 150, 50)
    seek(0)  # round
    burst(0, 20)
    seek(90)  # ahead, over samples that were
    burst(90, 30)
    for method in METHODS:
        heard = stage.wait_for(method, len(expected))
        assert numbers(heard["parameters"]) == expected
        assert_exact(heard["parameters"], whole[method])
        lost = [event for event in heard["events"] if event.kind == "lost"]
        text = f"{n - 250} samples before number {n - 150} were not seen: the replay has sent them again"
        assert [(event.number, event.value, event.text) for event in lost] == [(n - 150, n - 250, text)]
        state = heard["state"][-1]
        assert (state.number, state.run, state.holds_from, state.missed) == (90, 4, 0, 0)
        assert state.asked_again == n - 250
        assert stamp_ns(state.header.stamp) == stamp_ns(heard["parameters"][-30].header.stamp)

    node = stage.add_estimator("late", model=MODEL, method="mrls")
    stage.wait_until_found(3)
    stage.spin_until(lambda: node.follower, "it knows the test")  # samples that overtake it are asked for later
    burst(120, 30)
    late = stage.wait_for("late", 30 + 1)  # what the pass had before it came is in one message
    assert numbers(late["parameters"]) == list(range(90, 150))
    assert_exact(late["parameters"], whole["mrls"])
    lost = [event.text for event in late["events"] if event.kind == "lost"]
    assert lost == ["120 samples before number 120 were not seen: the replay has sent them again"]
    assert [(s.number, s.holds_from, s.asked_again) for s in late["state"]] == [(120, 0, 120)]


@pytest.mark.parametrize("lockstep", [False, True])
def test_killed_and_started_again_it_goes_on_as_if_nothing_had_been(stage, recording, whole, lockstep):
    """In lock-step the replay does not wait for the dead for ever either.

    The replay goes on without it for 200 samples, pauses while it starts, and does the rest with it.
    """
    stage.add_estimator("witness", model=MODEL, method="mrls")
    witness, victim = stage.heard["witness"], stage.listen("victim")
    process = stage.start("crash_estimator.nodes.estimator_node", "victim", model=MODEL, method="mrls")
    going = {"rate": 0.02, "lockstep": lockstep, "answer_timeout": 1.0}
    stage.replay(BAG, wait_for=2, wait_timeout=100.0, start_paused=True, keep_alive=True, **going)
    stage.wait_until_found(2)
    assert stage.call(Trigger, "replay/resume").success
    stage.spin_until(lambda: len(victim["parameters"]) > 100, "the victim has begun")
    process.kill()
    process.wait()
    there = listeners(stage)
    gone_on = lambda: len(witness["parameters"]) > len(victim["parameters"]) + 200  # noqa: E731
    stage.spin_until(gone_on, "the replay has gone on without it")
    assert stage.call(Trigger, "replay/pause").success
    before = len(victim["parameters"])
    stage.start("crash_estimator.nodes.estimator_node", "victim", model=MODEL, method="mrls")
    stage.spin_until(lambda: listeners(stage) - there, "the victim is back")
    assert stage.call(SetRate, "replay/set_rate", rate=0.2).success
    assert stage.call(Trigger, "replay/resume").success
    for name in ("witness", "victim"):
        last = lambda name=name: numbers(stage.heard[name]["parameters"][-1:]) == [len(recording) - 1]  # noqa: E731
        stage.spin_until(last, f"{name} has come to the last sample")
    stage.wait_for("witness", len(recording))
    assert numbers(witness["parameters"]) == list(range(len(recording)))
    assert not [event for event in witness["events"] if event.kind == "lost"]
    assert_exact(witness["parameters"], whole["mrls"])
    again = victim["parameters"][before:]
    first = again[0].number  # what was said before this node was found can be had again
    assert numbers(again) == list(range(first, len(recording)))
    assert_exact(victim["parameters"], whole["mrls"])
    while first:
        start = max(0, first - 150)
        answer = stage.call(GetEstimates, "victim/get_estimates", start=start, stop=first)
        assert answer.success and numbers([answer.parameters]) == list(range(start, first))
        assert_exact([answer.parameters], whole["mrls"])
        first = start
    state = victim["state"][-1]  # latched: known to those who have found the new one late
    assert before + 200 <= state.number and state.asked_again == state.number
    assert (state.holds_from, state.missed) == (0, 0)


def test_a_replay_of_another_name_is_asked_by_its_own(stage, recording, whole):
    """It says of itself who it is; nobody has to be told."""
    stage.node.create_subscription(ReplayState, "replay_state", stage.replayed.append, LATCHED)
    stage.start("crash_replay.replay_node", "player", bag=BAG, block=100, rate=1000.0, keep_alive=True)
    finished = lambda: stage.replayed and stage.replayed[-1].state == ReplayState.FINISHED  # noqa: E731
    stage.spin_until(finished, "the replay is over")
    stage.add_estimator("late", model=MODEL, method="mrls")
    said = lambda: stage.heard["late"]["parameters"]  # noqa: E731
    stage.spin_until(lambda: said() and numbers(said())[-1] == len(recording) - 1, "it has asked for all of it")
    again = stage.call(GetEstimates, "late/get_estimates", start=0, stop=100)
    assert again.success
    assert_exact([again.parameters], whole["mrls"])
    assert_exact(said(), whole["mrls"])


def test_several_recordings_in_turn_are_each_estimated_from_the_start(stage, recording, whole):
    stage.add_estimator("mrls", model=MODEL, method="mrls")
    stage.start("crash_replay.replay_node", bag=BAG, then=f"[{BAG}]", rate=2.0, listeners="[mrls]", wait_timeout=100.0)
    said = stage.heard["mrls"]["parameters"]
    twice = list(range(len(recording))) * 2
    stage.spin_until(lambda: len(numbers(said)) == len(twice), "both are estimated")
    assert numbers(said) == twice
    assert_exact(said, whole["mrls"])
