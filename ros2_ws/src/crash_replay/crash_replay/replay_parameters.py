"""The parameters of `replay`, with what they mean and may be."""

import math
from difflib import get_close_matches
from typing import Any, NamedTuple

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node

from .fault import Fault
from .player import HIGHEST_RATE, LOWEST_RATE
from .selection import Window

KIND = {str: "a text", bool: "true or false", int: "a whole number", float: "a number", list: "a list of names"}
ON_A_TERMINAL = ("auto", "true", "false")
OF_EVERY_NODE = ("use_sim_time", "start_type_description_service", "qos_overrides")
LIVE = ("rate", "loop", "from", "until")
"""Those that may be set at any time."""


class ParameterError(Fault):
    """A parameter is missing or not what it must be; the message is one readable line."""


class Allowed(NamedTuple):
    default: Any
    meaning: str
    lowest: float | None = None
    highest: float | None = None
    choices: tuple[str, ...] = ()


PARAMETERS = {
    "bag": Allowed("", "the recording: a rosbag2 folder or one .mcap file"),
    "rate": Allowed(1.0, "times real time; may be set at any time", LOWEST_RATE, HIGHEST_RATE),
    "start_offset": Allowed(0.0, "s after the first sample at which to begin", 0.0, 1e6),
    "duration": Allowed(0.0, "s to play from there; 0: to the end", 0.0, 1e6),
    "from": Allowed(-math.inf, "s since the impact, A of an A-B window; may be set at any time"),
    "until": Allowed(math.inf, "s since the impact, B of an A-B window; may be set at any time"),
    "loop": Allowed(False, "start again after the last sample, as a new run; may be set at any time"),
    "channels": Allowed([""], "names of the channels to replay, or patterns such as rib_*; none: all"),
    "exclude": Allowed([""], "names or patterns of channels to leave out"),
    "delay": Allowed(0.0, "s to wait before the first sample, once the subscribers are there", 0.0, 3600.0),
    "start_paused": Allowed(False, "wait for resume, step or burst before the first sample"),
    "keep_alive": Allowed(False, "stay after the last sample, for seek, step and resume"),
    "lockstep": Allowed(False, "send the next samples when all nodes that publish answers have answered the last"),
    "answer_timeout": Allowed(10.0, "s after which lock-step goes on without a node that is silent", 0.1, 3600.0),
    "block": Allowed(0, "samples in a message; 0: one, or more where single messages cannot carry them", 0, 10_000),
    "wait_for": Allowed(0, "subscribers on samples to wait for; 0: those found within half a second", 0, 1000),
    "listeners": Allowed([""], "names of nodes to wait for, until each says that it is ready"),
    "wait_timeout": Allowed(10.0, "s to wait for them; then the replay ends with exit status 1", 0.0, 3600.0),
    "finish_timeout": Allowed(300.0, "s after the last sample for nodes that take part to get what they lack", 0.0, 1e5),
    "clock": Allowed(True, "publish /clock with each message on samples"),
    "progress": Allowed("auto", "keep a progress line; auto: on a terminal", choices=ON_A_TERMINAL),
    "keyboard": Allowed("auto", "take keys, h lists them; auto: on a terminal", choices=ON_A_TERMINAL),
}


def declare_parameters(node: Node) -> dict[str, Any]:
    """Declare all of them and give their values; only those in LIVE can be set later.

    The node must have declared its overrides by itself, untyped: so what is wrong with one is said in our words.
    """
    given = {name: parameter.value for name, parameter in node.get_parameters_by_prefix("").items()}
    for name in given:
        if name not in PARAMETERS and name.split(".")[0] not in OF_EVERY_NODE:
            near = get_close_matches(name, PARAMETERS, n=1) or [", ".join(PARAMETERS)]
            node.get_logger().warning(f"there is no parameter {name}: did you mean {near[0]}?")
    values = {name: checked(name, given.get(name, allowed.default)) for name, allowed in PARAMETERS.items()}
    if not values["bag"]:
        raise ParameterError("parameter bag is not set: give a recording, --ros-args -p bag:=PATH")
    for name, value in values.items():
        if name in given:
            node.undeclare_parameter(name)
        node.declare_parameter(name, value, _descriptor(name), ignore_override=True)
    return values


def checked(name: str, value: Any) -> Any:
    """The value of a parameter, a float where it is a number; ParameterError where it is not what it must be."""
    default, meaning, lowest, highest, choices = PARAMETERS[name]
    kind = type(default)
    if choices and isinstance(value, bool):  # as true and false are written in YAML
        value = str(value).lower()
    if kind is list and isinstance(value, str):
        value = [value]
    if kind is float:
        fits = isinstance(value, int | float) and not isinstance(value, bool) and not math.isnan(value)
    else:
        fits = type(value) is kind and (kind is not list or all(isinstance(part, str) for part in value))
    if not fits or (lowest is not None and not lowest <= value <= highest) or (choices and value not in choices):
        expected = ", ".join(choices) or KIND[kind] + ("" if lowest is None else f" from {lowest:g} to {highest:g}")
        raise ParameterError(f"parameter {name} must be {expected}, got {value!r} ({meaning})")
    return kind(value) if kind is not list else value or default  # ROS knows no type of an empty list


def names_in(value: list[str]) -> list[str]:
    """The names of a parameter that is a list of them, which has an empty one where it has none."""
    return [name for name in value if name]


def window_of(values: dict[str, Any]) -> Window:
    return Window(values["start_offset"], values["duration"], values["from"], values["until"])


def _descriptor(name: str) -> ParameterDescriptor:
    allowed = PARAMETERS[name]
    descriptor = ParameterDescriptor(description=allowed.meaning, read_only=name not in LIVE)
    if isinstance(allowed.default, float):
        descriptor.dynamic_typing = True  # an integer is a number too
        if allowed.lowest is not None:
            descriptor.floating_point_range = [FloatingPointRange(from_value=allowed.lowest, to_value=allowed.highest)]
    elif allowed.lowest is not None:
        descriptor.integer_range = [IntegerRange(from_value=allowed.lowest, to_value=allowed.highest, step=1)]
    return descriptor
