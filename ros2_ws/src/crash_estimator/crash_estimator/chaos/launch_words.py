"""What live.launch.py takes from launch and launch_ros, which do not come as wheels: the same words, standing in for
them.

A value that is only known when it is launched is asked with `value(given)`, the launch's arguments by name.
"""

import runpy
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, get_origin

from ruamel.yaml import YAML

TRUTHS = {"true": True, "1": True, "false": False, "0": False}


class LaunchConfiguration:
    def __init__(self, name: str):
        self.name = name

    def value(self, given):
        return given[self.name]


class PythonExpression:
    def __init__(self, parts):
        self.parts = parts

    def value(self, given):
        return str(eval("".join(part if isinstance(part, str) else part.value(given) for part in self.parts)))


class LaunchContext:
    def __init__(self, given, is_shutdown=False):
        self.launch_configurations, self.is_shutdown = given, is_shutdown


class OnProcessExit:
    def __init__(self, *, target_action, on_exit):
        self.target_action, self.on_exit = target_action, on_exit


class RegisterEventHandler:
    def __init__(self, event_handler):
        self.event_handler = event_handler


class Shutdown:
    def __init__(self, *, reason):
        self.reason = reason


class EmitEvent:
    def __init__(self, *, event):
        self.event = event


class ParameterValue:
    def __init__(self, value, *, value_type):
        self.of, self.value_type = value, value_type

    def value(self, given):
        value = self.of.value(given)
        if get_origin(self.value_type) is list:
            value = YAML(typ="safe").load(value)
            assert isinstance(value, list) and all(isinstance(one, str) for one in value)
            return value
        return value.lower() == "true" if self.value_type is bool else self.value_type(value)


class IfCondition:
    def __init__(self, predicate):
        self.predicate = predicate

    def holds(self, given):
        return TRUTHS[self.predicate.value(given).lower()]


class DeclareLaunchArgument:
    def __init__(self, name, *, default_value=None, description=None):
        self.name, self.default_value, self.description = name, default_value, description


class Node:
    def __init__(self, *, package, executable, output=None, parameters=(), condition=None):
        self.package, self.executable, self.parameters, self.condition = package, executable, parameters, condition

    def values(self, given) -> dict[str, Any]:
        return {
            name: value.value(given) if hasattr(value, "value") else value
            for parameters in self.parameters
            for name, value in parameters.items()
        }


MODULES = {
    "launch": {"LaunchDescription": list, "LaunchContext": LaunchContext},
    "launch.actions": {one.__name__: one for one in (DeclareLaunchArgument, EmitEvent, RegisterEventHandler)},
    "launch.conditions": {"IfCondition": IfCondition},
    "launch.event_handlers": {"OnProcessExit": OnProcessExit},
    "launch.events": {"Shutdown": Shutdown},
    "launch.events.process": {"ProcessExited": SimpleNamespace},
    "launch.substitutions": {one.__name__: one for one in (LaunchConfiguration, PythonExpression)},
    "launch_ros": {},
    "launch_ros.actions": {"Node": Node},
    "launch_ros.parameter_descriptions": {"ParameterValue": ParameterValue},
}


@contextmanager
def _standing_in() -> Iterator[None]:
    before = {name: sys.modules.get(name) for name in MODULES}
    for name, contents in MODULES.items():
        sys.modules[name] = ModuleType(name)
        vars(sys.modules[name]).update(contents)
    try:
        yield
    finally:
        for name, module in before.items():
            if module is None:
                del sys.modules[name]
            else:
                sys.modules[name] = module


def described(launch_file: Path) -> list:
    """What a launch file describes."""
    with _standing_in():
        describe: Callable[[], list] = runpy.run_path(str(launch_file))["generate_launch_description"]
        return describe()


def arguments_of(entities: list) -> dict[str, str | None]:
    """The launch's arguments and their defaults."""
    return {one.name: one.default_value for one in entities if isinstance(one, DeclareLaunchArgument)}


def started(entities: list, given: dict[str, str]) -> list[Node]:
    """The nodes that these arguments ask for."""
    nodes = [one for one in entities if isinstance(one, Node)]
    return [node for node in nodes if node.condition is None or node.condition.holds(given)]
