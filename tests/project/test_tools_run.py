"""tools/run is `ros2 run` where ROS 2 comes as wheels; here it starts an executable of a workspace made for it."""

import re
import signal
import subprocess
import sys

import pytest
from helpers_paths import ROOT
from helpers_setup import Clone, script, wheels_only


@pytest.fixture
def workspace(tmp_path):
    clone = Clone(tmp_path)
    script(clone.root / "tools/setup", "#!/bin/sh\n")
    script(clone.root / ".venv/bin/python", f'#!/bin/sh\nexec "{sys.executable}" "$@"\n')
    return clone


def run(clone: Clone, body: str, *arguments: str, **environment: str) -> subprocess.CompletedProcess:
    script(clone.root / "ros2_ws/install/crash_replay/lib/crash_replay/replay", body)
    process = clone.start(str(clone.root / "tools/run"), "crash_replay", "replay", *arguments, **environment)
    output, errors = process.communicate(timeout=60)
    return subprocess.CompletedProcess(arguments, process.returncode, output, errors)


@wheels_only
def test_run_hands_on_arguments_input_and_exit_status(workspace):
    result = run(workspace, "import sys; print(sys.argv[1:]); sys.exit(7)", "--ros-args", "-p", "a b:='*'", "")
    assert result.stdout == str(["--ros-args", "-p", "a b:='*'", ""]) + "\n"
    assert result.returncode == 7


@wheels_only
def test_run_hands_on_signals(workspace):
    body = "import os, signal, time; os.kill(os.getpid(), signal.SIGTERM); time.sleep(9)"
    assert run(workspace, body).returncode == -signal.SIGTERM


@wheels_only
def test_run_keeps_to_this_machine_unless_told_otherwise(workspace):
    body = "import os; print(os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'], os.environ.get('ROS_DOMAIN_ID'))"
    assert run(workspace, body).stdout == "LOCALHOST None\n"
    environment = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET", "ROS_DOMAIN_ID": "7"}
    assert run(workspace, body, **environment).stdout == "SUBNET 7\n"


@wheels_only
def test_run_lets_nothing_of_another_ros_in(workspace):
    body = "import os; print(os.environ['AMENT_PREFIX_PATH'] + os.environ['PYTHONPATH'])"
    humble = {"AMENT_PREFIX_PATH": "/opt/ros/humble", "PYTHONPATH": "/opt/ros/humble/lib", "ROS_DISTRO": "humble"}
    result = run(workspace, body, **humble)
    assert str(workspace.root / "ros2_ws/install/crash_replay") in result.stdout
    assert "humble" not in result.stdout


@wheels_only
@pytest.mark.parametrize(
    "package, executable, message",
    [
        ("crash_repla", "replay", "package 'crash_repla' not found; did you mean crash_replay?"),
        ("zzz", "replay", "package 'zzz' not found; there are: crash_replay"),
        ("crash_replay", "rpelay", "executable of package crash_replay 'rpelay' not found; did you mean replay?"),
        ("crash_replay", "zzz", "executable of package crash_replay 'zzz' not found; there are: replay"),
    ],
)
def test_run_names_what_is_nearest_to_what_is_not_there(workspace, package, executable, message):
    run(workspace, "")
    process = workspace.start("tools/run", package, executable)
    assert process.communicate(timeout=60) == ("", message + "\n")
    assert process.returncode == 1


def test_run_without_package_and_executable_shows_its_usage():
    result = subprocess.run([ROOT / "tools/run", "crash_replay"], capture_output=True, text=True, timeout=60)
    assert (result.returncode, result.stderr) == (2, "usage: tools/run PACKAGE EXECUTABLE [ARGS...]\n")


def test_run_finds_what_setup_py_declares():
    declared = re.findall(r'^ +"(\w+) = ', (ROOT / "ros2_ws/src/crash_replay/setup.py").read_text(), re.MULTILINE)
    installed = ROOT / "ros2_ws/install/crash_replay/lib/crash_replay"
    assert sorted(declared) == sorted(path.name for path in installed.iterdir())
