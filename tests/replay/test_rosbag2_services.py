"""What rosbag2's player offers as services: under its names beside the replay's own, and with its own types."""

import importlib.util
from types import SimpleNamespace

import pytest
from crash_msgs.srv import Burst
from helpers_replay import LOOK, Replay, some_recording, wait_until
from helpers_service import ask
from std_srvs.srv import Trigger

from crash_replay.bag import time_zero_ns
from crash_replay.pacing import Pacing
from crash_replay.player import Mode, Player
from crash_replay.ros_messages import stamp
from crash_replay.rosbag2_services import Services, as_its_types

RECORDING = some_recording()  # 40 samples, the impact at number 10
ITS_TYPES = importlib.util.find_spec("rosbag2_interfaces") is not None


def test_its_names_beside_ours(bag, listener):
    def call(name):
        answer = listener.call(Trigger, name)
        return answer.success, answer.message

    with Replay(bag, start_paused=True, keep_alive=True, wait_for=1) as replay:
        wait_until(lambda: listener.states and listener.states[-1].state == listener.states[-1].PAUSED)
        assert call("is_paused") == (True, "paused") and call("get_rate") == (True, "1")
        assert call("play_next") == (True, "1 samples sent, the next is sample 1")
        assert call("toggle_paused") == (True, "playing, the next is sample 1")
        wait_until(lambda: listener.states[-1].state == listener.states[-1].FINISHED)
        assert call("play_next") == (False, "no sample is left: sample 39 was the last; go back, seek or resume first")
        assert listener.numbers() == [(0, number) for number in range(40)]
        assert call("stop") == (True, "stopped before sample 40")
        status, output, _ = replay.end()
    assert status == 0 and output.startswith("finished: 40 samples sent")


def test_while_it_plays_there_is_no_next_and_stop_ends_it(bag, listener):
    with Replay(bag, rate=0.001, wait_for=1) as replay:  # a sample a second
        wait_until(lambda: listener.messages)
        assert not listener.call(Trigger, "is_paused").success
        assert listener.call(Trigger, "play_next").message == "it plays: pause it first"
        assert listener.call(Trigger, "stop").success
        status, output, _ = replay.end()
    assert status == 0 and "stopped before sample" in output


def test_a_burst_of_none_is_all_that_are_left(bag, listener):
    with Replay(bag, start_paused=True, wait_for=1) as replay:
        assert listener.call(Burst, "burst", n=3).sent == 3
        assert listener.call(Burst, "burst", n=0).sent == 37
        assert replay.end()[0] == 0


class Outlet:
    audience = None


@pytest.fixture
def served():
    """Kind of rosbag2_interfaces, request -> response, of a replay that sends nothing; and its pacing."""
    pacing = Pacing(RECORDING, Player(RECORDING.time_ns), Outlet())
    pacing.send_at_once = lambda command, n: (pacing.command(command, n) or "", pacing.player.pending)
    rates = lambda given: pacing.command(Player.set_rate, given["rate"]) or "" if given["rate"] > 0 else "no"  # noqa: E731
    said = []
    node = SimpleNamespace(
        pacing=pacing, set=rates, topics=SimpleNamespace(time_zero=time_zero_ns(RECORDING)),
        get_logger=lambda: SimpleNamespace(warning=said.append),
    )  # fmt: skip
    serve = as_its_types(Services(node))
    return lambda kind, **request: serve[kind](SimpleNamespace(**request), SimpleNamespace()), pacing, said


def test_with_its_types_it_does_as_rosbag2_does(served):
    call, pacing, said = served
    assert call("IsPaused").paused is True
    call("Resume")
    assert pacing.player.mode == Mode.PLAYING and call("IsPaused").paused is False
    assert call("PlayNext").success is False
    call("TogglePaused")
    assert pacing.player.mode == Mode.PAUSED
    call("Resume")
    call("Pause")
    assert pacing.player.mode == Mode.PAUSED
    assert call("SetRate", rate=0.25).success is True and call("GetRate").rate == 0.25
    assert call("SetRate", rate=-1.0).success is False
    assert call("Seek", time=stamp(time_zero_ns(RECORDING))).success is True and pacing.player.next == 10
    assert call("Seek", time=stamp(0)).success is False and "time must be between" in said[0]
    assert call("PlayNext").success is True and pacing.player.pending == 1
    assert call("Burst", num_messages=0).actually_burst == 30
    call("Stop")
    assert pacing.stopped


@pytest.mark.skipif(not ITS_TYPES, reason="rosbag2_interfaces is not installed: the wheels have none")
def test_its_types_on_the_graph(bag, listener):
    from rosbag2_interfaces import srv

    def call(kind, name, **request):
        return ask(listener.node, kind, f"/sled_a/rosbag2_player/{name}", LOOK, **request)

    with Replay(bag, ["__ns:=/sled_a"], start_paused=True, rosbag2_services=True) as replay:
        assert call(srv.IsPaused, "is_paused").paused
        assert call(srv.Burst, "burst", num_messages=5).actually_burst == 5
        assert call(srv.PlayNext, "play_next").success
        assert call(srv.Seek, "seek", time=stamp(time_zero_ns(RECORDING))).success
        assert call(srv.SetRate, "set_rate", rate=0.01).success and call(srv.GetRate, "get_rate").rate == 0.01
        call(srv.Resume, "resume")
        assert not call(srv.IsPaused, "is_paused").paused
        call(srv.TogglePaused, "toggle_paused")
        call(srv.Pause, "pause")
        call(srv.Stop, "stop")
        status, output, _ = replay.end()
    assert status == 0 and "stopped before sample" in output


@pytest.mark.skipif(ITS_TYPES, reason="rosbag2_interfaces is installed")
def test_without_its_types_it_says_what_to_do(bag):
    with Replay(bag, rosbag2_services=True) as replay:
        status, _, errors = replay.end()
    assert (status, errors) == (
        1,
        "error: parameter rosbag2_services: there is no package rosbag2_interfaces: install it, or call the replay's "
        "own services\n",
    )
