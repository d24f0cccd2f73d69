"""500 tests, one after the other, and 500 passes of one test through nodes that stay: does any of them grow?"""

import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from crash_msgs.msg import ReplayState, Samples, TestInfo

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
PATIENT = {"viewer", "record"}
"""Who says a second after the last message that it was the last: they are waited for only every so many tests."""
EVERY = 10
SERVED = "4MB"
"""What the viewer keeps for screens that come late: reached long before the memory must be what it stays."""


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


def commands(folder: Path) -> dict[str, list[str]]:
    """Of all that listen to a replay, by their names; what viewer and record write is in the folder, made anew."""
    model, recorded = RECORDINGS[RECORDING].model, folder / "record.mcap"
    recorded.unlink(missing_ok=True)
    picture: dict[str, Any] = {"rrd": str(folder / "viewer.rrd"), "open": False, "port": 0, "memory_limit": SERVED}
    return {
        "kalman": node_command("crash_estimator", "estimator", "kalman", model=model),
        "diagnosis": node_command("crash_estimator", "diagnosis", model=model, every=1.0),
        "viewer": node_command("crash_estimator", "viewer", **picture),
        "record": node_command("crash_replay", "record", to=str(recorded)),
    }


def tests_in_a_row(out: Path, times: int) -> list[Grown]:
    """Tests of other lengths and names each time, sent by this process."""
    nodes = commands(out / "tests")
    recording = read_bag(bag_of(RECORDING, out / "recordings"))
    with graph(out / "tests", nodes) as g:
        node, words = g.observer.node, g.observer.words
        test = node.create_publisher(TestInfo, "test", LATCHED)
        samples = node.create_publisher(Samples, "samples", STREAM)
        state = node.create_publisher(ReplayState, "replay_state", LATCHED)
        g.wait(lambda name: (word := words.word(f"/{name}")) is not None and word.ready, list(nodes), "all are ready")
        g.observer.spin(PATIENCE, lambda: samples.get_subscription_count() >= len(nodes))
        settled = {}
        for k in range(times):
            whole = SHORTEST + k % 7  # so that what is said of the test before is not taken for this one
            message = test_to_msg(recording)
            message.id, message.samples = f"test {k}", whole
            state.publish(ReplayState(state=ReplayState.PLAYING, total=whole))
            test.publish(message)
            g.observer.spin(0.02)
            _send(recording, whole, samples, g)
            state.publish(ReplayState(state=ReplayState.FINISHED, number=whole, total=whole))
            settles = k == round(SETTLED * times)
            everybody = settles or k % EVERY == EVERY - 1 or k == times - 1
            g.wait(
                partial(_says_it_is_through, words, whole),
                list(nodes if everybody else nodes.keys() - PATIENT),
                f"test {k} is dealt with",
            )
            if settles:
                settled = g.sizes()
        end = g.sizes()
    return [Grown(name, "tests", times, settled[name], end[name]) for name in nodes]


def _send(recording: Recording, whole: int, samples, g: Graph) -> None:
    for start in range(0, whole, BLOCK):
        samples.publish(samples_to_msg(recording, start, min(start + BLOCK, whole), 0, 10**9))
        g.observer.executor.spin_once(timeout_sec=0.0)


def _says_it_is_through(words, whole: int, name: str) -> bool:
    word = words.word(f"/{name}")
    return word is not None and word.done and word.total == whole and not word.missing


def passes_in_a_row(out: Path, times: int) -> list[Grown]:
    """A replay that loops."""
    nodes = commands(out / "passes")
    bag = str(bag_of(RECORDING, out / "recordings"))
    nodes["replay"] = node_command(
        "crash_replay", "replay", bag=bag, loop=True, rate=1.0, listeners=list(nodes), wait_timeout=PATIENCE
    )
    with graph(out / "passes", nodes) as g:

        def run() -> int:
            return g.observer.state.run if g.observer.state else 0

        g.wait(lambda _: run() >= round(SETTLED * times), ["replay"], "the replay has made a tenth of its passes")
        settled, deadline = g.sizes(), time.monotonic() + PATIENCE
        while run() < times and time.monotonic() < deadline + times:
            g.wait(lambda _: True, ["replay"], "its passes")
            g.observer.spin(0.5)
        end = g.sizes()
    return [Grown(name, "passes", run(), settled[name], end[name]) for name in nodes]


def size_of(process: int) -> Size:
    family = [process, *children_of(process)]

    def count(folder: str) -> int:
        return sum(len(list(Path(f"/proc/{one}/{folder}").glob("*"))) for one in family)

    return Size(sum(resident(one) for one in family), count("fd"), count("task"))
