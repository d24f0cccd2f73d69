"""The packages build with a plain `colcon build` in a workspace of somebody who has ROS 2 and what package.xml asks."""

import os
import shlex
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
from helpers_paths import ROOT

PACKAGES = ("crash_msgs", "crash_replay", "crash_estimator", "crash_examples")
BUILD = 1800
"""s: a minute and a half on two idle cores, much more where other work has them."""


@pytest.fixture(scope="module")
def workspace(tmp_path_factory) -> Path:
    """Theirs, with our sources in its src, built."""
    workspace = tmp_path_factory.mktemp("stranger") / "ws"
    unwanted = shutil.ignore_patterns("__pycache__", "*.egg-info", "*.pyc")
    shutil.copytree(ROOT / "ros2_ws" / "src", workspace / "src", ignore=unwanted)
    colcon = "import sys; from colcon_core.command import main; sys.exit(main())"
    build = [sys.executable, "-c", colcon, "build", "--event-handlers", "console_direct+"]
    if Path(os.environ["AMENT_PREFIX_PATH"].split(":")[-1]) == ROOT / ".venv":  # ROS 2 from wheels, which do not say so
        build += ["--cmake-args", f"-DPython3_EXECUTABLE={sys.executable}", f"-DPython3_INCLUDE_DIR={headers()}"]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    done = subprocess.run(build, cwd=workspace, env=without_ours(), timeout=BUILD, **pipes)
    assert done.returncode == 0, done.stdout[-3000:]
    return workspace


def headers() -> Path:
    """Where Python.h is: the set-up unpacks it where the system has none."""
    installed = Path(sysconfig.get_path("include"))
    return installed if (installed / "Python.h").exists() else ROOT / ".setup" / "headers" / installed.relative_to("/")


def without_ours() -> dict[str, str]:
    """The environment of these tests without the workspace that they run in; quick to compile, slow to run."""
    ours = str(ROOT / "ros2_ws")
    lists = ("AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH", "PYTHONPATH", "LD_LIBRARY_PATH")
    kept = {k: ":".join(p for p in os.environ.get(k, "").split(":") if not p.startswith(ours)) for k in lists}
    searched = {"CPATH": f"{headers().parent}:{headers()}"}
    flags = {"CFLAGS": "-O0", "CXXFLAGS": "-O0", "MAKEFLAGS": "-j2"}
    return os.environ | kept | searched | flags


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
    run = f"timeout -s INT 5 {shlex.quote(sys.executable)} {shlex.quote(str(example))}"
    said = sourced(workspace, f"{run}; [ $? = 124 ]")
    assert said == "ended before the car stood still\n"
