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
    viewer = LaunchConfiguration("viewer")
    listeners = PythonExpression(["2 if '", viewer, "'.lower() in ('true', '1') else 1"])  # estimator and viewer
    replay = Node(
        package="crash_replay",
        executable="replay",
        output="screen",
        parameters=[
            {
                "bag": text("bag"),
                "rate": ParameterValue(LaunchConfiguration("rate"), value_type=float),
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
    show = Node(
        package="crash_estimator",
        executable="viewer",
        output="screen",
        parameters=[{"rrd": text("rrd")}],
        condition=IfCondition(viewer),
    )
    return LaunchDescription([*arguments, replay, estimator, show])
