"""The nodes as a user starts them, each in a process of its own, waiting for what never comes."""

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from ament_index_python.packages import get_package_prefix
from helpers_domain import own_domain
from helpers_paths import BAGS
from helpers_waiting import PATIENCE

BAG = BAGS / "frontal_single.mcap"
MODEL = "model:=frontal_single"
MODULES = {
    "replay": "crash_replay.replay_node",
    "record": "crash_replay.record_node",
    "estimator": "crash_estimator.nodes.estimator_node",
    "diagnosis": "crash_estimator.nodes.diagnosis_node",
    "viewer": "crash_estimator.nodes.viewer_node",
}
ABOUT_THE_NETWORK = (
    "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_LOCALHOST_ONLY", "ROS_STATIC_PEERS", "ROS_DISCOVERY_SERVER",
    "FASTRTPS_DEFAULT_PROFILES_FILE",
)  # fmt: skip


def environment(**given: str) -> dict[str, str]:
    """Of somebody who has set nothing about the network, on a ROS domain of the test's own."""
    kept = {k: v for k, v in os.environ.items() if k not in (*ABOUT_THE_NETWORK, "DISPLAY", "WAYLAND_DISPLAY")}
    return kept | {"ROS_DOMAIN_ID": str(own_domain())} | given


def parameters(name: str, folder: Path) -> list[str]:
    """For a node to start with, and then to wait."""
    of = {
        "replay": [f"bag:={BAG}", "wait_for:=9", f"wait_timeout:={2 * PATIENCE}"],
        "record": [f"to:={folder / 'new.mcap'}"],
        "estimator": [MODEL],
        "diagnosis": [MODEL],
        "viewer": [f"rrd:={folder / 'new.rrd'}", "port:=0"],
    }
    return ["--ros-args", *(word for parameter in of[name] for word in ("-p", parameter))]


def node(name: str, folder: Path) -> list[str]:
    """Its whole command."""
    return executable(MODULES[name].split(".")[0], name) + parameters(name, folder)


def executable(package: str, name: str) -> list[str]:
    """As `ros2 run` starts it."""
    return [sys.executable, str(Path(get_package_prefix(package)) / "lib" / package / name)]


def end(processes: Sequence[subprocess.Popen]) -> None:
    """A node that compiles takes no signal till it is through, so that they may have to be killed."""
    for process in processes:
        process.terminate()
    for process in processes:
        try:
            process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()


def family(process: int) -> list[int]:
    """A process and those that it has started, and they."""
    try:
        threads = [(thread / "children").read_text() for thread in Path(f"/proc/{process}/task").iterdir()]
    except OSError:
        return [process]  # it has ended
    return [process, *(one for children in threads for child in children.split() for one in family(int(child)))]
