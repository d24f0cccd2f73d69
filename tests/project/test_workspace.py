"""The packages build with a plain `colcon build` in a workspace of somebody who has ROS 2 and what package.xml asks."""

import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from helpers_paths import ROOT

PACKAGES = ("crash_replay", "crash_estimator", "crash_examples")
BUILD = 600
"""s: some seconds on idle cores, more where other work has them."""


@pytest.fixture(scope="module")
def workspace(tmp_path_factory) -> Path:
    """Theirs, with our sources in its src, built; the messages are those that set-up has built with colcon, as an
    underlay: to generate them again would take three minutes of processor."""
    workspace = tmp_path_factory.mktemp("stranger") / "ws"
    unwanted = shutil.ignore_patterns("__pycache__", "*.egg-info", "*.pyc", "crash_msgs")
    shutil.copytree(ROOT / "ros2_ws" / "src", workspace / "src", ignore=unwanted)
    colcon = "import sys; from colcon_core.command import main; sys.exit(main())"
    build = [sys.executable, "-c", colcon, "build", "--event-handlers", "console_direct+"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    done = subprocess.run(build, cwd=workspace, env=without_ours(), timeout=BUILD, **pipes)
    assert done.returncode == 0, done.stdout[-3000:]
    return workspace


def without_ours() -> dict[str, str]:
    """The environment of these tests without the packages of the workspace that they run in, but for its messages."""
    ours, messages = str(ROOT / "ros2_ws"), str(ROOT / "ros2_ws" / "install" / "crash_msgs")
    lists = ("AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH", "PYTHONPATH", "LD_LIBRARY_PATH")
    each = {k: os.environ.get(k, "").split(":") for k in lists}
    kept = {k: ":".join(p for p in v if p.startswith(messages) or not p.startswith(ours)) for k, v in each.items()}
    return os.environ | kept


def sourced(workspace: Path, command: str) -> str:
    """What a command says in a shell that has sourced the workspace."""
    script = f"source {shlex.quote(str(workspace / 'install' / 'local_setup.bash'))} && {command}"
    environment = without_ours() | {"ROS_DOMAIN_ID": "0"}
    done = subprocess.run(["bash", "-c", script], env=environment, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_what_is_imported_is_theirs(workspace):
    files = "; ".join(f"import {name}; print({name}.__file__)" for name in PACKAGES)
    for line in sourced(workspace, f"{shlex.quote(sys.executable)} -c '{files}'").splitlines():
        assert Path(line).is_relative_to(workspace / "install"), line


def test_models_launch_file_and_profiles_are_installed(workspace):
    share = workspace / "install" / "crash_estimator" / "share" / "crash_estimator"
    assert (share / "launch" / "live.launch.py").exists() and (share / "models" / "side_dummy.yaml").exists()
    python = shlex.quote(sys.executable)
    ready = "from crash_estimator.model_file import load_model; print(load_model('side_dummy').name)"
    assert sourced(workspace, f'{python} -c "{ready}"') == "side_dummy\n"
    assert list((workspace / "install" / "crash_replay").rglob("fastdds_this_machine.xml")), "how far a node is heard"
    synthesize = workspace / "install" / "crash_replay" / "lib" / "crash_replay" / "synthesize"
    assert "side_dummy_padded" in sourced(workspace, f"{python} {shlex.quote(str(synthesize))} --list")


def test_the_example_runs_there(workspace):
    example = workspace / "install" / "crash_examples" / "lib" / "crash_examples" / "air_bag_trigger"
    said = ""
    for seconds in (5, 20, 60):  # until a slow machine has started it
        run = f"timeout -s INT {seconds} {shlex.quote(sys.executable)} {shlex.quote(str(example))}"
        said = said or sourced(workspace, f"{run}; [ $? = 124 ]")
    assert said == "ended before the car stood still\n"
