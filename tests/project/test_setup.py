"""The set-up does what is missing and nothing else, says what it lacks, and installs what is pinned."""

import os
import re
import subprocess
import sys
import time
from importlib import metadata
from pathlib import Path

import pytest
from helpers_paths import ROOT
from helpers_setup import PREREQUISITES, PYTHON, Clone, script, wheels_only

TOO_OLD = '#!/bin/sh\ncase "$*" in *version_info*) exit 1; esac'
WITHOUT_VENV = '#!/bin/sh\ncase "$*" in *ensurepip*) exit 1; esac'
WITHOUT_HEADERS = '#!/bin/sh\ncase "$*" in *get_path*) echo /nowhere; exit; esac'


@pytest.fixture
def clone(tmp_path):
    return Clone(tmp_path)


@wheels_only
def test_set_up_does_everything_once_and_nothing_the_second_time(clone):
    assert clone.setup()[0] == 0
    assert clone.calls() == ["venv", "pip", "colcon"]
    assert clone.setup() == (0, "", "")
    assert clone.calls() == []


@wheels_only
def test_new_message_is_built_without_installing_anything(clone):
    clone.setup()
    clone.calls()
    clone.message.write_text("float64 value\nstring unit\n")
    assert clone.setup()[0] == 0
    assert clone.calls() == ["colcon"]


@wheels_only
def test_new_python_module_needs_no_build(clone):
    clone.setup()
    clone.calls()
    script(clone.root / "ros2_ws/src/crash_replay/crash_replay/player.py", "")
    script(clone.root / "ros2_ws/src/crash_replay/__pycache__/setup.cpython-311.pyc", "")
    assert clone.setup() == (0, "", "")


@wheels_only
def test_changed_versions_are_installed_into_the_venv_there_is(clone):
    clone.setup()
    clone.calls()
    (clone.root / "tools/constraints.txt").write_text("numpy==9.9.9\n")
    assert clone.setup()[0] == 0
    assert clone.calls() == ["pip", "colcon"]


@wheels_only
def test_moved_clone_is_set_up_anew(clone):
    clone.setup()
    clone.calls()
    clone.root = clone.root.rename(clone.root.with_name("moved"))
    assert clone.setup()[0] == 0
    assert clone.calls() == ["venv", "pip", "colcon"]


@wheels_only
def test_failed_installation_shows_the_end_of_its_log_and_is_done_anew_the_next_time(clone):
    status, _, errors = clone.setup(PIP_STATUS="1")
    assert status == 1
    assert "connection broken: no route to host\n[set-up] pip did not get through: is there a network?\n" in errors
    assert str(clone.root / ".setup/pip.log") in errors.splitlines()[-1]
    assert clone.calls() == ["venv", "pip"]
    half_installed = script(clone.root / ".venv/lib/numpy.py", "")
    assert clone.setup()[0] == 0
    assert clone.calls() == ["venv", "pip", "colcon"]
    assert not half_installed.exists()


@wheels_only
def test_failed_update_is_done_anew_from_an_empty_venv(clone):
    clone.setup()
    (clone.root / "tools/constraints.txt").write_text("numpy==9.9.9\n")
    assert clone.setup(PIP_STATUS="1")[0] == 1
    clone.calls()
    assert clone.setup()[0] == 0
    assert clone.calls() == ["venv", "pip", "colcon"]


@wheels_only
def test_interrupted_installation_is_done_anew_the_next_time(clone):
    process = clone.start("tools/setup", PIP_SECONDS="1")
    while "pip" not in (clone.calls_file.read_text() if clone.calls_file.exists() else ""):
        assert process.poll() is None, process.communicate()
        time.sleep(0.01)
    process.kill()
    process.communicate()
    clone.calls()
    assert clone.setup()[0] == 0
    assert clone.calls() == ["venv", "pip", "colcon"]


