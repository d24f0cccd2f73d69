"""A recording replayed, estimated and shown:

ros2 launch crash_estimator live.launch.py bag:=bags/side_dummy_padded.mcap model:=side_dummy

The replay ends with the last sample; estimator and viewer stay until Ctrl-C.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition
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
}


def text(name: str) -> ParameterValue:
    return ParameterValue(LaunchConfiguration(name), value_type=str)


def generate_launch_description() -> LaunchDescription:
    arguments = [
        DeclareLaunchArgument(name, default_value=default, description=meaning)
        for name, (default, meaning) in ARGUMENTS.items()
    ]
    viewer, diagnosis, record = (LaunchConfiguration(name) for name in ("viewer", "diagnosis", "record"))
    is_on = "'.lower() in ('true', '1'))"
    recorded = PythonExpression(["'", record, "' != ''"])
    # the estimator and these
    listeners = PythonExpression(["1 + ('", viewer, is_on, " + ('", diagnosis, is_on, " + ('", record, "' != '')"])
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
                "wait_for": ParameterValue(listeners, value_type=int),
                "wait_timeout": 300.0,  # after an update the estimator compiles its code first
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
        parameters=[{"rrd": text("rrd")}],
        condition=IfCondition(viewer),
    )
    write = Node(
        package="crash_replay",
        executable="record",
        output="screen",
        parameters=[{"to": text("record")}],
        condition=IfCondition(recorded),
    )
    return LaunchDescription([*arguments, replay, estimator, diagnose, show, write])
