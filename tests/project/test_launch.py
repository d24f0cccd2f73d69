"""The launch file against stand-ins for launch and launch_ros, which do not come as wheels."""

import json
import os
import subprocess
import sys
from importlib import import_module
from types import SimpleNamespace

import pytest
from helpers_domain import own_domain
from helpers_paths import PACKAGES
from mcap.reader import make_reader

from crash_estimator.chaos.launch_words import (
    DeclareLaunchArgument,
    LaunchContext,
    Node,
    RegisterEventHandler,
    arguments_of,
    carried_out,
    described,
)
from crash_estimator.core.methods import METHODS
from crash_replay.bag import read_bag
from crash_replay.replay_parameters import PARAMETERS

BAG = PACKAGES.parents[1] / "bags/impactor_single.mcap"
LAUNCH_FILE = PACKAGES / "crash_estimator/launch/live.launch.py"
NEEDED = {"bag": "b", "model": "m"}


@pytest.fixture
def entities():
    """What the launch file describes."""
    return described(LAUNCH_FILE)


@pytest.fixture
def launched(entities):
    """Launch with arguments name=text -> the nodes that are started, by name, with their parameters."""
    assert all(entity.description for entity in entities if isinstance(entity, DeclareLaunchArgument))
    defaults = arguments_of(entities)
    assert {name for name, value in defaults.items() if value is None} == {"bag", "model"}

    def launch(**given):
        found = carried_out(entities, LaunchContext(defaults | NEEDED | given))
        nodes = [one for one in found if isinstance(one, Node)]
        return {n.name or n.executable: SimpleNamespace(node=n, **n.parameters()) for n in nodes}

    return launch


def test_replay_estimator_and_viewer_are_started_with_what_was_given(launched):
    nodes = launched(bag="a/1234", model="side_dummy", rate="1", settings="forgetting=0.9 m=4", port="0")
    assert {name: one.node.package for name, one in nodes.items()} == {
        "replay": "crash_replay",
        "estimator": "crash_estimator",
        "viewer": "crash_estimator",
    }
    replay, estimator, viewer = nodes["replay"], nodes["estimator"], nodes["viewer"]
    assert (replay.bag, replay.rate, type(replay.rate), replay.clock) == ("a/1234", 1.0, float, "auto")
    assert (estimator.model, estimator.method) == ("side_dummy", "constrained_kalman")
    assert (vars(estimator)["settings.forgetting"], vars(estimator)["settings.m"]) == (0.9, 4)
    assert estimator.method in METHODS and (viewer.rrd, viewer.port) == ("crash.rrd", 0)


def test_the_replay_waits_for_all_that_are_started(launched):
    assert launched()["replay"].listeners == ["estimator", "viewer"]
    without = launched(viewer="false", method="mrls")
    assert set(without) == {"replay", "estimator"}
    assert without["replay"].listeners == ["estimator"] and without["estimator"].method == "mrls"


def test_several_estimators_each_with_its_settings(launched):
    nodes = launched(estimators="kalman constrained_kalman,  quick  mrls forgetting=0.8 m=4", record="e.mcap")
    assert set(nodes) == {"replay", "kalman", "quick", "viewer", "record"}
    assert nodes["kalman"].method == "constrained_kalman" and "settings.m" not in vars(nodes["kalman"])
    quick = vars(nodes["quick"])
    assert (quick["method"], quick["settings.forgetting"], quick["settings.m"]) == ("mrls", 0.8, 4)
    assert nodes["replay"].listeners == ["kalman", "quick", "viewer", "record"] and nodes["record"].wait_for == 2


@pytest.mark.parametrize("wrong", ["kalman", "a mrls, a mrls", "a mrls forgetting", "a mrls,", "1a mrls"])
def test_estimators_that_are_none_are_refused(launched, wrong):
    with pytest.raises(Exception, match=f"must make NAME METHOD .*, separated by commas, .*got '{wrong}'"):
        launched(estimators=wrong)


