"""Every command in the README is run here as it stands; `make test` is the one that runs this."""

import json
import os
import re
import shlex
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()
COMMANDS = [line for block in re.findall(r"```sh\n(.*?)```", README, re.S) for line in block.splitlines() if line]
LISTENING = [c for c in COMMANDS if any(node in c for node in ("crash_estimator viewer", "crash_estimator estimator", "crash_replay record"))]
REPLAY = [c for c in COMMANDS if "crash_replay replay" in c]
THREE = [c for c in COMMANDS if "hidden_effect" in c and "--effects" not in c]
ALONE = [c for c in COMMANDS if c not in ("make test", *LISTENING, *REPLAY, *THREE)]


def environment(domain: int) -> dict[str, str]:
    """Of a new user without a display, on a ROS domain of the test's own."""
    kept = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY", "MAKEFLAGS", "MAKELEVEL")}
    return kept | {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}


def needs_data(command: str) -> None:
    for word in re.findall(r"\.\./shared/data/\S+", command):
        if not (ROOT / word).exists():
            pytest.skip(f"{word} is not beside the project")


def test_the_first_two_commands_do_everything():
    assert COMMANDS[:2] == ["make demo", "make test"]
    assert "make test" in (ROOT / ".ci" / "run").read_text()


@pytest.mark.parametrize("command", ALONE)
def test_a_command_runs_as_it_stands(command):
    needs_data(command)
    if "out/camry.mcap --model" in command and not (ROOT / "out/camry.mcap").exists():  # by the command before it
        subprocess.run(shlex.split(ALONE[ALONE.index(command) - 1]), cwd=ROOT, check=True, capture_output=True)
    if "synthesize" in command:  # does not replace what is there
        (ROOT / "out" / "mine.mcap").unlink(missing_ok=True)
    done = subprocess.run(
        shlex.split(command), cwd=ROOT, env=environment(71), capture_output=True, text=True, timeout=240
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
    nodes = [
        subprocess.Popen(shlex.split(c), cwd=ROOT, env=environment(72), stdout=log, stderr=log)
        for c, log in zip(LISTENING, logs)
    ]
    try:
        replay = subprocess.run(
            [*shlex.split(REPLAY[0]), "-p", "wait_timeout:=120.0"],
            cwd=ROOT, env=environment(72), capture_output=True, text=True, timeout=200,
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
        subprocess.run(shlex.split(command), cwd=ROOT, check=True, capture_output=True, env=environment(71))
    ranking = json.loads(found.read_text())["ranking"]
    names = {(one["effect"], one["target"]): one for one in ranking}
    assert ("position_damping", "rib_spine") in names, "offered on the elements of the model"
    assert (ranking[0]["effect"], ranking[0]["target"]) == ("coulomb_friction", "rib_spine")


def test_three_commands_lead_from_a_bag_to_a_lower_error():
    """What the commands of the section print: the same errors, then what is missing, then smaller ones."""
    assert [c.split()[2] for c in THREE] == ["estimate", "diagnose", "estimate"]
    said = [
        subprocess.run(shlex.split(c), cwd=ROOT, check=True, capture_output=True, text=True, env=environment(71)).stdout
        for c in THREE
    ]
    assert said[1].startswith("effect missing: coulomb_friction on rib_spine")
    before, after = (_spread(text) for text in (said[0], said[2]))
    assert all(after[body] < 0.8 * before[body] for body in ("rib", "spine"))


def _spread(text: str) -> dict[str, float]:
    """Standard deviation of each equation's error, in g."""
    rows = re.findall(r"^(\w+) +g +\S+ +\S+ +\S+ +(\S+) +\S+%$", text, re.M)
    return {name: float(value) for name, value in rows}
