"""Replay and estimators in one process: each has its own parameters, and says the same as in a process of its own."""

import os
import subprocess
import sys

import pytest
from helpers_domain import own_domain
from helpers_paths import BAGS

from crash_estimator.nodes.composed import Usage, names_in, shared_out
from crash_replay.same_messages import messages_by_topic


def test_parameters_behind_a_name_go_to_that_node_and_files_to_all():
    words = ["composed", "a", "--ros-args", "-r", "__ns:=/s", "-p", "a:model:=m", "-p", "rate:=1.0"]
    words += ["--params-file", "f.yaml", "--param", "replay:bag:=b:c"]
    shared, own = shared_out(words, ["replay", "a"])
    assert shared == ["composed", "a", "--ros-args", "-r", "__ns:=/s", "-p", "rate:=1.0", "--params-file", "f.yaml"]
    named = {name: ["--ros-args", "-r", f"__node:={name}"] for name in ("replay", "a")}
    assert own["a"] == [*named["a"], "-p", "model:=m", "--params-file", "f.yaml"]
    assert own["replay"] == [*named["replay"], "--params-file", "f.yaml", "--param", "bag:=b:c"]


@pytest.mark.parametrize("names", [[], ["a", "a"], ["replay"], ["a b"], ["1a"]])
def test_names_that_are_none_are_refused(names):
    with pytest.raises(Usage, match="expected names of estimators, composed NAME .*; got"):
        names_in(names)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """(composed or not) -> what the estimators said of a replay in lock-step."""
    found = {}
    for composed in ("false", "true"):
        file = tmp_path_factory.mktemp("composed") / "said.mcap"
        given = {
            "bag": BAGS / "frontal_engine_cab.mcap", "model": "frontal_engine_cab", "lockstep": "true", "rate": "1.0",
            "estimators": "kalman constrained_kalman, quick mrls m=4", "viewer": "false", "exit_when_finished": "true",
            "namespace": "sled_a", "record": file, "composed": composed,
        }  # fmt: skip
        command = [sys.executable, "-m", "crash_estimator.chaos.launching", *(f"{k}:={v}" for k, v in given.items())]
        environment = os.environ | {"ROS_DOMAIN_ID": str(own_domain())}
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=200)
        assert done.returncode == 0 and ", complete" in done.stdout, done.stdout + done.stderr
        found[composed] = messages_by_topic(file)
    return found


def test_they_say_the_same_bytes_as_in_processes_of_their_own(recorded):
    topics = [f"/sled_a/{name}/{of}" for name in ("kalman", "quick") for of in ("block/parameters", "block/residuals")]
    for topic in [*topics, "/sled_a/samples", "/sled_a/kalman/forces", "/sled_a/kalman/events"]:
        assert recorded["true"][topic] == recorded["false"][topic] and recorded["true"][topic], topic