def test_a_number_that_is_none_is_refused(launched):
    with pytest.raises(Exception, match="rate must be a number, got 'fast'"):
        launched(rate="fast")


def test_all_are_in_the_namespace_and_read_the_file_of_parameters_last(launched):
    nodes = launched(namespace="/sled_a", params_file="my.yaml", diagnosis="true", record="e.mcap")
    assert len(nodes) == 5
    assert {one.node.namespace for one in nodes.values()} == {"/sled_a"}
    assert all(one.node.ros_arguments[-2:] == ["--params-file", "my.yaml"] for one in nodes.values())
    assert all("--params-file" not in one.node.ros_arguments for one in launched().values())


def test_two_sleds_do_not_write_one_file(launched):
    assert launched(namespace="/lab/sled_a")["viewer"].rrd == "lab-sled_a.rrd"
    assert launched(namespace="sled_a", rrd="mine.rrd")["viewer"].rrd == "mine.rrd"


def test_composed_replay_and_estimators_are_one_process_with_the_same_parameters(launched):
    asked = {"estimators": "kalman constrained_kalman, quick mrls m=4", "diagnosis": "true", "namespace": "sled_a"}
    apart, together = launched(**asked), launched(**asked, composed="true")
    assert set(together) == {"composed", "viewer", "diagnosis"}
    node = together["composed"].node
    assert (node.name, node.namespace, node.arguments) == (None, "sled_a", ["kalman", "quick"])
    expected = {f"{n}:{k}": v for n in ("replay", "kalman", "quick") for k, v in apart[n].node.parameters().items()}
    assert node.parameters() == expected


def test_the_diagnosis_is_started_where_it_is_asked_for_and_the_replay_waits_for_it_too(launched):
    nodes = launched(diagnosis="true")
    assert nodes["diagnosis"].node.package == "crash_estimator" and nodes["diagnosis"].model == "m"
    assert nodes["replay"].listeners == ["estimator", "viewer", "diagnosis"]
    assert "diagnosis" not in launched()


def test_what_is_estimated_is_recorded_where_a_file_is_named(launched):
    nodes = launched(record="out/e.mcap", lockstep="true")
    assert (nodes["record"].node.package, nodes["record"].to) == ("crash_replay", "out/e.mcap")
    assert nodes["replay"].listeners == ["estimator", "viewer", "record"]
    assert (nodes["replay"].lockstep, nodes["replay"].loop, nodes["replay"].start_paused) == (True, False, False)
    assert "record" not in launched()


@pytest.fixture
def ends(entities):
    """ends(given) -> end(name, status): what the launch does when a member ends: None, or the reason to shut down."""

    def launch(**given):
        context = LaunchContext(arguments_of(entities) | NEEDED | given)
        found = carried_out(entities, context)
        handlers = {
            one.event_handler.target_action.name: one.event_handler.on_exit
            for one in found
            if isinstance(one, RegisterEventHandler)
        }

        def end(name, status, is_shutdown=False):
            context.is_shutdown = is_shutdown
            done = handlers[name](SimpleNamespace(returncode=status), context)
            return done[0].event.reason if done else None

        return end

    return launch


ALL = {"diagnosis": "true", "record": "e.mcap"}
THROUGH = "all is replayed, shown and recorded"


@pytest.mark.parametrize("name", ["replay", "estimator", "diagnosis", "viewer", "record"])
def test_a_member_that_fails_ends_the_launch_with_its_name(ends, name):
    end = ends(**ALL)
    with pytest.raises(Exception, match=f"{name} has ended with exit status 1; what it said stands above"):
        end(name, 1)
    assert end(name, 1, is_shutdown=True) is None, "it was told to end"


def test_an_estimator_has_no_reason_to_end_before_the_others(ends):
    with pytest.raises(Exception, match="quick has ended with exit status 0"):
        ends(estimators="quick mrls")("quick", 0)


def test_estimator_and_viewer_stay_after_the_replay_unless_told_otherwise(ends):
    end = ends()
    assert end("replay", 0) is None and end("viewer", 0) is None


