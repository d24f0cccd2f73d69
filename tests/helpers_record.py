"""`record` as a process, an estimator that says something of every sample, and what a recording holds."""

import resource
import subprocess
import sys
from collections import Counter
from pathlib import Path

from crash_msgs.msg import ParametersBlock, ResidualsBlock
from crash_msgs.srv import GetEstimates
from helpers_replay import Listener, OfTheTest, environment
from helpers_waiting import PATIENCE
from mcap.exceptions import EndOfFile
from mcap.reader import make_reader

from crash_replay.attending import Attending, Progress
from crash_replay.qos import STREAM


def messages(file: Path) -> Counter:
    with file.open("rb") as stream:
        return Counter(channel.topic for _, channel, _ in make_reader(stream).iter_messages())


def messages_so_far(file: Path) -> Counter:
    """Of a recording that has just begun: no file, or one without its first bytes, holds none."""
    try:
        return messages(file)
    except (FileNotFoundError, EndOfFile):
        return Counter()


def says_of_itself(file: Path) -> dict[str, str]:
    with file.open("rb") as stream:
        return next(r.metadata for r in make_reader(stream).iter_metadata() if r.name == "crash_replay")


class Record(OfTheTest):
    """`record` with its output."""

    def __init__(self, file: Path, limit: int | None = None, **parameters):
        """limit: bytes that it may write into a file."""
        command = [sys.executable, "-m", "crash_replay.record_node", "--ros-args", "-p", f"to:={file}"]
        for name, value in parameters.items():
            command += ["-p", f"{name}:={value}"]
        limited = (lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))) if limit else None
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
        self.process = subprocess.Popen(command, env=environment(), preexec_fn=limited, **pipes)

    def end(self, number: int = 0, timeout: float = PATIENCE) -> tuple[int, str, str]:
        """Its exit status, output and errors without what it logs."""
        if number:
            self.process.send_signal(number)
        output, errors = self.process.communicate(timeout=timeout)
        logged = [line for line in errors.splitlines() if not line.startswith("[")]
        return self.process.returncode, output.strip(), "\n".join(logged)


class Estimator(Listener):
    """Says something on every sample it hears, and takes part."""

    def __init__(self, name: str = "fake", silent_from: int = 10**9):
        """silent_from: number of the sample from which on nothing is published, though it can be had again."""
        super().__init__(name)
        self.next, self.silent_from = 0, silent_from
        node = self.node
        self.out = [node.create_publisher(kind, f"~/block/{topic}", STREAM) for kind, topic in self.kinds.items()]
        node.create_service(GetEstimates, "~/get_estimates", self._again)
        self.attending = Attending(node, "estimator", self._progress)
        self.executor.wake()

    kinds = {ParametersBlock: "parameters", ResidualsBlock: "residuals"}

    def _progress(self) -> Progress:
        total = self.tests[-1].samples if self.tests else 0
        return Progress(0, total, self.next, done=bool(total) and self.next == total)

    def _on_samples(self, message) -> None:
        super()._on_samples(message)
        for kind, publisher in zip(self.kinds, getattr(self, "out", [])):
            if message.number < self.silent_from:
                publisher.publish(kind(run=message.run, number=message.number, time_ns=message.time_ns))
        self.next = message.number + len(message.time_ns)

    def _again(self, request, response):
        if request.start >= 36:
            response.message = f"samples {request.start} to {request.stop - 1} have not all been seen"
            return response
        response.success = True
        for kind, topic in self.kinds.items():
            times = [0] * min(4, request.stop - request.start)
            setattr(response, topic, kind(run=request.run, number=request.start, time_ns=times))
        return response
