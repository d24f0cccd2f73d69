"""Parameters of a node from a table: what each is by default, means and may be; what is wrong is one line.

PARAMETERS = {"every": Allowed(0.002, "s of the crash between two rankings", 1e-5, 1e4)}
super().__init__("diagnosis", automatically_declare_parameters_from_overrides=True)
given = declare_parameters(self, PARAMETERS)      # {"every": 0.002}
"""

import re
from collections.abc import Collection, Mapping
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any, NamedTuple

from .fault import Fault
from .limits import TEXT, shown

if TYPE_CHECKING:  # a table can be read without ROS
    from rcl_interfaces.msg import ParameterDescriptor
    from rclpy.node import Node

KIND = {str: "a text", bool: "true or false", int: "a whole number", float: "a number", list: "a list of names"}
OF_EVERY_NODE = ("use_sim_time", "start_type_description_service", "qos_overrides")
NAME = r"[/~]?[A-Za-z_]\w*(/[A-Za-z_]\w*)*"
"""What ROS takes as the name of a node or topic."""


class ParameterError(Fault):
    """A parameter is missing or not what it must be; the message is one readable line."""


class Allowed(NamedTuple):
    """The default says of what kind a parameter is."""

    default: Any
    meaning: str
    lowest: float | None = None
    highest: float | None = None
    choices: tuple[str, ...] = ()
    pattern: str = ""  # regular expression of a text, or of each of a list; the empty text is always one
    needed: str = ""  # what to do where it is empty, which it may not be


def declare_parameters(node: "Node", table: Mapping[str, Allowed], live: Collection[str] = ()) -> dict[str, Any]:
    """Declare all of them and give their values; only those in `live` can be set later.

    The node must have declared its overrides by itself, untyped: so what is wrong with one is said in our words.
    """
    given = {name: parameter.value for name, parameter in node.get_parameters_by_prefix("").items()}
    for name in given:
        if name not in table and name.split(".")[0] not in OF_EVERY_NODE:
            near = get_close_matches(name, table, n=1)
            hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(table)}"
            node.get_logger().warning(f"there is no parameter {name}: {hint}")
    values = {name: checked(table, name, given.get(name, allowed.default)) for name, allowed in table.items()}
    for name, allowed in table.items():
        if allowed.needed and not values[name]:
            raise ParameterError(f"parameter {name} is not set: {allowed.needed}")
    for name, value in values.items():
        if name in given:
            node.undeclare_parameter(name)
        node.declare_parameter(name, value, _descriptor(table[name], name in live), ignore_override=True)
    return values


def checked(table: Mapping[str, Allowed], name: str, value: Any) -> Any:
    """The value of a parameter, a float where it is a number; ParameterError where it is not what it must be."""
    allowed = table[name]
    kind = type(allowed.default)
    if allowed.choices and isinstance(value, bool):  # as true and false are written in YAML
        value = str(value).lower()
    if kind is list and isinstance(value, str):
        value = [value]
    if not (_fits(kind, value) and _within(allowed, value)):
        raise ParameterError(f"parameter {name} must be {_expected(allowed)}, got {shown(value)} ({allowed.meaning})")
    return kind(value) if kind is not list else list(value) or allowed.default  # ROS knows no type of an empty list


def _fits(kind: type, value: Any) -> bool:
    """Whether it is of the kind, and a number one (which NaN is not), a text one line."""
    if kind is float:
        return isinstance(value, int | float) and not isinstance(value, bool) and value == value
    if kind is list:
        return isinstance(value, list) and all(_fits(str, part) for part in value)
    return type(value) is kind and (kind is not str or (value.isprintable() and len(value) <= TEXT.highest))


def _within(allowed: Allowed, value: Any) -> bool:
    if allowed.choices:
        return value in allowed.choices
    if allowed.pattern:
        texts = value if isinstance(value, list) else [value]
        return all(not text or re.fullmatch(allowed.pattern, text) for text in texts)
    return allowed.lowest is None or allowed.lowest <= value <= allowed.highest


def _expected(allowed: Allowed) -> str:
    if allowed.choices:
        return ", ".join(allowed.choices)
    kind = KIND[type(allowed.default)]
    if allowed.pattern:
        return f"{kind} of the right form"
    return kind if allowed.lowest is None else f"{kind} from {allowed.lowest:g} to {allowed.highest:g}"


def names_in(value: list[str]) -> list[str]:
    """The names of a parameter that is a list of them, which has an empty one where it has none."""
    return [name for name in value if name]


def _descriptor(allowed: Allowed, live: bool) -> "ParameterDescriptor":
    from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor

    descriptor = ParameterDescriptor(description=allowed.meaning, read_only=not live)
    if isinstance(allowed.default, float):
        descriptor.dynamic_typing = True  # an integer is a number too
        if allowed.lowest is not None:
            descriptor.floating_point_range = [FloatingPointRange(from_value=allowed.lowest, to_value=allowed.highest)]
    elif allowed.lowest is not None:
        descriptor.integer_range = [IntegerRange(from_value=allowed.lowest, to_value=allowed.highest, step=1)]
    return descriptor