def test_it_ends_by_itself_where_that_is_asked_for(ends, launched):
    asked = {"exit_when_finished": "true", "record": "e.mcap"}
    assert launched(**asked)["viewer"].exit_when_finished is True
    end = ends(**asked)
    assert [end(name, 0) for name in ("replay", "viewer", "record")] == [None, None, THROUGH]


def test_without_viewer_and_record_it_ends_with_the_replay(ends):
    assert ends(exit_when_finished="1", viewer="false")("replay", 0) == THROUGH


def test_a_handler_comes_before_what_it_is_about(entities):
    found = carried_out(entities, LaunchContext(arguments_of(entities) | NEEDED | ALL))
    assert len(found) == 10
    assert all(h.event_handler.target_action is node for h, node in zip(found[::2], found[1::2]))


def test_the_parameters_are_those_of_the_nodes(launched):
    nodes = launched(diagnosis="true", settings="m=4")
    assert set(nodes["replay"].node.parameters()) <= set(PARAMETERS)
    for name in ("estimator", "diagnosis", "viewer"):
        node = import_module(f"crash_estimator.nodes.{name}_parameters")
        assert set(nodes[name].node.parameters()) <= {*node.PARAMETERS, "settings.m"}


def test_the_executables_and_the_launch_file_are_installed(launched):
    for one in [*launched(**ALL).values(), *launched(composed="true").values()]:
        node = one.node
        assert f'"{node.executable} = {node.package}.' in (PACKAGES / node.package / "setup.py").read_text()
    assert 'glob("launch/*.launch.py")' in (PACKAGES / "crash_estimator/setup.py").read_text()


def as_processes(folder, **given):
    """The launch with its processes -> status and what they said."""
    command = [sys.executable, "-m", "crash_estimator.chaos.launching", *(f"{k}:={v}" for k, v in given.items())]
    environment = os.environ | {"ROS_DOMAIN_ID": str(own_domain()), "PYTHONUNBUFFERED": "1"}
    ends = {"capture_output": True, "text": True, "timeout": 120.0}
    done = subprocess.run(command, cwd=folder, env=environment, **ends)
    return done.returncode, done.stdout + done.stderr


BY_ITSELF = {"bag": BAG, "model": "impactor_single", "viewer": "false", "exit_when_finished": "true", "rate": "0.5"}


@pytest.mark.parametrize("composed", ["false", "true"])
def test_carried_out_it_ends_by_itself(tmp_path, composed):
    """In a namespace, with two estimators, one of which has its method from a file."""
    file = {"/**/quick": {"ros__parameters": {"method": "rls"}}}
    (tmp_path / "my.yaml").write_text(json.dumps(file))
    asked = {"namespace": "sled_a", "estimators": "kalman kalman, quick mrls", "params_file": "my.yaml"}
    status, said = as_processes(tmp_path, **BY_ITSELF, **asked, record=tmp_path / "e.mcap", composed=composed)
    assert status == 0 and "e.mcap: " in said and ", complete" in said, said
    assert f"shutdown: {THROUGH}" in said and "Traceback" not in said
    assert "quick]: test impactor_single: model impactor_single, method rls" in said
    assert "kalman]: test impactor_single: model impactor_single, method kalman" in said
    with (tmp_path / "e.mcap").open("rb") as stream:
        topics = {channel.topic for channel in make_reader(stream).get_summary().channels.values()}
    assert {"/sled_a/samples", "/sled_a/kalman/block/parameters", "/sled_a/quick/block/parameters"} <= topics
    assert len(read_bag(tmp_path / "e.mcap")) == len(read_bag(BAG))


def test_carried_out_it_ends_with_who_fails(tmp_path):
    status, said = as_processes(tmp_path, bag=BAG, model="impactor_singel", viewer="false")
    assert status == 1 and "estimator has ended with exit status 1; what it said stands above" in said, said
    assert "did you mean 'impactor_single'?" in said and "Traceback" not in said