@wheels_only
def test_two_set_ups_at_once_do_the_work_once(clone):
    processes = [clone.start("tools/setup", PIP_SECONDS="0.3") for _ in range(2)]
    outputs = [process.communicate(timeout=60) for process in processes]
    assert [process.returncode for process in processes] == [0, 0], outputs
    assert clone.calls() == ["venv", "pip", "colcon"]
    assert sum("waiting for another set-up" in output for output, _ in outputs) == 1


def lacks(missing: str, packages: str) -> str:
    return f"[set-up] missing: {missing}. Get what is missing, on Debian or Ubuntu with: apt install {packages}\n"


@wheels_only
@pytest.mark.parametrize("name", PREREQUISITES)
def test_missing_prerequisite_is_one_line_that_says_how_to_get_it(clone, name):
    (clone.bin / name).unlink()
    status, _, errors = clone.setup()
    assert status == 1
    assert errors == lacks(name, name)
    assert clone.calls() == []


@wheels_only
@pytest.mark.parametrize(
    "python, missing, packages",
    [
        (None, "python3 (3.11 to 3.14)", "python3 python3-venv python3-dev"),
        (PYTHON.replace("#!/bin/sh", TOO_OLD), "python3 (3.11 to 3.14)", "python3 python3-venv python3-dev"),
        (PYTHON.replace("#!/bin/sh", WITHOUT_VENV), "python3's venv", "python3-venv"),
        (PYTHON.replace("#!/bin/sh", WITHOUT_HEADERS), "python3's headers (Python.h)", "python3-dev"),
    ],
    ids=["none", "too old", "without venv", "without headers"],
)
def test_python_that_will_not_do_is_one_line_too(clone, python, missing, packages):
    (clone.bin / "python3").unlink()
    if python is not None:
        script(clone.bin / "python3", python)
    status, _, errors = clone.setup()
    assert status == 1
    assert errors == lacks(missing, packages)


@wheels_only
def test_headers_that_debian_has_in_a_package_of_their_own_are_unpacked_beside_the_venv(clone):
    script(clone.bin / "apt-get", '#!/bin/sh\n[ "$*" = "download libpython3.11-dev" ] && touch "$2_1.deb"\n')
    unpack = 'mkdir -p "$3/nowhere/python3.11" && touch "$3/nowhere/python3.11/Python.h"'
    script(clone.bin / "dpkg-deb", f'#!/bin/sh\n[ "$1 $2" = "-x libpython3.11-dev_1.deb" ] && {unpack}\n')
    status, _, errors = clone.setup(INCLUDE="/nowhere/python3.11")
    assert (status, errors) == (0, "")
    assert clone.calls() == ["venv", "pip", "colcon"]
    assert (clone.root / ".setup/headers/nowhere/python3.11/Python.h").exists()


def test_real_set_up_has_nothing_left_to_do_and_begins_nothing():
    result = subprocess.run([ROOT / "tools/setup"], capture_output=True, text=True, timeout=60)
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")
    told = subprocess.run(["bash", "-x", ROOT / "tools/setup"], capture_output=True, text=True, timeout=60).stderr
    words = {line.lstrip("+").split()[0] for line in told.splitlines() if re.match(r"\++ \S", line)}
    assert "sha256sum" in words, "what it looks at is told"
    assert not [word for word in words if re.search("python|pip|colcon|apt-get|dpkg", word)], "and nothing else begins"


# what is pinned


def requirements(name: str) -> list[str]:
    lines = (ROOT / "tools" / name).read_text().splitlines()
    return [line for line in lines if line and not line.startswith("#")]


def normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", re.sub(r"\[.*\]", "", name)).lower()


def constraints() -> dict[str, str]:
    return {normal(name): version for name, version in (line.split("==") for line in requirements("constraints.txt"))}


@pytest.mark.parametrize("name", ["requirements.txt", "ros-wheels.txt"])
def test_every_direct_requirement_is_pinned_in_constraints_and_nowhere_else(name):
    for requirement in requirements(name):
        assert re.fullmatch(r"[a-z0-9.\-]+(\[[a-z]+\])?", requirement), requirement
        assert normal(requirement) in constraints()


