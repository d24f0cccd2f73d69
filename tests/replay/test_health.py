"""What the nodes say of themselves on /diagnostics, and what they say it by."""

import subprocess
import time

import numpy as np
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from helpers_estimator_node import MODEL as OSCILLATOR
from helpers_nodes import BAG, end, environment, executable, node
from helpers_waiting import PATIENCE
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor

from crash_estimator.core.filter_health import covariance_health
from crash_replay.bag import read_bag
from crash_replay.health import Level

REPORTING = {"replay": "pace", "estimator": "filter", "diagnosis": "answers", "viewer": "queue"}


class Monitor:
    """Listens to /diagnostics as rqt_robot_monitor does."""

    def __init__(self, domain: int):
        self.context = Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.node = rclpy.create_node("monitor", context=self.context)
        self.said: dict[str, list[DiagnosticStatus]] = {}
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self._on_report, 100)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)

    def _on_report(self, message: DiagnosticArray) -> None:
        for status in message.status:
            self.said.setdefault(status.name, []).append(status)

    def wait_until(self, condition, patience: float = PATIENCE) -> None:
        limit = time.monotonic() + patience
        while not condition():
            assert time.monotonic() < limit, {name: said[-1] for name, said in self.said.items()}
            self.executor.spin_once(timeout_sec=0.1)

    def last(self, name: str) -> DiagnosticStatus | None:
        return self.said[name][-1] if name in self.said else None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


def level(status: DiagnosticStatus) -> Level:
    return Level(status.level[0])


def values(status: DiagnosticStatus) -> dict[str, str]:
    return {pair.key: pair.value for pair in status.values}


def test_every_node_says_how_it_fares_and_the_replay_what_rate_it_keeps(tmp_path):
    given = environment()
    quietly = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    soon = {"diagnosis": ["-p", "time_limit:=1.0"]}  # that it answers counts here, not what
    with Monitor(int(given["ROS_DOMAIN_ID"])) as monitor:
        processes = [
            subprocess.Popen([*node(name, tmp_path), *soon.get(name, [])], env=given, **quietly)
            for name in REPORTING
            if name != "replay"
        ]
        asked = (f"bag:={BAG}", "rate:=0.05", "listeners:=[estimator, diagnosis]", "keep_alive:=true")
        replay = [*executable("crash_replay", "replay"), "--ros-args", *(word for one in asked for word in ("-p", one))]
        processes.append(subprocess.Popen([*replay, "-p", f"wait_timeout:={PATIENCE}"], env=given, **quietly))
        try:
            monitor.wait_until(lambda: {f"{name}: {what}" for name, what in REPORTING.items()} <= monitor.said.keys())
            pace = lambda: monitor.last("replay: pace")  # noqa: E731
            monitor.wait_until(lambda: pace().message == "finished")
            answered = lambda: values(monitor.last("diagnosis: answers"))["last answer"].endswith("final")  # noqa: E731
            monitor.wait_until(answered, 5.0 * PATIENCE)  # the diagnosis steps back where others want the processor
        finally:
            end(processes)
    test = read_bag(BAG).test.id
    kept = [float(values(said)["rate kept"]) for said in monitor.said["replay: pace"] if said.message == "playing"]
    assert kept and max(kept) <= 0.05 * 1.01
    assert {said.hardware_id for said in monitor.said["replay: pace"]} == {test}
    followed = monitor.last("estimator: filter")
    assert (level(followed), followed.hardware_id, followed.message) == (Level.OK, test, "follows the samples")
    told = values(followed)
    assert told["next sample"] == told["samples of the test"] == "1701" and told["samples missing"] == "0"
    assert (told["estimates finite"], told["covariance positive"]) == ("yes", "yes")
    assert level(monitor.last("viewer: queue")) == Level.OK
    assert values(monitor.last("viewer: queue"))["messages left out"] == "0"


@pytest.fixture
def oscillator(tmp_path):
    file = tmp_path / "oscillator.yaml"
    file.write_text(OSCILLATOR)
    return file


def heard(stage, name: str, condition) -> DiagnosticStatus:
    """What a node of the stage says, once the condition holds of it."""
    said: list[DiagnosticStatus] = []
    stage.node.create_subscription(DiagnosticArray, "/diagnostics", lambda m: said.extend(m.status), 10)
    stage.spin_until(lambda: any(condition(s) for s in said if s.name.startswith(name)), f"{name} says it")
    return next(s for s in said if s.name.startswith(name) and condition(s))


def test_an_estimator_warns_of_samples_that_it_has_not_got(stage):
    recording = read_bag(BAG)
    stage.add_estimator("kalman", model="frontal_single")
    stage.send_test(recording)
    stage.send(recording, 0, 50)
    stage.send(recording, 60, 100)  # and nobody to ask for the others
    # at first it still asks for them
    said = heard(stage, "kalman: filter", lambda s: s.message.startswith("10 samples missing: "))
    assert level(said) == Level.WARN
    assert values(said)["samples missing"] == "10"


def test_an_estimator_that_a_test_does_not_fit_is_in_error_and_says_why(stage, oscillator):
    recording = read_bag(BAG)
    stage.add_estimator("kalman", model=str(oscillator))
    assert level(heard(stage, "kalman: filter", lambda s: s.message == "waits for a test")) == Level.OK
    stage.send_test(recording)
    said = heard(stage, "kalman: filter", lambda s: level(s) == Level.ERROR)
    assert said.message.startswith("stopped: ") and "block_ax" in said.message


class TestCovariance:
    def test_a_diagonal_one_has_the_condition_1_whatever_its_units(self):
        assert covariance_health(np.diag([1e12, 1e-6, 0.0])) == (True, True, 1.0)

    def test_two_parameters_that_cannot_be_told_apart_have_none(self):
        found = covariance_health(np.array([[1.0, 1e3], [1e3, 1e6]]))
        assert found.finite and found.positive and found.condition > 1e15

    def test_one_that_is_not_positive_is_found(self):
        assert not covariance_health(np.array([[1.0, 2.0], [2.0, 1.0]])).positive
        assert not covariance_health(np.diag([1.0, -1.0])).positive

    def test_one_that_is_not_finite_is_found(self):
        assert covariance_health(np.full((2, 2), np.nan))[:2] == (False, False)
