"""The parameters of `replay`, with what they mean and may be."""

from difflib import get_close_matches
from typing import Any, NamedTuple

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node

from .player import HIGHEST_RATE, LOWEST_RATE

KIND = {str: "a text", bool: "true or false", int: "a whole number", float: "a number"}
OF_EVERY_NODE = ("use_sim_time", "start_type_description_service", "qos_overrides")


class ParameterError(ValueError):
    """A parameter is missing or not what it must be; the message is one readable line."""


class Allowed(NamedTuple):
    default: Any
    meaning: str
    lowest: float | None = None
    highest: float | None = None


PARAMETERS = {
    "bag": Allowed("", "the recording: a rosbag2 folder or one .mcap file"),
    "rate": Allowed(1.0, "times real time; may be set at any time", LOWEST_RATE, HIGHEST_RATE),
    "block": Allowed(0, "samples in a message; 0: one, or more where single messages cannot carry them", 0, 10_000),
    "wait_for": Allowed(0, "subscribers on samples to wait for; 0: those found within half a second", 0, 1000),
    "wait_timeout": Allowed(10.0, "s to wait for them; then the replay ends with exit status 1", 0.0, 3600.0),
    "loop": Allowed(False, "start again after the last sample, as a new run"),
    "start_paused": Allowed(False, "wait for resume, step or burst before the first sample"),
    "clock": Allowed(True, "publish /clock with each message on samples"),
    "keep_alive": Allowed(False, "stay after the last sample, for seek, step and resume"),
}


def declare_parameters(node: Node) -> dict[str, Any]:
    """Declare all of them and give their values; only `rate` can be set later.

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
    default, meaning, lowest, highest = PARAMETERS[name]
    kind = type(default)
    fits = isinstance(value, int | float) and not isinstance(value, bool) if kind is float else type(value) is kind
    if not fits or (lowest is not None and not lowest <= value <= highest):
        within = "" if lowest is None else f" from {lowest:g} to {highest:g}"
        raise ParameterError(f"parameter {name} must be {KIND[kind]}{within}, got {value!r} ({meaning})")
    return kind(value)


def _descriptor(name: str) -> ParameterDescriptor:
    allowed = PARAMETERS[name]
    descriptor = ParameterDescriptor(description=allowed.meaning, read_only=name != "rate")
    if isinstance(allowed.default, float):
        descriptor.floating_point_range = [FloatingPointRange(from_value=allowed.lowest, to_value=allowed.highest)]
        descriptor.dynamic_typing = True  # an integer is a number too
    elif allowed.lowest is not None:
        descriptor.integer_range = [IntegerRange(from_value=allowed.lowest, to_value=allowed.highest, step=1)]
    return descriptor
