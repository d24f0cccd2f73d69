"""A recording replayed, estimated and shown:

ros2 launch crash_estimator live.launch.py bag:=bags/side_dummy_padded.mcap model:=side_dummy

The replay ends when all have the last sample; estimators and viewer stay until Ctrl-C, or end with the others where
exit_when_finished:=true. Where one of them fails all end, with exit status 1.
"""

import json
import re
from collections.abc import Callable, Mapping
from typing import Any

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, EmitEvent, OpaqueFunction, RegisterEventHandler
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.events.process import ProcessExited
from launch_ros.actions import Node

ARGUMENTS = {  # name: (default or None, meaning)
    "bag": (None, "the recording, in any form that the commands take"),
    "model": (None, "a ready model's name, or a .yaml file"),
    "method": ("constrained_kalman", "estimation method"),
    "settings": ("", "of the method, such as 'forgetting=0.8 m=4'"),
    "estimators": ("", "several instead of that one, 'NAME METHOD [SETTING=VALUE ...]' each, separated by commas"),
    "namespace": ("", "of all nodes: several sleds side by side do not hear each other"),
    "params_file": ("", "YAML file with parameters of the nodes by their names; what it says goes before all else"),
    "composed": ("false", "replay and estimators in one process"),
    "rate": ("0.01", "replay, times real time"),
    "lockstep": ("false", "wait at each sample until the estimators have answered it"),
    "clock": ("auto", "whether the replay publishes /clock; auto: outside a namespace, where nobody else does"),
    "loop": ("false", "replay again after the last sample"),
    "start_paused": ("false", "wait for the replay's service resume, step or burst"),
    "record": ("", "new .mcap file for what is estimated (empty: not recorded)"),
    "diagnosis": ("false", "say which physical effect the model lacks (true: it is published as the samples come)"),
    "viewer": ("true", "show it in Rerun (false: estimate only)"),
    "port": ("9876", "where viewers connect to on 127.0.0.1"),
    "rrd": ("auto", "file that the viewer writes (empty: none; auto: crash.rrd, or NAMESPACE.rrd in a namespace)"),
    "exit_when_finished": ("false", "end with replay, viewer and record; viewer or record hear the diagnosis out"),
}
ON = ("true", "1")
ESTIMATOR = re.compile(r"([A-Za-z]\w*) (\w+)((?: \w+=\S+)*)")
"""NAME METHOD [SETTING=VALUE ...]"""

Given = Mapping[str, str]
"""The arguments of the launch by name."""


class Failed(Exception):
    """A member has ended that should not have. Only an exception gives the launch an exit status of 1; it ends all."""


def generate_launch_description() -> LaunchDescription:
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=meaning)
        for name, (default, meaning) in ARGUMENTS.items()
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=members)])


def members(context: LaunchContext) -> list[RegisterEventHandler | Node]:
    """The nodes that are asked for, and before each what is done when it ends."""
    given = dict(context.launch_configurations)
    needed = {"replay"} | {name for name in ("viewer", "record") if is_wanted(given, name)}
    found: list[RegisterEventHandler | Node] = []
    for name, node in nodes(given).items():
        ended = OnProcessExit(target_action=node, on_exit=when_ended(name, needed, given))
        found += [RegisterEventHandler(ended), node]
    return found