def test_what_is_installed_is_what_is_pinned():
    # ROS's packages bring others inside their wheels (egg-info), which pip did not choose and nobody can pin.
    folders = [str(path) for path in Path(sys.prefix).glob("lib/python3*/site-packages")]
    installed = {
        normal(package.metadata["Name"]): package.version
        for package in metadata.distributions(path=folders)
        if package.read_text("INSTALLER") == "pip\n"
    }
    del installed["pip"]
    compared_with = (ROOT / "tools" / "benchmark-requirements.txt").read_text()  # once `make benchmark` has run
    pinned = constraints() | dict(line.split("==") for line in compared_with.splitlines() if "==" in line)
    assert installed == {name: pinned.get(name) for name in installed}


@wheels_only
def test_cmake_exports_name_no_folder_of_the_machine_that_built_the_wheels():
    exports = list(Path(sys.prefix, "share").glob("*/cmake/*Export.cmake"))
    assert exports
    assert [path for path in exports if "/opt/python" in path.read_text()] == []


# make and CI


def recipe(*arguments: str) -> list[str]:
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("MAKE", "MFLAGS"))}
    command = ["make", "--dry-run", "--no-print-directory", *arguments]
    result = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=True)
    return [line.rstrip() for line in result.stdout.splitlines()]


@pytest.mark.parametrize(
    "arguments, command",
    [
        (["demo"], "tools/run crash_estimator demo"),
        (["demo", "RECORDING=../a b"], 'tools/run crash_estimator demo --recording "../a b"'),
        (["demo", "RECORDING=a", "WITH=b c"], 'tools/run crash_estimator demo --recording "a" --with "b c"'),
        (["bags"], "tools/run crash_replay synthesize --all --to bags"),
        (["mutants", "ARGS=--seed 2"], "tools/env python tools/mutants.py --seed 2"),
        (["thesis"], "tools/env python -m crash_estimator.thesis"),
        (["thesis", "DATA=../a b"], 'tools/env python -m crash_estimator.thesis --data "../a b"'),
    ],
)
def test_make_runs(arguments, command):
    assert recipe(*arguments)[-1] == command


def test_the_demonstration_gets_what_its_picture_takes_where_there_is_no_screen():
    first, _ = recipe("demo")
    assert first.startswith('[ -n "$DISPLAY$WAYLAND_DISPLAY" ] ||') and "tools/screenshot-libs" in first


TWO_PROCESSES = (
    "-p _hypothesis_pytestplugin -p xdist.plugin -n 2 --dist loadfile --no-loadscope-reorder --max-worker-restart 0"
)


def test_make_test_ends_with_pytest_itself():
    assert recipe("test", "PYTEST_ARGS=-k noise")[-1].endswith(f"-m pytest {TWO_PROCESSES} -k noise")


def test_ci_is_make_test_and_fails_with_it(tmp_path):
    script(tmp_path / "make", '#!/bin/sh\necho "make $*"\nexit 3\n')
    environment = {**os.environ, "PATH": f"{tmp_path}:{os.environ['PATH']}"}
    result = subprocess.run(["bash", ".ci/run"], cwd=ROOT, env=environment, capture_output=True, text=True, timeout=60)
    assert (result.returncode, result.stdout) == (3, "make test\n")


# what the picture needs


@pytest.mark.parametrize(
    "packages, output",
    [
        ('echo ii; shift 3; for package; do echo "ii $package"; done', ""),
        (
            "exit 1",
            "[set-up] without a screen there will be no pictures, nor the tests of them; for them: apt install mesa-",
        ),
    ],
    ids=["there", "missing, and sudo wants a password"],
)
def test_screenshot_libs_says_what_is_missing(clone, packages, output):
    script(clone.bin / "dpkg-query", f"#!/bin/sh\n{packages}\n")
    script(clone.bin / "id", "#!/bin/sh\necho 1000\n")
    script(clone.bin / "sudo", "#!/bin/sh\nexit 1\n")
    process = clone.start("tools/screenshot-libs")
    found, errors = process.communicate(timeout=60)
    assert (process.returncode, errors) == (0, "")
    assert found.startswith(output) and bool(found) == bool(output)
