"""Estimator nodes in this process, on a ROS domain of their own, fed by a publisher of the test's own."""

import os
import signal
import subprocess
import sys
import time
from array import array
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import rclpy
from crash_msgs.msg import (
    EstimatorState,
    Event,
    Forces,
    ParametersBlock,
    ReplayState,
    ResidualsBlock,
    Samples,
    TestInfo,
)
from helpers_domain import own_domain
from helpers_other_process import OtherProcesses
from helpers_service import ask
from helpers_waiting import PATIENCE
from numpy.testing import assert_array_equal
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter

from crash_estimator.core.estimate import Estimate
from crash_estimator.core.fold import run
from crash_estimator.core.methods import make_estimator
from crash_estimator.model_file import load_model
from crash_estimator.nodes.estimator_node import EstimatorNode
from crash_replay.qos import EVERY_SAMPLE, LATCHED, STREAM
from crash_replay.recording import Recording
from crash_replay.ros_messages import samples_to_msg, test_to_msg

TIME_ZERO = 1_000_000_000
UNDAMPED = """
name: oscillator
bodies:
  block: {mass: 10, acceleration: block_ax}
  wall: {fixed: true}
elements:
  spring:
    between: [block, wall]
    stiffness: {estimate: true, initial: 1.0e4, min: 0.0}
    displacement: travel
    velocity: speed
"""
MODEL = f"{UNDAMPED}    damping: {{estimate: true, initial: 0.0, std: 100.0}}\n"
TOPICS = {"parameters": ParametersBlock, "residuals": ResidualsBlock, "forces": Forces, "events": Event}
BLOCKS = ("parameters", "residuals")
"""Those that are published below `block`."""


class Stage:
    """A replay's stand-in and listener, and the estimators it feeds."""

    def __init__(self):
        self.domain = own_domain()
        rclpy.init(domain_id=self.domain)
        self.executor = EventsExecutor()
        self.node = Node("stage")
        self.executor.add_node(self.node)
        self.test = self.node.create_publisher(TestInfo, "test", LATCHED)
        self.samples = self.node.create_publisher(Samples, "samples", STREAM)
        self.estimators: list[EstimatorNode] = []
        self.heard: dict[str, dict[str, list]] = {}
        self.processes: list[subprocess.Popen] = []
        self.replayed: list[ReplayState] = []
        self.others = OtherProcesses(self.domain)

    def close(self) -> None:
        for process in self.processes:
            process.send_signal(signal.SIGCONT)
            process.terminate()
            process.communicate(timeout=60)
        self.executor.shutdown()
        for node in (*self.estimators, self.node):
            node.destroy_node()
        self.others.close()
        rclpy.shutdown()

    def add_estimator(self, name: str = "estimator", **parameters) -> EstimatorNode:
        overrides = [Parameter(key, value=value) for key, value in parameters.items()]
        node = EstimatorNode(parameter_overrides=overrides, cli_args=["--ros-args", "-r", f"__node:={name}"])
        self.estimators.append(node)
        self.executor.add_node(node)
        self.listen(name)
        self.spin_until(
            lambda: self.samples.get_subscription_count() >= len(self.estimators), "the estimator subscribes"
        )
        out = [getattr(node.topics, topic) for topic in TOPICS]
        self.spin_until(lambda: all(p.get_subscription_count() for p in out), "somebody listens to the estimator")
        return node

    def spin_until(self, done: Callable[[], bool], what: str, patience: float = PATIENCE) -> None:
        deadline = time.monotonic() + patience
        while not done():
            assert time.monotonic() < deadline, f"waited {patience:g} s in vain until {what}"
            self.executor.spin_once(timeout_sec=0.02)

    def send_test(self, recording: Recording) -> None:
        self.test.publish(test_to_msg(recording))
        self.spin(0.1)

    def spin(self, seconds: float) -> None:
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            self.executor.spin_once(timeout_sec=0.02)

    def send(self, recording: Recording, start: int = 0, stop: int | None = None, block: int = 1, run: int = 0) -> None:
        """Samples start, ..., stop - 1, at the estimators' pace."""
        stop = len(recording) if stop is None else stop
        for first in range(start, stop, block):
            self.samples.publish(samples_to_msg(recording, first, min(first + block, stop), run, TIME_ZERO))
            self.executor.spin_once(timeout_sec=0.0)

    def replay(self, bag: Path, stderr: int | None = None, **parameters) -> subprocess.Popen:
        """Start the real replay, one sample a message."""
        self.node.create_subscription(ReplayState, "replay_state", self.replayed.append, LATCHED)
        return self.start("crash_replay.replay_node", stderr=stderr, bag=bag, **{"block": 1} | parameters)

    def listen_to_samples(self) -> None:
        """To be one whom a replay waits for, so that it does not begin before the stage has found all others."""
        self.node.create_subscription(Samples, "samples", lambda message: None, EVERY_SAMPLE)

    def wait_until_found(self, subscribers: int, patience: float = PATIENCE) -> None:
        """Until the replay has found so many of them; a command that comes before would end its waiting."""
        found = lambda: self.replayed and self.replayed[-1].subscribers == subscribers  # noqa: E731
        self.spin_until(found, f"the replay has found {subscribers} subscribers", patience)

    def start(self, module: str, name: str = "", stderr: int | None = None, **parameters) -> subprocess.Popen:
        """A node in a process of its own, ended with the stage."""
        command = [sys.executable, "-m", module, "--ros-args", *(["-r", f"__node:={name}"] if name else [])]
        for key, value in parameters.items():
            command += ["-p", f"{key}:={str(value).lower() if isinstance(value, bool) else value}"]
        environment = os.environ | {"ROS_DOMAIN_ID": str(self.domain)}
        piped = {"stdout": subprocess.DEVNULL, "stderr": stderr, "text": True}
        self.processes.append(subprocess.Popen(command, env=environment, **piped))
        return self.processes[-1]

    def listen(self, name: str) -> dict[str, list]:
        """To an estimator, under its name."""
        self.heard[name] = {topic: [] for topic in TOPICS}
        for topic, kind in TOPICS.items():
            self.node.create_subscription(
                kind, f"{name}/{'block/' * (topic in BLOCKS)}{topic}", self.heard[name][topic].append, STREAM
            )
        states = self.heard[name]["state"] = []
        self.node.create_subscription(EstimatorState, f"{name}/state", states.append, LATCHED)
        return self.heard[name]

    def call(self, kind: type, service: str, patience: float = PATIENCE, **request):
        """The response of a service."""
        look = partial(self.executor.spin_once, timeout_sec=0.02)
        return ask(self.node, kind, service, look, patience, **request)

    def wait_for(self, name: str, messages: int, patience: float = PATIENCE) -> dict[str, list]:
        """What was heard of an estimator, once it has said so much about parameters, residuals and forces."""
        heard = self.heard[name]
        topics = ("parameters", "residuals", "forces")
        self.spin_until(
            lambda: all(len(heard[topic]) >= messages for topic in topics),
            f"{messages} messages of {name} come",
            patience,
        )
        self.spin(0.05)
        return heard


