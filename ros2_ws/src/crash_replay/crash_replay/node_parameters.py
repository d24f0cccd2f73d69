"""Parameters of a node from a table: what each is by default, means and may be; what is wrong is one line.

PARAMETERS = {"every": Allowed(0.002, "s of the crash between two rankings", 1e-5, 1e4, live=True)}
super().__init__("diagnosis", automatically_declare_parameters_from_overrides=True)
given = declare_parameters(self, PARAMETERS)      # {"every": 0.002}
follow_changes(self, PARAMETERS, self.change)     # self.change({"every": 0.001}) when somebody sets it
"""

import re
from collections.abc import Callable, Mapping
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any, NamedTuple

from .fault import Fault
from .limits import TEXT, shown

if TYPE_CHECKING:  # a table can be read without ROS
    from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
    from rclpy.node import Node
    from rclpy.parameter import Parameter

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
    live: bool = False  # whether it may be set while the node runs; any other is read-only


def given_to(node: "Node") -> dict[str, Any]:
    """What a node was started with.

    It must have declared its overrides by itself, untyped: so what is wrong with one is said in our words.
    """
    given: Mapping[str, Any] = node.get_parameters_by_prefix("")
    return {name: parameter.value for name, parameter in given.items()}


def declare_parameters(node: "Node", table: Mapping[str, Allowed]) -> dict[str, Any]:
    """Declare all of them and give their values. Raises ParameterError, also where one is given that there is not."""
    given = given_to(node)
    for name in given:
        if name not in table and name.split(".")[0] not in OF_EVERY_NODE:
            near = get_close_matches(name, table, n=1)
            hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(table)}"
            raise ParameterError(f"there is no parameter {name}: {hint}")
    values = {name: checked(table, name, given.get(name, allowed.default)) for name, allowed in table.items()}
    for name, allowed in table.items():
        if allowed.needed and not values[name]:
            raise ParameterError(f"parameter {name} is not set: {allowed.needed}")
    for name, value in values.items():
        if name in given:
            node.undeclare_parameter(name)
        node.declare_parameter(name, value, _descriptor(table[name]), ignore_override=True)
    return values


def follow_changes(node: "Node", table: Mapping[str, Allowed], change: Callable[[dict[str, Any]], None]) -> None:
    """change: is given those that somebody sets while the node runs, all or none; a Fault from it refuses them."""
    from rcl_interfaces.msg import SetParametersResult

    def follow(parameters: "list[Parameter]") -> "SetParametersResult":
        try:
            new = {p.name: checked(table, p.name, p.value) for p in parameters if p.name in table}
            if new:
                change(new)
        except Fault as fault:
            return SetParametersResult(successful=False, reason=" ".join(str(fault).split()))
        return SetParametersResult(successful=True)

    node.add_on_set_parameters_callback(follow)


def checked(table: Mapping[str, Allowed], name: str, value: Any) -> Any:
    """The value of a parameter, a float where it is a number; ParameterError where it is not what it must be."""
    allowed = table[name]
    kind = type(allowed.default)
    if allowed.choices and isinstance(value, bool):  # as true and false are written in YAML
        value = str(value).lower()
    if kind is list and isinstance(value, str):
        value = [value]
    if allowed.pattern and isinstance(value, int | float) and not isinstance(value, bool):
        value = f"{value:g}"  # a text that looks like a number is one in YAML
    if not (_fits(kind, value) and _within(allowed, value)):
        raise ParameterError(f"parameter {name} must be {expected(allowed)}, got {shown(value)} ({allowed.meaning})")
    return kind(value) if kind is not list else list(value) or allowed.default  # ROS knows no type of an empty list


def _fits(kind: type, value: Any) -> bool:
    """Whether it is of the kind, and a number one (which NaN is not), a text one line."""
    if kind is float:
        return isinstance(value, int | float) and not isinstance(value, bool) and value == value
    if kind is list:
        return isinstance(value, list) and all(_fits(str, part) for part in value)
    if kind is str:
        return isinstance(value, str) and value.isprintable() and len(value) <= TEXT.highest
    return type(value) is kind


def _within(allowed: Allowed, value: Any) -> bool:
    if allowed.choices:
        return value in allowed.choices
    if allowed.pattern:
        texts = value if isinstance(value, list) else [value]
        return all(not text or re.fullmatch(allowed.pattern, text) for text in texts)
    return allowed.lowest is None or allowed.lowest <= value <= allowed.highest


def expected(allowed: Allowed) -> str:
    """What a parameter may be, in words."""
    if allowed.choices:
        return ", ".join(allowed.choices)
    kind = KIND[type(allowed.default)]
    if allowed.pattern:
        return f"{kind} of the right form"
    return kind if allowed.lowest is None else f"{kind} from {allowed.lowest:g} to {allowed.highest:g}"


def names_in(value: list[str]) -> list[str]:
    """The names of a parameter that is a list of them, which has an empty one where it has none."""
    return [name for name in value if name]


def _descriptor(allowed: Allowed) -> "ParameterDescriptor":
    from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor

    one_of = f"one of {', '.join(allowed.choices)}" if allowed.choices else ""
    descriptor = ParameterDescriptor(
        description=allowed.meaning, read_only=not allowed.live, additional_constraints=one_of or allowed.pattern
    )
    # an integer is a number too, and a text may look like one
    descriptor.dynamic_typing = isinstance(allowed.default, float) or bool(allowed.pattern)
    if isinstance(allowed.default, float):
        if allowed.lowest is not None:
            descriptor.floating_point_range = [FloatingPointRange(from_value=allowed.lowest, to_value=allowed.highest)]
    elif allowed.lowest is not None:
        descriptor.integer_range = [IntegerRange(from_value=allowed.lowest, to_value=allowed.highest, step=1)]
    return descriptor
