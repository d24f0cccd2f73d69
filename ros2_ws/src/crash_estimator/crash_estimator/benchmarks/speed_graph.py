"""Replay, estimators and a listener as processes of their own, and a bare relay in the estimators' place."""

import re
import sys
import threading
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import rclpy
from crash_msgs.msg import Parameters, ParametersBlock, Residuals, ResidualsBlock, Samples, TestInfo
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from std_srvs.srv import Trigger

from crash_replay.middleware import prepare_middleware
from crash_replay.qos import EVERY_SAMPLE, LATCHED, STREAM
from crash_replay.recording import Recording
from crash_replay.ros_messages import samples_to_msg, test_to_msg

from ..demo.children import Child, Children

PATIENCE = 60.0
"""s for a node to come; the first one may have to compile."""
TOPICS = {"block/parameters": ParametersBlock, "block/residuals": ResidualsBlock}
"""What an estimator says of every sample, whoever listens."""
SENT = re.compile(r"(\d+) samples sent in (\d+) messages, rate ([\d.e+-]+) of")


class Pass(NamedTuple):
    """What came of one replay."""

    sent: int  # samples
    messages: int
    rate: float  # times real time that the replay kept
    heard: tuple[int, ...]  # samples that each node has told parameters and residuals of
    seconds: float  # from the first of them to the last

    @property
    def lost(self) -> int:
        return sum(self.sent - heard for heard in self.heard)

    @property
    def per_second(self) -> float:
        return min(self.heard) / self.seconds if self.seconds else 0.0


class Listener(Node):
    """Counts what the nodes say of samples; keeps when they said it."""

    def __init__(self, names: Sequence[str]):
        super().__init__("listener")
        self.counts = {name: dict.fromkeys(TOPICS, 0) for name in names}
        self.first = self.last = 0.0
        self.arrival: dict[int, float] = {}  # number -> when the parameters came
        self.by_name = {"parameters": 0, "residuals": 0}  # messages of the named form
        for name in names:
            for topic, kind in TOPICS.items():
                take = lambda message, name=name, topic=topic: self._take(name, topic, message)  # noqa: E731
                self.create_subscription(kind, f"{name}/{topic}", take, EVERY_SAMPLE)

    def hear_by_name(self) -> None:
        """What is said by name, too: it counts, and does not change when the last of the blocks came."""
        for name in self.counts:
            for topic, kind in (("parameters", Parameters), ("residuals", Residuals)):
                self.create_subscription(kind, f"{name}/{topic}", partial(self._count, topic), EVERY_SAMPLE)

    def _count(self, topic: str, _: Parameters | Residuals) -> None:
        self.by_name[topic] += 1

    def _take(self, name: str, topic: str, message: ParametersBlock | ResidualsBlock) -> None:
        self.last = time.perf_counter()
        self.first = self.first or self.last
        self.counts[name][topic] += len(message.time_ns)
        if topic == "block/parameters":
            self.arrival[message.number] = self.last

    @property
    def heard(self) -> tuple[int, ...]:
        return tuple(min(count.values()) for count in self.counts.values())

    def publishers_found(self) -> int:
        return sum(self.count_publishers(f"/{name}/{topic}") for name in self.counts for topic in self.counts[name])


