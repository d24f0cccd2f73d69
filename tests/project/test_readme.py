"""Every command in the README is run here as it stands; `make test` is the one that runs this."""

import json
import re
import shlex
import shutil
import subprocess
import time

import numpy as np
import pytest
from helpers_graph import NEEDS_A_GRAPH
from helpers_paths import ROOT
from helpers_readme import COMMANDS, EXAMPLE, README, environment, needs_data
from numpy.testing import assert_allclose
from rclpy.serialization import serialize_message
from rosbags.rosbag2 import StoragePlugin, Writer

from crash_replay.bag import read_bag, time_zero_ns
from crash_replay.message_types import encode_test, typestore
from crash_replay.ros_messages import samples_to_msg

NODES = ("crash_estimator viewer", "crash_estimator estimator", "crash_replay record")
LISTENING = [c for c in COMMANDS if any(node in c for node in NODES) and c not in EXAMPLE]
REPLAY = [c for c in COMMANDS if "crash_replay replay" in c and c not in EXAMPLE]
THREE = [c for c in COMMANDS if "hidden_effect" in c and "--effects" not in c]
MAKE = [c for c in COMMANDS if c.startswith("make ")]  # test_readme_demo, and this
NAMESPACED = [line.strip() for line in README.splitlines() if line.startswith("    tools/run") and "__ns:=" in line]
ALONE = [c for c in COMMANDS if c not in (*MAKE, *LISTENING, *REPLAY, *THREE, *EXAMPLE)]


def test_the_first_two_commands_do_everything():
    assert COMMANDS[:2] == ["make demo", "make test"]
    assert "make test" in (ROOT / ".ci" / "run").read_text()


