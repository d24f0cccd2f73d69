"""500 tests, one after the other, and 500 passes of one test through nodes that stay: does any of them grow?"""

import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from crash_msgs.msg import Samples, TestInfo

from crash_replay.bag import read_bag
from crash_replay.qos import LATCHED, STREAM
from crash_replay.recording import Recording
from crash_replay.ros_messages import samples_to_msg, test_to_msg

from ..chaos.members import Member, children_of, node_command
from ..chaos.observer import Observer
from ..chaos.recordings import RECORDINGS, bag_of
from ..demo.domain import free_domain
from .methods import SETTLED, resident

PATIENCE = 300.0
"""s for the nodes to come, or to be through with a test."""
SHORTEST = 120
"""Samples of a test: one that goes on past the impact."""
BLOCK = 10
RECORDING = "frontal"


class Size(NamedTuple):
    """What a node and its children take of the machine."""

    memory: int  # bytes
    handles: int  # open files and sockets
    threads: int


class Grown(NamedTuple):
    node: str
    what: str  # tests | passes
    times: int
    settled: Size  # after SETTLED of them
    end: Size


class Graph:
    """Nodes as processes of their own, and somebody who hears how far they are."""

    def __init__(self, folder: Path, nodes: dict[str, list[str]]):
        folder.mkdir(parents=True, exist_ok=True)
        domain = free_domain()
        environment = os.environ | {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
        self.observer = Observer(domain, [])
        self.members = [
            Member(name, command, environment, folder / f"{name}.log", terminal=False)
            for name, command in nodes.items()
        ]

    def wait(self, done: Callable[[str], bool], names: Sequence[str], what: str) -> None:
        """Until something is so of each of these nodes."""
        if not self.observer.spin(PATIENCE, lambda: all(done(name) for name in names) or bool(self._ended())):
            late = ", ".join(name for name in names if not done(name))
            raise RuntimeError(f"waited {PATIENCE:g} s in vain until {what}: {late}")
        if ended := self._ended():
            raise RuntimeError(f"{', '.join(ended)} ended before {what}")

    def _ended(self) -> list[str]:
        return [member.name for member in self.members if member.status is not None]

    def sizes(self) -> dict[str, Size]:
        return {member.name: size_of(member.process.pid) for member in self.members}

    def close(self) -> None:
        for member in self.members:
            member.kill()
        self.observer.close()


@contextmanager
def graph(folder: Path, nodes: dict[str, list[str]]) -> Iterator[Graph]:
    made = Graph(folder, nodes)
    try:
        yield made
    finally:
        made.close()


def tests_in_a_row(out: Path, times: int) -> list[Grown]:
    """Tests of other lengths and names each time, sent by this process."""
    model = RECORDINGS[RECORDING].model
    nodes = {
        "kalman": node_command("crash_estimator", "estimator", "kalman", model=model),
        "diagnosis": node_command("crash_estimator", "diagnosis", model=model, every=1.0),
    }
    recording = read_bag(bag_of(RECORDING, out / "recordings"))
    with graph(out / "tests", nodes) as g:
        node, words = g.observer.node, g.observer.words
        test = node.create_publisher(TestInfo, "test", LATCHED)
        samples = node.create_publisher(Samples, "samples", STREAM)
        g.wait(lambda name: (word := words.word(f"/{name}")) is not None and word.ready, list(nodes), "all are ready")
        g.observer.spin(PATIENCE, lambda: samples.get_subscription_count() >= len(nodes))
        settled = {}
        for k in range(times):
            whole = SHORTEST + k % 7  # so that what is said of the test before is not taken for this one
            message = test_to_msg(recording)
            message.id, message.samples = f"test {k}", whole
            test.publish(message)
            g.observer.spin(0.02)
            _send(recording, whole, samples, g)
            through = lambda name, whole=whole: _is_through(words.word(f"/{name}"), whole)
            g.wait(through, list(nodes), f"test {k} is dealt with")
            if k == round(SETTLED * times):
                settled = g.sizes()
        end = g.sizes()
    return [Grown(name, "tests", times, settled[name], end[name]) for name in nodes]


def _send(recording: Recording, whole: int, samples, g: Graph) -> None:
    for start in range(0, whole, BLOCK):
        samples.publish(samples_to_msg(recording, start, min(start + BLOCK, whole), 0, 10**9))
        g.observer.executor.spin_once(timeout_sec=0.0)


def _is_through(word, whole: int) -> bool:
    return word is not None and word.done and word.total == whole and word.next == whole


def passes_in_a_row(out: Path, times: int) -> list[Grown]:
    """A replay that loops."""
    short = RECORDINGS[RECORDING]
    nodes = {
        "kalman": node_command("crash_estimator", "estimator", "kalman", model=short.model),
        "diagnosis": node_command("crash_estimator", "diagnosis", model=short.model, every=1.0),
        "replay": node_command(
            "crash_replay", "replay", bag=str(bag_of(RECORDING, out / "recordings")), loop=True, rate=1.0,
            listeners=["kalman", "diagnosis"], wait_timeout=PATIENCE,
        ),
    }  # fmt: skip
    with graph(out / "passes", nodes) as g:
        run = lambda: g.observer.state.run if g.observer.state else 0
        began = lambda _: run() >= round(SETTLED * times)
        g.wait(began, ["replay"], "the replay has made a tenth of its passes")
        settled, deadline = g.sizes(), time.monotonic() + PATIENCE
        while run() < times and time.monotonic() < deadline + times:
            g.wait(lambda _: True, ["replay"], "its passes")
            g.observer.spin(0.5)
        end = g.sizes()
    return [Grown(name, "passes", run(), settled[name], end[name]) for name in nodes]


def size_of(process: int) -> Size:
    family = [process, *children_of(process)]
    count = lambda folder: sum(len(list(Path(f"/proc/{one}/{folder}").glob("*"))) for one in family)
    return Size(sum(resident(one) for one in family), count("fd"), count("task"))
