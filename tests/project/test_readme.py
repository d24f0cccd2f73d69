"""Every command in the README is run here as it stands; `make test` is the one that runs this."""

import json
import re
import shlex
import subprocess

import numpy as np
import pytest
from conftest import NEEDS_A_GRAPH
from helpers_paths import ROOT
from helpers_readme import COMMANDS, README, environment, needs_data
from numpy.testing import assert_allclose

NODES = ("crash_estimator viewer", "crash_estimator estimator", "crash_replay record")
LISTENING = [c for c in COMMANDS if any(node in c for node in NODES)]
REPLAY = [c for c in COMMANDS if "crash_replay replay" in c]
THREE = [c for c in COMMANDS if "hidden_effect" in c and "--effects" not in c]
MAKE = [c for c in COMMANDS if c.startswith("make ")]  # test_readme_demo, and this
ALONE = [c for c in COMMANDS if c not in (*MAKE, *LISTENING, *REPLAY, *THREE)]


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


def test_the_nodes_find_each_other(tmp_path):
    assert len(LISTENING) == 3 and len(REPLAY) == 1
    written = [ROOT / "out" / "dummy.rrd", ROOT / "out" / "dummy_estimates.mcap"]
    for file in written:
        file.unlink(missing_ok=True)
        file.parent.mkdir(exist_ok=True)
    logs = [open(tmp_path / f"{k}.log", "w+") for k in range(3)]
    together = environment()
    nodes = [
        subprocess.Popen(shlex.split(c), cwd=ROOT, env=together, stdout=log, stderr=log)
        for c, log in zip(LISTENING, logs, strict=True)
    ]
    try:
        replay = subprocess.run(
            [*shlex.split(REPLAY[0]), "-p", "wait_timeout:=120.0"],
            cwd=ROOT, env=together, capture_output=True, text=True, timeout=200,
        )  # fmt: skip
        assert replay.returncode == 0, replay.stdout + replay.stderr
        assert "1201 samples sent" in replay.stdout
    finally:
        for node in nodes:
            node.terminate()
        statuses = [node.wait(30) for node in nodes]
    for log in logs:
        log.seek(0)
        text = log.read()
        log.close()
        assert "Traceback" not in text and "not seen" not in text, text
    assert statuses == [0, 0, 0]
    assert all(file.stat().st_size > 100_000 for file in written)


@pytest.mark.parametrize("name", sorted(set(re.findall(r"`(ros2_ws/src/[\w/]+|bags/[\w.]+)`", README))))
def test_every_path_that_is_named_is_there(name):
    assert (ROOT / name).exists()


def test_the_effect_that_is_shown_is_the_file_and_stands_in_the_ranking():
    (shown,) = re.findall(r"```python\n(.*?)```", README, re.S)
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