def test_make_check_takes_files_that_are_there_and_none_that_starts_a_node():
    said = subprocess.run(["make", "-n", "check"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    checked = [ROOT / word for word in said.split() if word.startswith("tests/")]
    assert len(checked) > 5 and all(path.exists() for path in checked) and " --no-graph " in said
    assert NEEDS_A_GRAPH.search((ROOT / "tests/nodes/test_estimator_node.py").read_text())
    assert not NEEDS_A_GRAPH.search((ROOT / "tests/core/test_estimators.py").read_text())


@pytest.mark.parametrize("command", ALONE)
def test_a_command_runs_as_it_stands(command):
    needs_data(command)
    if "out/camry.mcap --model" in command and not (ROOT / "out/camry.mcap").exists():  # by the command before it
        before = ALONE[ALONE.index(command) - 1]
        needs_data(before)
        subprocess.run(shlex.split(before), cwd=ROOT, check=True, capture_output=True, env=environment())
    if "synthesize" in command:  # does not replace what is there
        (ROOT / "out" / "mine.mcap").unlink(missing_ok=True)
    done = subprocess.run(
        shlex.split(command), cwd=ROOT, env=environment(), capture_output=True, text=True, timeout=240
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    assert "Traceback" not in done.stderr


@pytest.fixture
def written():
    """Files that the nodes write, which were not there before."""
    files = [ROOT / "out" / "dummy.rrd", ROOT / "out" / "dummy_estimates.mcap"]
    for file in files:
        file.unlink(missing_ok=True)
        file.parent.mkdir(exist_ok=True)
    return files


def test_the_nodes_find_each_other(tmp_path, written):
    """Told to end at once, a viewer has 9 s for what it was sent; where other work leaves it too little, it says so,
    and a minute later it is done."""
    assert len(LISTENING) == 3 and len(REPLAY) == 1
    statuses, said = _replayed(tmp_path)
    if any(statuses) and "incomplete: not finished within" in said:
        statuses, said = _replayed(tmp_path, later=60.0)
    assert "Traceback" not in said and "not seen" not in said, said
    assert statuses == [0, 0, 0], said
    assert all(file.stat().st_size > 100_000 for file in written)


def _replayed(tmp_path, later: float = 0.0) -> tuple[list[int], str]:
    """How the listening nodes ended, which are told to so many s after the replay, and what they said."""
    logs = [open(tmp_path / f"{k}.log", "w+") for k in range(len(LISTENING))]
    together = environment()
    nodes = [
        subprocess.Popen(shlex.split(c), cwd=ROOT, env=together, stdout=log, stderr=log)
        for c, log in zip(LISTENING, logs)
    ]
    try:
        replay = subprocess.run(
            [*shlex.split(REPLAY[0]), "-p", "wait_timeout:=120.0"],
            cwd=ROOT, env=together, capture_output=True, text=True, timeout=200,
        )  # fmt: skip
        assert replay.returncode == 0, replay.stdout + replay.stderr
        assert "1201 samples sent" in replay.stdout
        time.sleep(later)
    finally:
        for node in nodes:
            node.terminate()
        statuses = [node.wait(30) for node in nodes]
    for log in logs:
        log.close()
    return statuses, "".join((tmp_path / f"{k}.log").read_text() for k in range(len(logs)))


def test_sleds_in_namespaces_are_replayed_side_by_side():
    estimators = [c for c in NAMESPACED if "crash_estimator estimator" in c]
    replays = [f"{c} -p wait_timeout:=120.0" for c in NAMESPACED if "crash_replay replay" in c]
    assert len(estimators) == len(replays) == 2
    piped = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    together = {"cwd": ROOT, "env": environment(), **piped}
    nodes = {c: subprocess.Popen(shlex.split(c), **together) for c in (*estimators, *replays)}
    said = {c: nodes[c].communicate(timeout=200)[0] for c in replays}
    for c in estimators:
        nodes[c].terminate()
    said |= {c: nodes[c].communicate(timeout=60)[0] for c in estimators}
    assert all(node.returncode == 0 for node in nodes.values()), said
    assert ["1201 samples sent" in said[replays[0]], "1901 samples sent" in said[replays[1]]] == [True, True], said


def test_the_composed_form_replays_to_both_its_estimators():
    (command,) = [line.strip() for line in README.splitlines() if "crash_estimator composed kalman" in line]
    wait = " -p replay:wait_timeout:=120.0"
    ends = {"capture_output": True, "text": True, "timeout": 200}
    done = subprocess.run(shlex.split(command + wait), cwd=ROOT, env=environment(), **ends)
    assert (done.returncode, "1201 samples sent" in done.stdout) == (0, True), done.stdout + done.stderr
    assert all(f"[{name}]: test side_dummy_padded" in done.stdout + done.stderr for name in ("kalman", "quick"))


def test_what_rosbag2_has_recorded_of_test_and_samples_is_replayed():
    (command,) = [line.strip() for line in README.splitlines() if "bag:=out/rosbag2" in line]
    recording, folder = read_bag(ROOT / "bags/frontal_engine_cab.mcap"), ROOT / "out/rosbag2"
    shutil.rmtree(folder, ignore_errors=True)
    zero = time_zero_ns(recording)
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topics = {"/test": "crash_msgs/msg/TestInfo", "/samples": "crash_msgs/msg/Samples"}
        test, samples = (writer.add_connection(t, kind, typestore=typestore()) for t, kind in topics.items())
        writer.write(test, zero, encode_test(recording, zero))
        for number in range(len(recording)):
            message = samples_to_msg(recording, number, number + 1, 0, zero)
            writer.write(samples, zero + recording.time_ns.item(number), serialize_message(message))
    ends = {"capture_output": True, "text": True, "timeout": 100}
    done = subprocess.run(shlex.split(command), cwd=ROOT, env=environment(), **ends)
    assert done.returncode == 0 and f"{len(recording)} samples sent" in done.stdout, done.stdout + done.stderr


@pytest.mark.parametrize("name", sorted(set(re.findall(r"`(ros2_ws/src/[\w/]+|bags/[\w.]+)`", README))))
def test_every_path_that_is_named_is_there(name):
    assert (ROOT / name).exists()


def test_the_effect_that_is_shown_is_the_file_and_stands_in_the_ranking():
    (shown,) = [code for code in re.findall(r"```python\n(.*?)```", README, re.S) if "EFFECT" in code]
    assert shown == (ROOT / "docs/position_damping.py").read_text() and shown.count("\n") <= 20
    (command,) = [c for c in COMMANDS if "--effects" in c]
    found = ROOT / "out/own.json"
    if not found.exists():  # made by the command's own test, above
        subprocess.run(shlex.split(command), cwd=ROOT, check=True, capture_output=True, env=environment())
    ranking = json.loads(found.read_text())["ranking"]
    names = {(one["effect"], one["target"]): one for one in ranking}
    assert ("position_damping", "rib_spine") in names, "offered on the elements of the model"
    assert (ranking[0]["effect"], ranking[0]["target"]) == ("coulomb_friction", "rib_spine")


def test_three_commands_lead_from_a_bag_to_a_lower_error():
    """What is missing and the error without and with it, as the README shows; that nothing else is; parameters."""
    assert [c.split()[2] for c in THREE] == ["diagnose", "diagnose", "estimate"]
    said = [
        subprocess.run(shlex.split(c), cwd=ROOT, check=True, capture_output=True, text=True, env=environment()).stdout
        for c in THREE
    ]
    assert said[0].startswith("effect missing: coulomb_friction on rib_spine")
    before, after, floor = _errors(said[0])
    assert (after < 1.1 * floor).all() and (after < 0.5 * before).all()
    assert_allclose(_errors(README), (before, after, floor), rtol=0.02)  # what it shows is what is printed
    assert said[1].startswith("adequate")
    assert "rib_spine.coulomb_friction" in said[2]


def _errors(text: str) -> np.ndarray:
    """(3, 4) RMS of the error in g as given, with the friction, and of noise: over all, and of each channel."""
    row = r"^(?:as given|\+ coulomb_friction on rib_spine|noise floor)" + 4 * r" +(\d+\.\d+)" + r"\b"
    return np.array(re.findall(row, text, re.M), float)
