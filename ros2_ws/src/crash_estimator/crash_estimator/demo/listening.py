"""The demonstration while it waits: it listens, tells what is worth a line, and notices who is lost."""

import time
from collections.abc import Callable, Hashable, Mapping, Sequence

import rclpy
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.signals import SignalHandlerOptions

from crash_replay.middleware import prepare_middleware

from ..viewer.findings import RankingBlock
from .children import Child
from .company import Company
from .interrupts import held_back
from .story import Story
from .terminal import Terminal
from .watch import Watch

PERIOD = 0.05
"""s between two looks at the processes."""


class Listening:
    """Takes part in the graph: use as a context."""

    def __init__(self, children: Mapping[str, Child], names: Sequence[str], terminal: Terminal, story: Story | None):
        """names: of the estimators; story: of the diagnosis, where there is one."""
        prepare_middleware()
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        self.children, self.terminal, self.story = children, terminal, story
        self.watch, self.executor = Watch(names, for_tables=story is None), EventsExecutor()
        self.executor.add_node(self.watch)
        self.company = Company(children, self.watch.attending.others)
        self.incomplete: list[str] = []  # what is missing of what the demonstration is for
        self.revisions = dict.fromkeys(names, 0)  # of the estimators' models, as told

    def __enter__(self) -> "Listening":
        return self

    def __exit__(self, *_) -> None:
        self.terminal.clear()
        self.watch.attending.leave()
        self.executor.shutdown()  # before the node: it still holds the node's events, and lets go of them last
        self.watch.destroy_node()
        rclpy.shutdown()

    def wait(
        self, over: Callable[[], bool], what: Callable[[float], None], limit: float, progress: Callable[[], Hashable]
    ) -> bool:
        """Listen until it is over; False: for `limit` s there was no progress. what: tells what is waited for."""
        began = moved = time.monotonic()
        before = progress()
        while not over():
            now, (reached, back) = time.monotonic(), (progress(), self.company.back)
            if reached != before:
                before, moved = reached, now
            if now - max(moved, back) > limit:
                self.terminal.clear()
                return False
            self._listen()
            what(now - began)
        self.terminal.clear()
        return True

    def _listen(self) -> None:
        until = time.monotonic() + PERIOD
        with held_back():
            while (left := until - time.monotonic()) > 0:
                self.executor.spin_once(timeout_sec=left)
        self.watch.look()
        self._tell_of_processes()
        for finding in self.watch.new_findings() if self.story else ():
            told = self.story.ranking(finding) if isinstance(finding, RankingBlock) else self.story.misfit(finding)
            for line in told:
                self.terminal.say(line)

    def _tell_of_processes(self) -> None:
        """Warnings of all, what the viewer says of itself, what is added to a model, and who is lost."""
        for name, child in self.children.items():
            for level, text in child.messages():
                if level in ("WARN", "ERROR", "FATAL") or name == "viewer":
                    self.terminal.say(f"{name}: {text}")
        for line in self.company.look():
            self.terminal.say(line)
            self.incomplete.append(line)
        for name, estimates in self.watch.estimates.items():
            if estimates.revision > self.revisions[name]:
                self.revisions[name] = estimates.revision
                state = estimates.states[-1]
                model = f"{state.model} with {', '.join(state.effects) or 'no effect'}"
                done = f"revision {state.revision}: {model}; {state.number} samples estimated again"
                self.terminal.say(f"added to {name}: {done}")
