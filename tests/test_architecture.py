"""Imports run one way: the core knows neither ROS nor the viewer, and the replay does not know the estimator."""

import subprocess
import sys


def modules_after(statement: str) -> set[str]:
    code = f"import sys; {statement}; print(*sys.modules)"
    return set(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split())


def test_the_core_imports_neither_ros_nor_the_viewer():
    statement = (
        "import pkgutil, importlib, crash_estimator.core as core; "
        "[importlib.import_module(m.name) for m in pkgutil.walk_packages(core.__path__, core.__name__ + '.')]"
    )
    loaded = modules_after(statement)
    assert "crash_estimator.core.methods" in loaded
    assert not loaded & {"rclpy", "rerun", "crash_msgs", "rosbags", "pydantic", "crash_estimator.nodes"}


def test_following_a_test_needs_no_ros():
    loaded = modules_after(
        "import crash_estimator.following.follower, crash_estimator.following.alignment\n"
        "import crash_estimator.following.again"
    )
    assert "crash_estimator.kept" in loaded and not loaded & {"rclpy", "rerun", "crash_msgs"}


def test_recordings_bags_and_the_player_work_without_ros():
    loaded = modules_after(
        "import crash_replay.bag, crash_replay.readers, crash_replay.player\nimport crash_replay.conditioning"
    )
    assert not loaded & {"rclpy", "rerun", "crash_estimator"}
