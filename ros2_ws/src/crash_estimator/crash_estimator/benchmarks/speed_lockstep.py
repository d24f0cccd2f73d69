"""Runs in lock-step on a machine that is busy with other things: every recording of the estimates is the same."""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from crash_msgs.msg import ParametersBlock, ResidualsBlock
from crash_msgs.srv import Burst
from mcap.reader import make_reader
from rclpy.serialization import deserialize_message
from std_srvs.srv import Trigger

from ..nodes.estimate_messages import samples_of
from .speed_graph import Graph

BLOCKS = {f"crash_msgs/msg/{kind.__name__}": kind for kind in (ParametersBlock, ResidualsBlock)}
BURNER = "while True: sum(range(10**6))"
BEFORE, SETTLED = 60, 2.0
"""Samples before an estimator is killed; s after which the one in its place is heard by all."""


@contextmanager
def burning() -> Iterator[None]:
    """All cores busy with something else."""
    processes = [subprocess.Popen([sys.executable, "-c", BURNER]) for _ in range(os.cpu_count() or 1)]
    try:
        yield
    finally:
        for process in processes:
            process.kill()
            process.wait()


def recorded(graph: Graph, model: Path, bag: Path, file: Path, kill: bool) -> Path:
    """Replay the bag in lock-step to the graph's estimators, named by their methods, and record what they say.

    kill: the first of them is killed (SIGKILL) on the way and started again.
    """
    children, spin_until = graph.children, graph.spin_until
    for method in graph.names:
        graph.estimator(method, model, method)
    recorder = children.start("record", "crash_replay", "record", to=str(file), wait_for=len(graph.names))
    quiet: dict[str, Any] = {
        "progress": "false",
        "keyboard": "false",
        "wait_for": len(graph.names) + 1,
        "wait_timeout": 60.0,
    }
    replay = children.start(
        "replay", "crash_replay", "replay", bag=str(bag), block=1, lockstep=True, start_paused=kill, **quiet
    )
    if kill:
        heard = lambda: graph.listener.count_subscribers("/samples") > len(graph.names)  # noqa: E731
        spin_until(heard, "the replay is heard by all")
        graph.spin(SETTLED)
        _call(graph, Burst, "replay/burst", Burst.Request(n=BEFORE))
        _replace(graph, model, graph.names[0])
        _call(graph, Trigger, "replay/resume", Trigger.Request())
    ended = lambda: replay.status is not None and recorder.status is not None  # noqa: E731
    del children.all["replay"], children.all["record"]  # they end by themselves
    spin_until(ended, "replay and record have ended", 240.0)
    if replay.status or recorder.status:
        raise RuntimeError(f"replay: {replay.last_words()}; record: {recorder.last_words()}")
    return file


def _replace(graph: Graph, model: Path, method: str) -> None:
    """Kill an estimator while nothing is on its way, and start it again under its name."""
    graph.spin(0.5)
    dead = graph.children.all.pop(method)
    dead.process.kill()
    dead.process.wait()
    graph.estimator(method, model, method)
    graph.spin_until(lambda: "test " in graph.children.all[method].last_line(), "the estimator is back")
    graph.spin(SETTLED)


def _call(graph: Graph, kind: type, service: str, request) -> None:
    client = graph.listener.create_client(kind, service)
    graph.spin_until(client.service_is_ready, f"{service} is there")
    call = client.call_async(request)
    graph.spin_until(call.done, f"{service} answers")
    graph.listener.destroy_client(client)


def said(file: Path) -> dict[str, dict[int, set[bytes]]]:
    """By topic of the blocks and number of the sample: what was said of it, to the last bit.

    An estimator that comes back says all that it has caught up with in one block: it is the samples that are compared,
    whatever they came in. One that was told twice otherwise has two entries.
    """
    found: dict[str, dict[int, set[bytes]]] = {}
    with file.open("rb") as stream:
        for schema, channel, message in make_reader(stream).iter_messages(log_time_order=False):
            if schema is None or schema.name not in BLOCKS:
                continue
            samples = found.setdefault(channel.topic, {})
            block = deserialize_message(message.data, BLOCKS[schema.name])
            head = repr((block.run, block.revision, block.model, block.method, block.name, block.unit)).encode()
            for number, row in samples_of(block):
                samples.setdefault(number, set()).add(head + b"".join(np.asarray(v).tobytes() for v in row.values()))
    return found