def joined(messages: list, field: str) -> np.ndarray:
    """A field of all messages, (samples, width)."""
    width = len(getattr(messages[0], field)) // len(messages[0].time_ns)
    return np.concatenate([np.asarray(getattr(message, field)) for message in messages]).reshape(-1, width)


def empty_samples(number: int, values: list[float]) -> Samples:
    return Samples(number=number, time_ns=array("q", [0]), values=array("d", values))


def offline(model: str, recording: Recording, method: str, **settings) -> list[Estimate]:
    return run(make_estimator(load_model(model), recording.test, method, **settings), recording.samples())


def assert_same(heard: dict[str, list], estimates: list[Estimate]) -> None:
    """Every published number equals the loop's to the last bit (NaN where it is NaN)."""
    own = {
        "parameters": {"value": "parameters", "std": "std", "status": "status"},
        "residuals": {name: name for name in ("measured", "predicted", "innovation", "residual", "residual_std")},
        "forces": {
            name: name
            for name in ("crush", "rate", "force", "force_std", "state", "displacement", "velocity", "acceleration")
        },
    }
    for topic, fields in own.items():
        messages = heard[topic]
        assert_array_equal(joined(messages, "time_ns")[:, 0], [e.time_ns for e in estimates])
        for field, name in fields.items():
            assert_array_equal(joined(messages, field), [getattr(e, name) for e in estimates], err_msg=field)
    spread = [np.sqrt(np.diagonal(e.innovation_covariance)) for e in estimates]
    assert_array_equal(joined(heard["residuals"], "innovation_std"), spread)
    said = [(m.number, m.kind, m.target, m.value, m.text) for m in heard["events"]]
    assert said == [(e.number, *event) for e in estimates for event in e.events]
