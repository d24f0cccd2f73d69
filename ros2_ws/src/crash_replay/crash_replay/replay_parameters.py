"""The parameters of `replay`, with what they mean and may be."""

import math
from typing import Any

from .node_parameters import Allowed
from .player import HIGHEST_RATE, LOWEST_RATE
from .selection import Window

ON_A_TERMINAL = ("auto", "true", "false")

PARAMETERS = {
    "bag": Allowed(
        "",
        "the recording: a bag, a CSV with its YAML, an NHTSA EV5 or UDS or an ISO-MME folder, nhtsa:NUMBER",
        needed="give a recording, --ros-args -p bag:=PATH",
    ),
    "then": Allowed([""], "recordings to replay after it, one by one, each as a test of its own"),
    "rate": Allowed(1.0, "times real time", LOWEST_RATE, HIGHEST_RATE, live=True),
    "start_offset": Allowed(0.0, "s after the first sample at which to begin", 0.0, 1e6),
    "duration": Allowed(0.0, "s to play from there; 0: to the end", 0.0, 1e6),
    "from": Allowed(-math.inf, "s since the impact, A of an A-B window", live=True),
    "until": Allowed(math.inf, "s since the impact, B of an A-B window", live=True),
    "loop": Allowed(False, "start again after the last sample, as a new run", live=True),
    "channels": Allowed([""], "names of the channels to replay, or patterns such as rib_*; none: all"),
    "exclude": Allowed([""], "names or patterns of channels to leave out"),
    "regex": Allowed("", "regular expression: channels in whose name it is found are replayed, too"),
    "exclude_regex": Allowed("", "regular expression of channels to leave out"),
    "delay": Allowed(0.0, "s to wait before the first sample, once the subscribers are there", 0.0, 3600.0),
    "start_paused": Allowed(False, "wait for resume, step or burst before the first sample"),
    "keep_alive": Allowed(False, "stay after the last sample, for seek, step and resume"),
    "lockstep": Allowed(False, "send the next samples when all nodes that publish answers have answered the last"),
    "answer_timeout": Allowed(10.0, "s after which lock-step goes on without a node that is silent", 0.1, 3600.0),
    "block": Allowed(0, "samples in a message; 0: one, or more where single messages cannot carry them", 0, 10_000),
    "wait_for": Allowed(0, "subscribers on samples to wait for; 0: those found within half a second", 0, 1000),
    "listeners": Allowed([""], "names of nodes to wait for, until each says that it is ready"),
    "wait_timeout": Allowed(10.0, "s to wait for them; then the replay ends with exit status 1", 0.0, 3600.0),
    "finish_timeout": Allowed(
        300.0, "s after the last sample for nodes that take part to get what they lack", 0.0, 1e5
    ),
    "clock": Allowed(
        "auto", "publish /clock; auto: outside a namespace, where nobody else does", choices=("auto", "true", "false")
    ),
    "rosbag2_services": Allowed(False, "serve rosbag2_player/pause and so on, with rosbag2_interfaces' types, too"),
    "progress": Allowed("auto", "keep a progress line; auto: on a terminal", choices=ON_A_TERMINAL),
    "keyboard": Allowed("auto", "take keys, h lists them; auto: on a terminal", choices=ON_A_TERMINAL),
}


def window_of(values: dict[str, Any]) -> Window:
    return Window(values["start_offset"], values["duration"], values["from"], values["until"])