class Graph:
    """A context: children and a listener on one ROS domain."""

    def __init__(self, folder: Path, environment: dict[str, str], names: Sequence[str]):
        self.children, self.names = Children(folder, environment), names
        self.listener = Listener(names)
        self.executor = EventsExecutor()
        self.executor.add_node(self.listener)

    def __enter__(self) -> "Graph":
        return self

    def __exit__(self, *_) -> None:
        # The listener goes first: a participant that ends while it hears others leave has crashed the process.
        self.executor.shutdown()
        self.listener.destroy_node()
        self.children.__exit__()

    def estimator(self, name: str, model: Path | str, method: str) -> None:
        self.children.start(name, "crash_estimator", "estimator", node=name, model=str(model), method=method)

    def relay(self, name: str, **sizes: int) -> None:
        command = [sys.executable, "-m", "crash_estimator.benchmarks.speed_relay"]
        command += ["--ros-args", "-r", f"__node:={name}"]
        for key, value in sizes.items():
            command += ["-p", f"{key}:={value}"]
        log = self.children.logs / f"{name}.log"
        self.children.all[name] = Child(name, command, log, self.children.environment)

    def settle(self) -> None:
        """Until every node that is to speak has its publishers found."""
        self.spin_until(lambda: self.listener.publishers_found() >= 2 * len(self.names), "the nodes speak")
        self.spin(0.3)

    def spin(self, seconds: float) -> None:
        deadline = time.perf_counter() + seconds
        while (left := deadline - time.perf_counter()) > 0:
            self.executor.spin_once(timeout_sec=min(left, 0.1))

    def spin_until(self, done: Callable[[], bool], what: str, patience: float = PATIENCE) -> None:
        deadline = time.perf_counter() + patience
        while not done():
            for child in self.children.all.values():
                if child.status is not None:
                    raise RuntimeError(f"waiting until {what}: {child.name} has ended: {child.last_words()}")
            if time.perf_counter() > deadline:
                raise RuntimeError(f"waited {patience:g} s in vain until {what}; the logs are in {self.children.logs}")
            self.executor.spin_once(timeout_sec=0.05)

    def replay(self, bag: Path, listeners: int, seconds: float = 0.0, **parameters) -> Pass:
        """One pass over the bag or, with `seconds`, passes for so long."""
        listener = self.listener
        listener.first = 0.0
        before = listener.heard
        parameters |= {"loop": True} if seconds else {}
        parameters |= {"wait_for": listeners, "wait_timeout": PATIENCE, "progress": "false", "keyboard": "false"}
        child = self.children.start("replay", "crash_replay", "replay", bag=str(bag), **parameters)
        if seconds:
            self.spin_until(lambda: listener.first > 0.0, "the first sample comes")
            self.spin(seconds)
            self._let_it_arrive()
            child.process.terminate()
        deadline = time.perf_counter() + 4.0 * PATIENCE
        while child.status is None and time.perf_counter() < deadline:
            self.executor.spin_once(timeout_sec=0.05)
        sent = SENT.search(child.last_line())
        if not sent:
            raise RuntimeError(f"replay: {child.last_words()}")
        quiet = time.perf_counter()
        while self._missing(before, int(sent[1])) and time.perf_counter() < max(quiet, listener.last) + 2.0:
            self.executor.spin_once(timeout_sec=0.05)
        heard = tuple(now - then for now, then in zip(listener.heard, before))
        del self.children.all["replay"]
        return Pass(int(sent[1]), int(sent[2]), float(sent[3]), heard, listener.last - listener.first)

    def _let_it_arrive(self) -> None:
        """Pause the replay until nothing more comes: one that is ended leaves what is on its way."""
        client = self.listener.create_client(Trigger, "replay/pause")
        self.spin_until(client.service_is_ready, "the replay can be paused")
        answer = client.call_async(Trigger.Request())
        self.spin_until(lambda: answer.done() and time.perf_counter() > self.listener.last + 1.0, "all has come")
        self.listener.destroy_client(client)

    def _missing(self, before: Sequence[int], sent: int) -> bool:
        return any(now - then < sent for now, then in zip(self.listener.heard, before))


def latencies(graph: Graph, recording: Recording, rate: float, samples: int) -> np.ndarray:
    """s from publishing each of the first samples, one a message, to the arrival of its parameters."""
    node = Node("sender")
    test = node.create_publisher(TestInfo, "test", LATCHED)
    out = node.create_publisher(Samples, "samples", STREAM)
    test.publish(test_to_msg(recording))
    graph.spin_until(lambda: out.get_subscription_count() >= len(graph.names), "the nodes listen")
    graph.spin(0.5)
    messages = [samples_to_msg(recording, k, k + 1, 0, 10**9) for k in range(samples)]
    graph.listener.arrival.clear()
    sent, stop = np.zeros(samples), threading.Event()
    listening = threading.Thread(target=_listen, args=(graph.executor, stop))
    listening.start()
    start = time.perf_counter() + 0.01
    for k, message in enumerate(messages):
        if (left := start + k / rate - time.perf_counter()) > 0:
            time.sleep(left)
        sent[k] = time.perf_counter()
        out.publish(message)
    time.sleep(0.5)
    stop.set()
    listening.join()
    node.destroy_node()
    arrival = graph.listener.arrival
    return np.array([arrival.get(k, np.inf) - sent[k] for k in range(samples)])


def _listen(executor: Executor, stop: threading.Event) -> None:
    while not stop.is_set():
        executor.spin_once(timeout_sec=0.05)


class Arrivals(Node):
    """When each message on `samples` was published, as the middleware's writer has stamped it, and when it came."""

    def __init__(self):
        super().__init__("arrivals")
        self.published: list[float] = []
        self.came: list[float] = []
        self.create_subscription(Samples, "samples", self._take, EVERY_SAMPLE)

    def _take(self, _: Samples, info: dict) -> None:
        self.came.append(time.perf_counter())
        self.published.append(info["source_timestamp"] * 1e-9)


class Jitter(NamedTuple):
    """s by which each sample of a paced replay was off its even beat."""

    published: np.ndarray
    came: np.ndarray


def jitter(folder: Path, environment: dict[str, str], bag: Path, period: float) -> Jitter:
    executor, node = SingleThreadedExecutor(), Arrivals()  # rclpy 7.1: EventsExecutor gives no message's information
    executor.add_node(node)
    with Children(folder, environment) as children:
        child = children.start(
            "replay", "crash_replay", "replay", bag=str(bag), wait_for=1, block=1, progress="false", keyboard="false"
        )
        while child.status is None:
            executor.spin_once(timeout_sec=0.05)
    executor.shutdown()
    node.destroy_node()
    return Jitter(_off_beat(node.published, period), _off_beat(node.came, period))


def _off_beat(times: Sequence[float], period: float) -> np.ndarray:
    off = np.array(times) - times[0] - period * np.arange(len(times))
    return np.abs(off - np.median(off))


def start_ros(environment: dict[str, str]) -> None:
    prepare_middleware()
    rclpy.init(domain_id=int(environment["ROS_DOMAIN_ID"]))
