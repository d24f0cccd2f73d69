"""Recordings with a hidden effect, and a diagnosis node in this process that is fed with them."""

import time
from collections.abc import Callable, Sequence
from functools import cache, partial

import numpy as np
import rclpy
import yaml
from crash_msgs.msg import Misfit, Ranking, Revision, Samples, TestInfo
from helpers_domain import own_domain
from helpers_other_process import OtherProcesses
from helpers_service import ask
from helpers_waiting import PATIENCE
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter

from crash_estimator.core.structure import Structure
from crash_estimator.model_file import ModelFile
from crash_estimator.nodes.diagnosis_node import DiagnosisNode
from crash_replay.bag import time_zero_ns
from crash_replay.qos import LATCHED, SAID, STREAM
from crash_replay.recording import Recording
from crash_replay.ros_messages import samples_to_msg, test_to_msg
from crash_replay.synthetic.hidden.cases import HiddenCase, draw_case

TOPICS = {"ranking": Ranking, "misfit": Misfit, "revisions": Revision}


@cache
def hidden_case(structure: str, effect: str, seed: int) -> tuple[HiddenCase, Structure, Recording]:
    """An effect ("": none) hidden in a structure, the model without it, and one recording at 1 g of noise."""
    case = draw_case(structure, [effect] if effect else [], seed)
    recording, _ = case.record(0.9, 1.0)
    return case, ModelFile(**yaml.safe_load(case.model_text)).structure(), recording


def so_far(recording: Recording, end: float) -> Recording:
    """The samples up to a time in s."""
    there = recording.time_ns <= round(end * 1e9)
    return Recording(recording.test, recording.time_ns[there], recording.values[there])


class Stage:
    """A replay's stand-in and listener, with diagnosis nodes."""

    def __init__(self):
        self.domain = own_domain()
        rclpy.init(domain_id=self.domain)
        self.executor = EventsExecutor()
        self.node = Node("stage")
        self.executor.add_node(self.node)
        self.test = self.node.create_publisher(TestInfo, "test", LATCHED)
        self.samples = self.node.create_publisher(Samples, "samples", STREAM)
        self.diagnoses: list[DiagnosisNode] = []
        self.heard: dict[str, dict[str, list]] = {}
        self.others = OtherProcesses(self.domain)

    def close(self) -> None:
        self.executor.shutdown()
        for node in (*self.diagnoses, self.node):
            node.destroy_node()
        self.others.close()
        rclpy.shutdown()

    def add_diagnosis(self, name: str = "diagnosis", **parameters) -> None:
        """Its subscription to the samples comes when its process is ready: `wait_for_listeners`."""
        overrides = [Parameter(key, value=value) for key, value in parameters.items()]
        node = DiagnosisNode(parameter_overrides=overrides, cli_args=["--ros-args", "-r", f"__node:={name}"])
        self.diagnoses.append(node)
        self.executor.add_node(node)
        self.heard[name] = {topic: [] for topic in TOPICS}
        for topic, kind in TOPICS.items():
            self.node.create_subscription(kind, f"{name}/{topic}", self.heard[name][topic].append, SAID)

    def wait_for_listeners(self) -> None:
        count = len(self.diagnoses)
        listening = self.samples.get_subscription_count
        self.spin_until(lambda: listening() == count, "the diagnosis subscribes")

    def spin_until(self, done: Callable[[], bool], what: str, patience: float = PATIENCE) -> None:
        deadline = time.monotonic() + patience
        while not done():
            assert time.monotonic() < deadline, f"waited {patience:g} s in vain until {what}"
            self.executor.spin_once(timeout_sec=0.02)

    def spin(self, seconds: float) -> None:
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            self.executor.spin_once(timeout_sec=0.02)

    def send_test(self, recording: Recording) -> None:
        self.test.publish(test_to_msg(recording))
        self.spin(0.1)

    def send(self, recording: Recording, start: int = 0, stop: int | None = None, block: int = 20, run: int = 0):
        stop, time_zero = len(recording) if stop is None else stop, time_zero_ns(recording)
        for first in range(start, stop, block):
            self.samples.publish(samples_to_msg(recording, first, min(first + block, stop), run, time_zero))
            self.executor.spin_once(timeout_sec=0.01)

    def wait_for_ranking(self, number: int, name: str = "diagnosis") -> None:
        """One that has used the sample of that number."""
        ranking = self.heard[name]["ranking"]
        self.spin_until(lambda: ranking and ranking[-1].number >= number, f"{name} has used sample {number}")

    def finals(self, name: str = "diagnosis") -> list[Ranking]:
        return [message for message in self.heard[name]["ranking"] if message.final]

    def wait_for_finals(self, count: int, name: str = "diagnosis") -> Ranking:
        self.spin_until(lambda: len(self.finals(name)) >= count, f"{name} has said {count} final answers")
        self.spin(0.05)
        return self.finals(name)[count - 1]

    def call(self, service: str, kind: type, **request):
        return ask(self.node, kind, service, partial(self.executor.spin_once, timeout_sec=0.02), **request)


def table(message: Revision, field: str) -> np.ndarray:
    return np.asarray(getattr(message, field)).reshape(len(message.time_ns), -1)


def joined(messages: Sequence[Revision], field: str) -> np.ndarray:
    return np.concatenate([table(message, field) for message in messages])
