"""The launch file against stand-ins for launch and launch_ros, which do not come as wheels."""

import os
import subprocess
import sys
from importlib import import_module
from types import SimpleNamespace

import pytest
from helpers_paths import PACKAGES

from crash_estimator.chaos.launch_words import (
    DeclareLaunchArgument,
    LaunchContext,
    Node,
    RegisterEventHandler,
    arguments_of,
    described,
    started,
)
from crash_estimator.core.methods import METHODS
from crash_estimator.demo.domain import free_domain
from crash_replay.replay_command import PARAMETERS

BAG = PACKAGES.parents[1] / "bags/impactor_single.mcap"
LAUNCH_FILE = PACKAGES / "crash_estimator/launch/live.launch.py"


@pytest.fixture
def entities():
    """What the launch file describes."""
    return described(LAUNCH_FILE)


@pytest.fixture
def launched(entities):
    """Launch with arguments name=text -> the nodes that are started, by executable."""
    assert all(entity.description for entity in entities if isinstance(entity, DeclareLaunchArgument))
    defaults = arguments_of(entities)
    assert {name for name, value in defaults.items() if value is None} == {"bag", "model"}

    def launch(**given):
        values = defaults | given
        nodes = started(entities, values)
        return {node.executable: SimpleNamespace(package=node.package, **node.values(values)) for node in nodes}

    return launch


def test_replay_estimator_and_viewer_are_started_with_what_was_given(launched):
    nodes = launched(bag="a/1234", model="side_dummy", rate="1")
    assert {name: node.package for name, node in nodes.items()} == {
        "replay": "crash_replay",
        "estimator": "crash_estimator",
        "viewer": "crash_estimator",
    }
    replay, estimator, viewer = nodes["replay"], nodes["estimator"], nodes["viewer"]
    assert (replay.bag, replay.rate, type(replay.rate)) == ("a/1234", 1.0, float)
    assert (estimator.model, estimator.method) == ("side_dummy", "constrained_kalman")
    assert estimator.method in METHODS and viewer.rrd.endswith(".rrd")


def test_the_replay_waits_for_all_that_are_started(launched):
    assert launched(bag="b", model="m")["replay"].listeners == ["estimator", "viewer"]
    without = launched(bag="b", model="m", viewer="false", method="mrls")
    assert set(without) == {"replay", "estimator"}
    assert without["replay"].listeners == ["estimator"] and without["estimator"].method == "mrls"


def test_the_diagnosis_is_started_where_it_is_asked_for_and_the_replay_waits_for_it_too(launched):
    nodes = launched(bag="b", model="m", diagnosis="true")
    assert nodes["diagnosis"].package == "crash_estimator" and nodes["diagnosis"].model == "m"
    assert nodes["replay"].listeners == ["estimator", "viewer", "diagnosis"]
    assert "diagnosis" not in launched(bag="b", model="m")


def test_what_is_estimated_is_recorded_where_a_file_is_named(launched):
    nodes = launched(bag="b", model="m", record="out/e.mcap", lockstep="true")
    assert (nodes["record"].package, nodes["record"].to) == ("crash_replay", "out/e.mcap")
    assert nodes["replay"].listeners == ["estimator", "viewer", "record"]
    assert (nodes["replay"].lockstep, nodes["replay"].loop, nodes["replay"].start_paused) == (True, False, False)
    assert "record" not in launched(bag="b", model="m")


@pytest.fixture
def ends(entities):
    """ends(name, status, given) -> what the launch does when a member ends: None, or the reason to shut down."""
    handlers = {
        one.event_handler.target_action.executable: one.event_handler.on_exit
        for one in entities
        if isinstance(one, RegisterEventHandler)
    }
    defaults = arguments_of(entities)

    def end(name, status, is_shutdown=False, **given):
        context = LaunchContext(defaults | {"bag": "b", "model": "m"} | given, is_shutdown)
        done = handlers[name](SimpleNamespace(returncode=status), context)
        return done[0].event.reason if done else None

    return end


@pytest.mark.parametrize("name", ["replay", "estimator", "diagnosis", "viewer", "record"])
def test_a_member_that_fails_ends_the_launch_with_its_name(ends, name):
    with pytest.raises(Exception, match=f"{name} has ended with exit status 1; what it said stands above"):
        ends(name, 1)
    assert ends(name, 1, is_shutdown=True) is None, "it was told to end"


def test_an_estimator_has_no_reason_to_end_before_the_others(ends):
    with pytest.raises(Exception, match="estimator has ended with exit status 0"):
        ends("estimator", 0)


def test_estimator_and_viewer_stay_after_the_replay_unless_told_otherwise(ends):
    assert ends("replay", 0) is None and ends("viewer", 0) is None


def test_it_ends_by_itself_where_that_is_asked_for(ends, launched):
    asked = {"exit_when_finished": "true", "record": "e.mcap"}
    assert launched(bag="b", model="m", **asked)["viewer"].exit_when_finished is True
    assert ends("replay", 0, **asked) is None
    assert ends("viewer", 0, **asked) is None
    assert ends("record", 0, **asked) == "all is replayed, shown and recorded"


def test_without_viewer_and_record_it_ends_with_the_replay(ends):
    assert ends("replay", 0, exit_when_finished="1", viewer="false") == "all is replayed, shown and recorded"


def test_handlers_come_before_what_they_are_about(entities):
    kinds = [type(one) for one in entities]
    assert kinds.index(Node) > max(k for k, kind in enumerate(kinds) if kind is RegisterEventHandler)


def test_the_parameters_are_those_of_the_nodes(launched):
    nodes = launched(bag="b", model="m", diagnosis="true")
    assert set(vars(nodes["replay"])) - {"package"} <= set(PARAMETERS)
    for name in ("estimator", "diagnosis", "viewer"):
        node = import_module(f"crash_estimator.nodes.{name}_command")
        assert set(vars(nodes[name])) - {"package"} <= set(node.PARAMETERS)


def test_the_executables_and_the_launch_file_are_installed(launched):
    nodes = launched(bag="b", model="m", diagnosis="true", record="e.mcap")
    for name, node in nodes.items():
        assert f'"{name} = {node.package}.' in (PACKAGES / node.package / "setup.py").read_text()
    assert 'glob("launch/*.launch.py")' in (PACKAGES / "crash_estimator/setup.py").read_text()


def carried_out(folder, **given):
    """The launch with its processes -> status and what they said."""
    command = [sys.executable, "-m", "crash_estimator.chaos.launching", *(f"{k}:={v}" for k, v in given.items())]
    environment = os.environ | {"ROS_DOMAIN_ID": str(free_domain()), "PYTHONUNBUFFERED": "1"}
    ends = {"capture_output": True, "text": True, "timeout": 120.0}
    done = subprocess.run(command, cwd=folder, env=environment, **ends)
    return done.returncode, done.stdout + done.stderr


def test_carried_out_it_ends_by_itself(tmp_path):
    asked = {"viewer": "false", "exit_when_finished": "true", "rate": "0.5", "record": tmp_path / "e.mcap"}
    status, said = carried_out(tmp_path, bag=BAG, model="impactor_single", **asked)
    assert status == 0 and "e.mcap: " in said and ", complete" in said, said
    assert "shutdown: all is replayed, shown and recorded" in said and "Traceback" not in said


def test_carried_out_it_ends_with_who_fails(tmp_path):
    status, said = carried_out(tmp_path, bag=BAG, model="impactor_singel", viewer="false")
    assert status == 1 and "estimator has ended with exit status 1; what it said stands above" in said, said
    assert "did you mean 'impactor_single'?" in said and "Traceback" not in said