def nodes(given: Given) -> dict[str, Node]:
    """By name, as processes: in the composed form the replay's holds the estimators too."""
    estimators = parameters_of_estimators(given)
    besides = [name for name in ("viewer", "diagnosis", "record") if is_wanted(given, name)]
    replay = {
        "bag": given["bag"], "rate": number(given, "rate"), "clock": given["clock"],
        **{name: is_on(given, name) for name in ("lockstep", "loop", "start_paused")},
        "listeners": [*estimators, *besides],
        "wait_timeout": 600.0,  # after an update they compile their code first
    }  # fmt: skip
    if is_on(given, "composed"):
        each = {"replay": replay, **estimators}
        words = [word for name, values in each.items() for word in parameter_words(values, f"{name}:")]
        found = {"replay": node(given, "crash_estimator", "composed", None, words, list(estimators))}
    else:
        found = {"replay": node(given, "crash_replay", "replay", "replay", parameter_words(replay))}
        for name, values in estimators.items():
            found[name] = node(given, "crash_estimator", "estimator", name, parameter_words(values))
    auto = f"{given['namespace'].strip('/').replace('/', '-') or 'crash'}.rrd"
    rrd = auto if given["rrd"] == "auto" else given["rrd"]
    shown = {"rrd": rrd, "port": int(number(given, "port")), "exit_when_finished": exits(given)}
    of_besides = {
        "viewer": ("crash_estimator", shown),
        "diagnosis": ("crash_estimator", {"model": given["model"]}),
        "record": ("crash_replay", {"to": given["record"], "wait_for": len(estimators)}),
    }
    for name in besides:
        package, values = of_besides[name]
        found[name] = node(given, package, name, name, parameter_words(values))
    return found


def parameters_of_estimators(given: Given) -> dict[str, dict[str, Any]]:
    """Each estimator's parameters, by its name."""
    asked = given["estimators"] or " ".join(f"estimator {given['method']} {given['settings']}".split())
    found = {}
    for one in asked.split(","):
        told = ESTIMATOR.fullmatch(" ".join(one.split()))
        if not told or told[1] in found:
            expected = "NAME METHOD [SETTING=VALUE ...], separated by commas, each name once"
            raise Failed(f"estimators, method and settings must make {expected}, got '{asked}'")
        found[told[1]] = {"model": given["model"], "method": told[2]}
        if told[3]:
            pairs = (setting.partition("=") for setting in told[3].split())
            found[told[1]] |= {f"settings.{name}": setting_in(text) for name, _, text in pairs}
    return found


def setting_in(text: str) -> float | int | bool:
    try:
        return json.loads(text)
    except ValueError:
        raise Failed(f"a setting is written NAME=NUMBER, such as forgetting=0.98, got '{text}'") from None


def node(given: Given, package: str, executable: str, name: str | None, words: list[str], arguments=()) -> Node:
    """words: for --ros-args; those of the user's file come last, because of two values the last one counts."""
    file = ["--params-file", given["params_file"]] if given["params_file"] else []
    names = {"name": name, "namespace": given["namespace"] or None}
    process = {"output": "screen", "arguments": list(arguments), "ros_arguments": [*words, *file]}
    return Node(package=package, executable=executable, **names, **process)


def parameter_words(values: Mapping[str, Any], of: str = "") -> list[str]:
    """of: such as "replay:", where the process has several nodes."""
    return [word for key, value in values.items() for word in ("-p", f"{of}{key}:={json.dumps(value)}")]


def is_on(given: Given, name: str) -> bool:
    return given[name].lower() in ON


def is_wanted(given: Given, name: str) -> bool:
    return given["record"] != "" if name == "record" else is_on(given, name)


def exits(given: Given) -> bool:
    return is_on(given, "exit_when_finished")


def number(given: Given, name: str) -> float:
    try:
        return float(given[name])
    except ValueError:
        raise Failed(f"{name} must be a number, got '{given[name]}'") from None


def when_ended(name: str, needed: set[str], given: Given) -> Callable[[ProcessExited, LaunchContext], list | None]:
    """What follows from the end of a member; needed: those whose end is awaited, less those that have ended well."""

    def follow(event: ProcessExited, context: LaunchContext) -> list[EmitEvent] | None:
        if context.is_shutdown:
            return None
        if event.returncode or name not in ("replay", "viewer", "record"):
            raise Failed(f"{name} has ended with exit status {event.returncode}; what it said stands above")
        needed.discard(name)
        if exits(given) and not needed:
            return [EmitEvent(event=Shutdown(reason="all is replayed, shown and recorded"))]
        return None

    return follow
