"""Steps add up, and `replay_state` tells how things are now; on a replay in a process of its own."""

import numpy as np
import pytest
from crash_msgs.msg import ReplayState
from crash_msgs.srv import Burst, Step
from helpers_replay import Replay, some_recording, wait_until
from helpers_waiting import PATIENCE
from std_srvs.srv import Trigger

from crash_replay.bag import time_zero_ns
from crash_replay.ros_messages import stamp_ns

RECORDING = some_recording()  # 40 samples at 1 kHz, the impact at number 10


def test_steps_asked_for_at_once_add_up(bag, listener):
    with Replay(bag, start_paused=True, wait_for=1):
        client = listener.node.create_client(Step, "replay/step")
        assert client.wait_for_service(timeout_sec=PATIENCE)
        calls = [client.call_async(Step.Request(n=10)) for _ in range(3)]
        wait_until(lambda: all(call.done() for call in calls) and len(listener.numbers()) == 30)
        assert sorted(call.result().number for call in calls)[-1] == 30
        listener.node.destroy_client(client)


def test_the_state_tells_where_the_replay_is_and_which_rate_it_keeps_now(bag, listener):
    """Between two samples as well: at this rate they are 0.5 s apart, and the state comes every 0.1 s."""
    with Replay(bag, rate=0.002, start_paused=True, wait_for=1):
        listener.call(Burst, "burst", n=20)
        listener.call(Trigger, "resume")
        wait_until(lambda: len(listener.numbers()) >= 24)
        playing = [state for state in listener.states if state.state == ReplayState.PLAYING]
        between = [state.time for state in playing if state.number == 23]
        assert len(between) >= 3 and (np.diff(between) > 0.0).all()
        assert RECORDING.time_ns[22] * 1e-9 <= between[0] and between[-1] <= RECORDING.time_ns[23] * 1e-9
        assert playing[-1].rate_actual == pytest.approx(0.002, rel=0.2), "not what the burst came to"
        for state in playing:
            assert stamp_ns(state.header.stamp) == time_zero_ns(RECORDING) + round(state.time * 1e9)
