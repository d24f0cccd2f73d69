"""The launch file against stand-ins for launch and launch_ros, which do not come as wheels."""

import runpy
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

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


class ParameterValue:
    def __init__(self, value, *, value_type):
        self.of, self.value_type = value, value_type

    def value(self, given):
        value = self.of.value(given)
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
def launched(monkeypatch):
    """Launch with arguments name=text -> the nodes that are started, by executable."""
    stand_in(monkeypatch, "launch", LaunchDescription=list)
    stand_in(monkeypatch, "launch.actions", DeclareLaunchArgument=DeclareLaunchArgument)
    stand_in(monkeypatch, "launch.conditions", IfCondition=IfCondition)
    stand_in(
        monkeypatch, "launch.substitutions", LaunchConfiguration=LaunchConfiguration, PythonExpression=PythonExpression
    )
    stand_in(monkeypatch, "launch_ros")
    stand_in(monkeypatch, "launch_ros.actions", Node=Node)
    stand_in(monkeypatch, "launch_ros.parameter_descriptions", ParameterValue=ParameterValue)
    entities = runpy.run_path(str(LAUNCH_FILE))["generate_launch_description"]()
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
    assert launched(bag="b", model="m")["replay"].wait_for == 2
    without = launched(bag="b", model="m", viewer="false", method="mrls")
    assert set(without) == {"replay", "estimator"}
    assert without["replay"].wait_for == 1 and without["estimator"].method == "mrls"


def test_the_diagnosis_is_started_where_it_is_asked_for_and_the_replay_waits_for_it_too(launched):
    nodes = launched(bag="b", model="m", diagnosis="true")
    assert nodes["diagnosis"].package == "crash_estimator" and nodes["diagnosis"].model == "m"
    assert nodes["replay"].wait_for == 3
    assert "diagnosis" not in launched(bag="b", model="m")


def test_what_is_estimated_is_recorded_where_a_file_is_named(launched):
    nodes = launched(bag="b", model="m", record="out/e.mcap", lockstep="true")
    assert (nodes["record"].package, nodes["record"].to) == ("crash_replay", "out/e.mcap")
    assert nodes["replay"].wait_for == 3
    assert (nodes["replay"].lockstep, nodes["replay"].loop, nodes["replay"].start_paused) == (True, False, False)
    assert "record" not in launched(bag="b", model="m")


def test_the_parameters_are_those_of_the_nodes(launched):
    nodes = launched(bag="b", model="m", diagnosis="true")
    assert set(vars(nodes["replay"])) - {"package"} <= set(PARAMETERS)
    for name in ("estimator", "diagnosis", "viewer"):
        source = (PACKAGES / f"crash_estimator/crash_estimator/nodes/{name}_node.py").read_text()
        for parameter in set(vars(nodes[name])) - {"package"}:
            assert f'_declared("{parameter}"' in source


def test_the_executables_and_the_launch_file_are_installed(launched):
    nodes = launched(bag="b", model="m", diagnosis="true", record="e.mcap")
    for name, node in nodes.items():
        assert f'"{name} = {node.package}.' in (PACKAGES / node.package / "setup.py").read_text()
    assert 'glob("launch/*.launch.py")' in (PACKAGES / "crash_estimator/setup.py").read_text()
