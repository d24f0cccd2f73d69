"""A recording replayed, estimated and shown:

ros2 launch crash_estimator live.launch.py bag:=bags/side_dummy_padded.mcap model:=side_dummy

The replay ends when all have the last sample; estimator and viewer stay until Ctrl-C, or end with the others where
exit_when_finished:=true. Where one of them fails all end, with exit status 1.
"""

from collections.abc import Callable

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, EmitEvent, RegisterEventHandler
from launch.conditions import IfCondition
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.events.process import ProcessExited
from launch.substitutions import LaunchConfiguration, PythonExpression
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

ARGUMENTS = {  # name: (default or None, meaning)
    "bag": (None, "the recording: a rosbag2 folder or one .mcap file"),
    "model": (None, "a ready model's name, or a .yaml file"),
    "method": ("constrained_kalman", "estimation method"),
    "rate": ("0.01", "replay, times real time"),
    "lockstep": ("false", "wait at each sample until the estimator has answered it"),
    "loop": ("false", "replay again after the last sample"),
    "start_paused": ("false", "wait for the replay's service resume, step or burst"),
    "record": ("", "new .mcap file for what is estimated (empty: not recorded)"),
    "diagnosis": ("false", "say which physical effect the model lacks (true: it is published as the samples come)"),
    "viewer": ("true", "show it in Rerun (false: estimate only)"),
    "rrd": ("crash.rrd", "file that the viewer writes"),
    "exit_when_finished": ("false", "end with replay, viewer and record; viewer or record hear the diagnosis out"),
}
ON = ("true", "1")


class Failed(Exception):
    """A member has ended that should not have. Only an exception gives the launch an exit status of 1; it ends all."""


def text(name: str) -> ParameterValue:
    return ParameterValue(LaunchConfiguration(name), value_type=str)


def generate_launch_description() -> LaunchDescription:
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=meaning)
        for name, (default, meaning) in ARGUMENTS.items()
    ]
    viewer, diagnosis, record, exits = (
        LaunchConfiguration(name) for name in ("viewer", "diagnosis", "record", "exit_when_finished")
    )
    recorded = PythonExpression(["'", record, "' != ''"])
    listeners = PythonExpression(
        [
            *("['estimator'] + ['viewer'] * ('", viewer, f"'.lower() in {ON})"),
            *(" + ['diagnosis'] * ('", diagnosis, f"'.lower() in {ON})"),
            *(" + ['record'] * ('", record, "' != '')"),
        ]
    )
    replay = Node(
        package="crash_replay",
        executable="replay",
        output="screen",
        parameters=[
            {
                "bag": text("bag"),
                "rate": ParameterValue(LaunchConfiguration("rate"), value_type=float),
                "lockstep": ParameterValue(LaunchConfiguration("lockstep"), value_type=bool),
                "loop": ParameterValue(LaunchConfiguration("loop"), value_type=bool),
                "start_paused": ParameterValue(LaunchConfiguration("start_paused"), value_type=bool),
                "listeners": ParameterValue(listeners, value_type=list[str]),
                "wait_timeout": 600.0,  # after an update they compile their code first
            }
        ],
    )
    estimator = Node(
        package="crash_estimator",
        executable="estimator",
        output="screen",
        parameters=[{"model": text("model"), "method": text("method")}],
    )
    diagnose = Node(
        package="crash_estimator",
        executable="diagnosis",
        output="screen",
        parameters=[{"model": text("model")}],
        condition=IfCondition(diagnosis),
    )
    show = Node(
        package="crash_estimator",
        executable="viewer",
        output="screen",
        parameters=[{"rrd": text("rrd"), "exit_when_finished": ParameterValue(exits, value_type=bool)}],
        condition=IfCondition(viewer),
    )
    write = Node(
        package="crash_replay",
        executable="record",
        output="screen",
        parameters=[{"to": text("record")}],
        condition=IfCondition(recorded),
    )
    nodes = {"replay": replay, "estimator": estimator, "diagnosis": diagnose, "viewer": show, "record": write}
    ended: set[str] = set()
    handlers = [
        RegisterEventHandler(OnProcessExit(target_action=node, on_exit=when_ended(name, ended)))
        for name, node in nodes.items()
    ]
    return LaunchDescription([*arguments, *handlers, *nodes.values()])  # a handler comes before what it is about


def when_ended(name: str, ended: set[str]) -> Callable[[ProcessExited, LaunchContext], list[EmitEvent] | None]:
    """What follows from the end of a member; ended: those that have ended well so far."""

    def follow(event: ProcessExited, context: LaunchContext) -> list[EmitEvent] | None:
        if context.is_shutdown:
            return None
        if event.returncode or name in ("estimator", "diagnosis"):
            raise Failed(f"{name} has ended with exit status {event.returncode}; what it said stands above")
        ended.add(name)
        given = context.launch_configurations
        asked_for = {"replay": True, "viewer": given["viewer"].lower() in ON, "record": given["record"] != ""}
        through = all(one in ended for one, wanted in asked_for.items() if wanted)
        if through and given["exit_when_finished"].lower() in ON:
            return [EmitEvent(event=Shutdown(reason="all is replayed, shown and recorded"))]
        return None

    return follow
