"""The launch file against stand-ins for launch and launch_ros, which do not come as wheels."""

import runpy
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import get_origin

import pytest
from ruamel.yaml import YAML

from crash_estimator.core.methods import METHODS
from crash_replay.replay_parameters import PARAMETERS

PACKAGES = Path(__file__).resolve().parent.parent / "ros2_ws/src"
LAUNCH_FILE = PACKAGES / "crash_estimator/launch/live.launch.py"


class LaunchConfiguration:
    def __init__(self, name):
        self.name = name

    def value(self, given):
        return given[self.name]


class PythonExpression:
    def __init__(self, parts):
        self.parts = parts

    def value(self, given):
        return str(eval("".join(part if isinstance(part, str) else part.value(given) for part in self.parts)))


class LaunchContext:
    def __init__(self, given, is_shutdown=False):
        self.launch_configurations, self.is_shutdown = given, is_shutdown


class OnProcessExit:
    def __init__(self, *, target_action, on_exit):
        self.target_action, self.on_exit = target_action, on_exit


class RegisterEventHandler:
    def __init__(self, event_handler):
        self.event_handler = event_handler


class Shutdown:
    def __init__(self, *, reason):
        self.reason = reason


class EmitEvent:
    def __init__(self, *, event):
        self.event = event


class ParameterValue:
    def __init__(self, value, *, value_type):
        self.of, self.value_type = value, value_type

    def value(self, given):
        value = self.of.value(given)
        if get_origin(self.value_type) is list:
            value = YAML(typ="safe").load(value)
            assert isinstance(value, list) and all(isinstance(one, str) for one in value)
            return value
        return value.lower() == "true" if self.value_type is bool else self.value_type(value)


class IfCondition:
    def __init__(self, predicate):
        self.predicate = predicate

    def holds(self, given):
        return {"true": True, "1": True, "false": False, "0": False}[self.predicate.value(given).lower()]


class DeclareLaunchArgument:
    def __init__(self, name, *, default_value=None, description=None):
        self.name, self.default_value, self.description = name, default_value, description


class Node:
    def __init__(self, *, package, executable, output=None, parameters=(), condition=None):
        self.package, self.executable, self.parameters, self.condition = package, executable, parameters, condition

    def values(self, given):
        return {
            name: value.value(given) if hasattr(value, "value") else value
            for parameters in self.parameters
            for name, value in parameters.items()
        }


def stand_in(monkeypatch, name, **contents):
    module = ModuleType(name)
    vars(module).update(contents)
    monkeypatch.setitem(sys.modules, name, module)


@pytest.fixture
def entities(monkeypatch):
    """What the launch file describes."""
    stand_in(monkeypatch, "launch", LaunchDescription=list, LaunchContext=LaunchContext)
    actions = {one.__name__: one for one in (DeclareLaunchArgument, EmitEvent, RegisterEventHandler)}
    stand_in(monkeypatch, "launch.actions", **actions)
    stand_in(monkeypatch, "launch.conditions", IfCondition=IfCondition)
    stand_in(monkeypatch, "launch.event_handlers", OnProcessExit=OnProcessExit)
    stand_in(monkeypatch, "launch.events", Shutdown=Shutdown)
    stand_in(monkeypatch, "launch.events.process", ProcessExited=SimpleNamespace)
    stand_in(
        monkeypatch, "launch.substitutions", LaunchConfiguration=LaunchConfiguration, PythonExpression=PythonExpression
    )
    stand_in(monkeypatch, "launch_ros")
    stand_in(monkeypatch, "launch_ros.actions", Node=Node)
    stand_in(monkeypatch, "launch_ros.parameter_descriptions", ParameterValue=ParameterValue)
    return runpy.run_path(str(LAUNCH_FILE))["generate_launch_description"]()


@pytest.fixture
def launched(entities):
    """Launch with arguments name=text -> the nodes that are started, by executable."""
    arguments = [entity for entity in entities if isinstance(entity, DeclareLaunchArgument)]
    assert all(argument.description for argument in arguments)

    def launch(**given):
        defaults = {
            argument.name: argument.default_value for argument in arguments if argument.default_value is not None
        }
        needed = {argument.name for argument in arguments} - defaults.keys()
        assert needed == {"bag", "model"}
        values = defaults | given
        nodes = [entity for entity in entities if isinstance(entity, Node)]
        started = [node for node in nodes if node.condition is None or node.condition.holds(values)]
        return {node.executable: SimpleNamespace(package=node.package, **node.values(values)) for node in started}

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
    defaults = {one.name: one.default_value for one in entities if isinstance(one, DeclareLaunchArgument)}

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
        node = import_module(f"crash_estimator.nodes.{name}_node")
        assert set(vars(nodes[name])) - {"package"} <= set(node.PARAMETERS)


def test_the_executables_and_the_launch_file_are_installed(launched):
    nodes = launched(bag="b", model="m", diagnosis="true", record="e.mcap")
    for name, node in nodes.items():
        assert f'"{name} = {node.package}.' in (PACKAGES / node.package / "setup.py").read_text()
    assert 'glob("launch/*.launch.py")' in (PACKAGES / "crash_estimator/setup.py").read_text()
