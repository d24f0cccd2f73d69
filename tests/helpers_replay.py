"""A replay in a process of its own, and a node in this one that listens to it and gives it commands."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from functools import partial
from tempfile import TemporaryFile
from threading import Thread

import numpy as np
import rclpy
from crash_msgs.msg import ReplayState, Samples, TestInfo
from helpers_domain import own_domain
from helpers_service import ask
from helpers_waiting import PATIENCE
from rclpy.context import Context
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.task import Future

from crash_replay.middleware import prepare_middleware
from crash_replay.qos import EVERY_SAMPLE, LATCHED
from crash_replay.recording import Channel, Recording, Test
from crash_replay.ros_messages import samples_from_msg
from crash_replay.ros_runtime import spin

LOOK = partial(time.sleep, 0.002)
"""s between two looks at whether something has come."""

DOMAIN = own_domain()
"""Other tests, and other people's nodes, must not hear us: each test process has a domain."""


def some_recording(n: int = 40, period_ns: int = 1_000_000, before: int = 10, seed: int = 5) -> Recording:
    """Random values of every quantity, one of them missing."""
    channels = (
        Channel("rib_ay", "acceleration", "rib", "y", "column 2"),
        Channel("barrier_fx", "force", "barrier", "x"),
        Channel("nose_travel", "displacement"),
        Channel("rib_vy", "velocity", "rib", "y"),
        Channel("neck_mz", "moment", "neck", "z"),
        Channel("head_wx", "angular_velocity", "head", "x"),
    )
    values = np.random.default_rng(seed).standard_normal((n, len(channels)))
    values[3, 1] = np.nan
    test = Test("T7", channels, "A title", "a source", {"rib": 1.5}, {"door": -0.02}, ("a note", "another"))
    return Recording(test, (np.arange(n, dtype=np.int64) - before) * period_ns, values)


def environment() -> dict[str, str]:
    return {**os.environ, "ROS_DOMAIN_ID": str(DOMAIN)}


def as_arguments(remap: Sequence[str] = (), **parameters) -> list[str]:
    """Of a node's command line."""
    words = ["--ros-args", *(word for rule in remap for word in ("-r", rule))]
    for name, value in parameters.items():
        shown = [str(one) for one in value] if isinstance(value, list) else value
        words += ["-p", f"{name}:={str(shown).lower() if isinstance(shown, bool) else shown}"]
    return words


class OfTheTest:
    """A process that ends with the test."""

    process: subprocess.Popen

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()  # nothing, where it has ended
        for pipe in (self.process.stdout, self.process.stderr):
            if pipe:
                pipe.close()
        self.process.wait()


class Replay(OfTheTest):
    """`replay` on a bag, with its output."""

    def __init__(self, bag=None, remap: Sequence[str] = (), **parameters):
        """remap: such as __ns:=/sled_a."""
        command = [sys.executable, "-m", "crash_replay.replay_node"]
        command += as_arguments(remap, **({"bag": bag} if bag else {}), **parameters)
        self.errors = TemporaryFile()  # noqa: SIM115, closed when the process has ended
        pipes = {"stdout": subprocess.PIPE, "stderr": self.errors}
        self.process = subprocess.Popen(command, env=environment(), text=True, **pipes)

    def __exit__(self, *_):
        super().__exit__()
        self.errors.close()

    def errors_so_far(self) -> str:
        return os.pread(self.errors.fileno(), 1_000_000, 0).decode()

    def end(self, timeout: float = PATIENCE) -> tuple[int, str, str]:
        output, _ = self.process.communicate(timeout=timeout)
        errors = self.errors_so_far()
        self.errors.close()
        return self.process.returncode, output, errors

    def interrupt(self) -> tuple[int, str, str]:
        self.process.send_signal(signal.SIGINT)
        return self.end()


class Listener:
    """Hears the replay's `test`, `samples` and `replay_state`; takes nothing for `stall` s after the first sample."""

    def __init__(self, name: str = "listener", stall: float = 0.0, namespace: str = ""):
        prepare_middleware()
        self.context = Context()
        rclpy.init(context=self.context, domain_id=DOMAIN)
        self.node = Node(name, namespace=namespace, context=self.context, start_parameter_services=False)
        self.tests: list[TestInfo] = []
        self.messages: list[Samples] = []
        self.states: list[ReplayState] = []
        self.stall = stall
        self.listen(TestInfo, "test", self.tests.append, LATCHED)
        self.listen(Samples, "samples", self._on_samples, EVERY_SAMPLE)
        self.listen(ReplayState, "replay_state", self.states.append, LATCHED)
        self.executor, self.done = EventsExecutor(context=self.context), Future()
        self.executor.add_node(self.node)
        self.thread = Thread(target=spin, args=(self.executor, self.done))
        self.thread.start()

    def listen(self, message_type, topic, callback, qos):
        self.node.create_subscription(message_type, topic, callback, qos)

    def _on_samples(self, message: Samples) -> None:
        self.messages.append(message)
        if len(self.messages) == 1:
            time.sleep(self.stall)

    def samples(self) -> list:
        return [sample for message in self.messages for sample in samples_from_msg(message)]

    def numbers(self) -> list[tuple[int, int]]:
        """(run, number) of each sample heard."""
        return [(m.run, m.number + k) for m in self.messages for k in range(len(m.time_ns))]

    def call(self, service_type, name: str, **request):
        return ask(self.node, service_type, f"replay/{name}", LOOK, **request)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.done.set_result(None)
        self.executor.wake()
        self.thread.join()
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


def wait_until(condition, timeout: float = PATIENCE) -> None:
    limit = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < limit, "waited in vain"
        LOOK()
