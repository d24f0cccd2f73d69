"""Kills `record` at random moments, and looks whether what was published half a second before is in the file.

python -m crash_replay.record_killed --kills 50 --seed 1
"""

import argparse
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Thread
from typing import NamedTuple

import rclpy
from crash_msgs.msg import ParametersBlock, Samples, TestInfo
from mcap.reader import make_reader
from rclpy.context import Context
from rclpy.node import Node

from .cdr import Serialized
from .fault import guarded
from .middleware import prepare_middleware
from .qos import LATCHED, STREAM
from .recorded_topics import about
from .said import say

AGE = 0.5
"""s; what was published so long before the kill must be in the file."""
RATE, ESTIMATORS = 500, 3
"""Messages in a second on each topic, and how many topics of estimates beside the samples."""
LONGEST = 4.0
"""s after the file is there within which `record` is killed."""
START = 60.0
"""s for its start, which takes 2."""


class Killed(NamedTuple):
    """One kill; times in s."""

    moment: float  # since the file was there
    messages: int  # in the file
    oldest_missing: float  # age, when it was killed, of the oldest message after those in the file
    fault: str  # why the file does not open, or what is wrong with it, or ""

    @property
    def good(self) -> bool:
        return not self.fault and self.oldest_missing <= AGE


class Source:
    """Publishes numbered samples and estimates whose stamps are when they were published, by the wall clock."""

    def __init__(self, node: Node):
        test = node.create_publisher(TestInfo, "test", LATCHED)
        test.publish(TestInfo(id="T", samples=10**9))
        names = {"samples": Samples} | {f"e{k}/block/parameters": ParametersBlock for k in range(ESTIMATORS)}
        self.publishers = {f"/{name}": node.create_publisher(kind, name, STREAM) for name, kind in names.items()}
        more = {"name": ["a"] * 5, "unit": ["N/m"] * 5, "value": [1.0] * 5, "std": [1.0] * 5, "status": [0] * 5}
        self.messages = {
            f"/{name}": Serialized(kind(time_ns=[0], **(more if kind is ParametersBlock else {"values": [1.0] * 16})))
            for name, kind in names.items()
        }
        self.stamps: list[int] = []  # ns, by number; the same on all topics
        self.stop = Event()
        self.thread = Thread(target=self._publish)
        self.thread.start()

    def _publish(self) -> None:
        began = time.perf_counter()
        while not self.stop.wait(0.002):
            while not self.stop.is_set() and len(self.stamps) < (time.perf_counter() - began) * RATE:
                now, number = time.time_ns(), len(self.stamps)
                for name, publisher in self.publishers.items():
                    message = self.messages[name]
                    message.set_stamp(now)
                    message.numbers["number"][:] = number
                    publisher.publish(bytes(message))
                self.stamps.append(now)

    def heard(self) -> bool:
        return all(publisher.get_subscription_count() for publisher in self.publishers.values())


@contextmanager
def source() -> Iterator[Source]:
    """Of the domain and discovery range that the environment says."""
    prepare_middleware()
    context = Context()
    rclpy.init(context=context)
    node = Node("source", context=context, start_parameter_services=False)
    publishing = Source(node)
    try:
        yield publishing
    finally:
        publishing.stop.set()
        publishing.thread.join()
        node.destroy_node()
        rclpy.shutdown(context=context)


def kill(publishing: Source, file: Path, moment: float) -> Killed:
    """Start `record`, kill it so many s after its file is there, and read the file."""
    command = [sys.executable, "-m", "crash_replay.record_node", "--ros-args", "-p", f"to:={file}", "-p", "wait_for:=3"]
    record = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        limit = time.monotonic() + START
        while not file.exists():
            if record.poll() is not None or time.monotonic() > limit:
                return Killed(moment, 0, 0.0, "record did not start")
            time.sleep(0.001)
        time.sleep(moment)
        at = time.time_ns()
    finally:
        record.send_signal(signal.SIGKILL)
        record.wait()
    return judged(publishing, file, moment, at)


def judged(publishing: Source, file: Path, moment: float, at: int) -> Killed:
    """What the file of a `record` that was killed `at` ns holds."""
    numbers: dict[str, list[int]] = {name: [] for name in publishing.publishers}
    messages = 0
    try:
        with file.open("rb") as stream:
            for _, channel, message in make_reader(stream, validate_crcs=True).iter_messages():
                messages += 1
                if channel.topic in numbers:
                    numbers[channel.topic].append(about(message.data).number)
    except Exception as error:  # whatever mcap's reader stumbles over
        return Killed(moment, messages, 0.0, f"{type(error).__name__}: {error}")
    fault, oldest = "", 0.0
    for name, found in numbers.items():
        if not found:
            continue
        if found != list(range(found[0], found[0] + len(found))):
            fault = f"{name}: messages are missing in between"
        if found[-1] + 1 < len(publishing.stamps):
            oldest = max(oldest, (at - publishing.stamps[found[-1] + 1]) * 1e-9)
    return Killed(moment, messages, oldest, fault)


def kills(count: int, seed: int) -> Iterator[Killed]:
    """`record` killed at so many random moments."""
    chance = random.Random(seed)
    with source() as publishing, tempfile.TemporaryDirectory() as folder:
        for k in range(count):
            yield kill(publishing, Path(folder) / f"{k}.mcap", chance.uniform(0.0, LONGEST))


def main() -> int:
    return guarded(killed_at_random)


def killed_at_random() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    found = []
    for killed in kills(arguments.kills, arguments.seed):
        found.append(killed)
        say(
            f"killed after {killed.moment:.3f} s: {killed.messages} messages, "
            + (killed.fault or f"the oldest that is missing is {killed.oldest_missing:.3f} s old"),
        )
    good = sum(killed.good for killed in found)
    worst = max((killed.oldest_missing for killed in found), default=0.0)
    say(f"{good} of {len(found)} files open and lack nothing older than {AGE:g} s; the oldest: {worst:.3f} s")
    return 0 if good == len(found) else 1


if __name__ == "__main__":
    sys.exit(main())
