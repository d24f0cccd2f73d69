"""What live.launch.py takes from launch and launch_ros, which do not come as wheels: the same words, standing in."""

import json
import runpy
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any


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


class DeclareLaunchArgument:
    def __init__(self, name, *, default_value=None, description=None):
        self.name, self.default_value, self.description = name, default_value, description


class OpaqueFunction:
    def __init__(self, *, function):
        self.function = function


class Node:
    def __init__(self, *, package, executable, name=None, namespace=None, output=None, arguments=(), ros_arguments=()):
        self.package, self.executable, self.name, self.namespace = package, executable, name, namespace
        self.arguments, self.ros_arguments = list(arguments), list(ros_arguments)

    def parameters(self) -> dict[str, Any]:
        """What is set by `-p`."""
        words = [word for option, word in zip(self.ros_arguments, self.ros_arguments[1:]) if option == "-p"]
        return {name: json.loads(value) for name, value in (word.split(":=", 1) for word in words)}

    def words(self) -> list[str]:
        """Of its command, behind the executable."""
        names = {"__node": self.name, "__ns": self.namespace and f"/{self.namespace.strip('/')}"}
        remapped = [word for key, value in names.items() if value for word in ("-r", f"{key}:={value}")]
        return [*self.arguments, "--ros-args", *self.ros_arguments, *remapped]


MODULES: dict[str, dict[str, Any]] = {
    "launch": {"LaunchDescription": list, "LaunchContext": LaunchContext},
    "launch.actions": {
        one.__name__: one for one in (DeclareLaunchArgument, EmitEvent, OpaqueFunction, RegisterEventHandler)
    },
    "launch.event_handlers": {"OnProcessExit": OnProcessExit},
    "launch.events": {"Shutdown": Shutdown},
    "launch.events.process": {"ProcessExited": SimpleNamespace},
    "launch_ros": {},
    "launch_ros.actions": {"Node": Node},
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


def carried_out(entities: list, context: LaunchContext) -> list:
    """The nodes and handlers that the launch's arguments ask for, in their order."""
    return [found for one in entities if isinstance(one, OpaqueFunction) for found in one.function(context)]
