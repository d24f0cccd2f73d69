"""`python -m crash_estimator.chaos.launching bag:=a.mcap model:=m`: live.launch.py, carried out without `ros2 launch`.

Its processes, its handlers of their ends and its shutdown are those of the launch file; who starts them is not launch.
As launch does, this sends SIGINT to end them all, after 5 s SIGTERM and after 5 more SIGKILL, ends with status 1
where a handler raises, and hands on what they say.
"""

import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path
from types import SimpleNamespace

from ament_index_python.packages import get_package_share_directory

from crash_replay.fault import guarded, tell
from crash_replay.processes import end_with
from crash_replay.recording import RecordingError
from crash_replay.said import say
from crash_replay.starting import held

from .launch_words import LaunchContext, Node, RegisterEventHandler, arguments_of, carried_out, described
from .members import node_command, send

LOOK = 0.02
"""s between two looks at who has ended."""
ESCALATION = ((0.0, signal.SIGINT), (5.0, signal.SIGTERM), (10.0, signal.SIGKILL))
"""s since the shutdown, and what who still runs is sent then."""


def launch_file() -> Path:
    return Path(get_package_share_directory("crash_estimator")) / "launch" / "live.launch.py"


class Launch:
    def __init__(self, entities: list, given: dict[str, str]):
        self.context = LaunchContext(arguments_of(entities) | given)
        found = carried_out(entities, self.context)
        handlers = [one.event_handler for one in found if isinstance(one, RegisterEventHandler)]
        self.handlers = {id(handler.target_action): handler.on_exit for handler in handlers}
        self.nodes = [one for one in found if isinstance(one, Node)]
        self.running: list[tuple[Node, subprocess.Popen]] = []
        self.status, self.shut_down_at, self.interrupted = 0, 0.0, False

    def run(self) -> int:
        for node in self.nodes:
            self.running.append((node, self._start(node)))
        sent = 0
        while self.running:
            time.sleep(LOOK)
            if self.interrupted:
                self._shut_down("ctrl-c (SIGINT)")
            for node, process in [one for one in self.running if one[1].poll() is not None]:
                self.running.remove((node, process))
                self._follow(node, process.returncode)
            while self.shut_down_at and sent < len(ESCALATION) and self._passed() >= ESCALATION[sent][0]:
                for _, process in self.running:
                    send(process.pid, ESCALATION[sent][1])
                sent += 1
        return self.status

    def _passed(self) -> float:
        return time.monotonic() - self.shut_down_at

    def _start(self, node: Node) -> subprocess.Popen:
        command = node_command(node.package, node.executable) + node.words()
        with held():
            return subprocess.Popen(command, preexec_fn=partial(end_with, os.getpid()))

    def _follow(self, node: Node, status: int) -> None:
        """What the launch file says on the end of a process."""
        say(f"[{node.executable}]: process has ended with exit status {status}")
        try:
            done = self.handlers[id(node)](SimpleNamespace(returncode=status), self.context)
        except Exception as error:
            self.status = 1
            tell(f"[launch]: error: {error}")
            self._shut_down(str(error))
        else:
            for action in done or ():
                self._shut_down(action.event.reason)

    def _shut_down(self, reason: str) -> None:
        if not self.shut_down_at:
            say(f"[launch]: shutdown: {reason}")
            self.shut_down_at, self.context.is_shutdown = time.monotonic(), True


def main() -> int:
    return guarded(_main)


def _main() -> int:
    given = dict(one.split(":=", 1) for one in sys.argv[1:] if ":=" in one)
    entities = described(launch_file())
    if unknown := given.keys() - arguments_of(entities).keys():
        raise RecordingError(f"no such argument of the launch: {', '.join(sorted(unknown))}")
    try:
        launch = Launch(entities, given)
    except Exception as error:  # as launch, whatever the launch file raises
        raise RecordingError(str(error)) from None
    signal.signal(signal.SIGINT, lambda *_: setattr(launch, "interrupted", True))
    return launch.run()


if __name__ == "__main__":
    sys.exit(main())
