"""One demonstration from its first sample to its last line."""

import sys
import time
from collections.abc import Sequence
from pathlib import Path

import rclpy
from rclpy.executors import Executor
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.signals import SignalHandlerOptions

from crash_replay.fault import Fault
from crash_replay.middleware import prepare_middleware

from ..core.errors import equation_errors
from ..tables import error_table, parameter_table
from ..viewer.findings import RankingBlock
from ..viewer.native import has_display
from .children import Child, Children
from .choice import Choice
from .interrupts import held_back
from .story import Story
from .terminal import Terminal, near
from .watch import Watch

PERIOD = 0.05
"""s between two looks at the processes."""
LATE = 10.0
"""s that estimators which are ready wait for the viewer."""
SILENCE = 3.0
"""s without a message after which nothing more is expected of a replay that has ended."""
WRITING = 20.0
"""s that the viewer has to finish its file."""
ANSWERING = 240.0
"""s that the diagnosis has for its answer after the last sample, and again with what it has added."""
ESTIMATING = 20.0
"""s that an estimator then has to estimate all samples again."""
MISSING = ("Missing effect", "which effect the model lacks, and its error, fit by fit; shaded where the model fails")
LOOK_AT = (
    ("Overview", "measured and predicted acceleration; the residual leaves its 99 % band where a model fails"),
    ("Force over crush", "the loop of each element: its slope is the stiffness, what it encloses the absorbed energy"),
    ("Parameters", "stiffness with its sigma; in the lanes below, when each element loads, unloads or is apart"),
    ("Motion and states", "bodies and springs move with the time cursor: drag it through the crash"),
)


class Run:
    """Watches the processes and tells the terminal."""

    def __init__(self, children: Children, choices: Sequence[Choice], terminal: Terminal, rrd: Path | None):
        self.children, self.terminal, self.rrd = children.all, terminal, rrd
        self.choices = {choice.name: choice for choice in choices}
        self.story = Story() if "diagnosis" in self.children else None
        self.dead: set[str] = set()  # those that ended though they should not have
        self.changed = False  # an estimator's model
        self.gave_up = False  # the diagnosis: it says why, and nothing more
        self.ended_at = 0.0  # when the replay had ended and something came for the last time
        self.heard = 0
        self.ready_at = 0.0  # s after the start, when all estimators were there
        self.resumed = False

    def to_the_end(self) -> int:
        """Exit status 0, or 1 where the replay, the diagnosis or every estimator died."""
        prepare_middleware()
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        watch, executor = Watch(list(self.choices), ["diagnosis"] if self.story else []), EventsExecutor()
        executor.add_node(watch)
        try:
            self._follow(watch, executor)
            if self.story:
                self._wait_for_answer(watch, executor)
            else:
                self._tables(watch)
            self._wait_for_viewer()
        finally:
            self.terminal.clear()
            executor.shutdown()  # before the node: it still holds the node's events, and lets go of them last
            watch.destroy_node()
            rclpy.shutdown()
        return 1 if self.dead & {"replay", "diagnosis"} or self.gave_up or not self._alive() else 0

    def _alive(self) -> list[str]:
        return [name for name in self.choices if name not in self.dead]

    def _needed(self) -> list[str]:
        """Nodes that live and that the replay does not begin without."""
        return self._alive() + ["diagnosis"] * (self.story is not None and "diagnosis" not in self.dead)

    def _follow(self, watch: Watch, executor: Executor) -> None:
        began, encoding = time.monotonic(), self.terminal.stream.encoding
        while not self._is_over(watch):
            self._listen(watch, executor)
            if watch.waiting:
                waited = time.monotonic() - began
                self.terminal.wait(self._start(watch, waited), waited)
            else:
                self.terminal.progress(watch.progress(encoding))
        self.terminal.end_progress(watch.progress(encoding, watch.total))

    def _listen(self, watch: Watch, executor: Executor) -> None:
        until = time.monotonic() + PERIOD
        with held_back():
            while (left := until - time.monotonic()) > 0:
                executor.spin_once(timeout_sec=left)
        self._tell_of_processes()
        for finding in watch.new_findings() if self.story else ():
            tell = self.story.ranking if isinstance(finding, RankingBlock) else self.story.misfit
            for line in tell(finding):
                self.terminal.say(line)

    def _wait_for_answer(self, watch: Watch, executor: Executor) -> None:
        """Until the diagnosis has judged all samples, and the model with what it has added."""
        began, answers = time.monotonic(), 0
        while not (self.story.complete or self.gave_up or "diagnosis" in self.dead):
            if len(self.story.finals) > answers:
                began, answers = time.monotonic(), len(self.story.finals)
            waited = time.monotonic() - began
            if waited > ANSWERING:
                self.terminal.say(f"the diagnosis has not answered within {ANSWERING:g} s")
                return
            self._listen(watch, executor)
            doing = "judging the model with it" if answers else "comparing every candidate on all samples"
            self.terminal.wait(doing, waited)
        self.terminal.clear()
        deadline = time.monotonic() + (ESTIMATING if self.story.added else 3 * PERIOD)  # and its last curves
        while time.monotonic() < deadline and not (self.story.added and self.changed):
            self._listen(watch, executor)

    def _is_over(self, watch: Watch) -> bool:
        if not self._alive():
            return True
        if self.children["replay"].status is None:
            return False
        newest = [watch.samples.next, *(watch.followed[name].samples for name in self._alive())]
        if watch.total and min(newest) >= watch.total:
            return True
        now = time.monotonic()
        if watch.heard != self.heard or not self.ended_at:
            self.heard, self.ended_at = watch.heard, now
        return now - self.ended_at > SILENCE

    def _tell_of_processes(self) -> None:
        """Warnings of all, what the viewer says of itself, what is added to a model, and who has died."""
        for name, child in self.children.items():
            for level, text in child.messages():
                changed = name in self.choices and text.startswith("revision ")  # an effect has been added to its model
                self.changed |= changed
                if level in ("WARN", "ERROR", "FATAL") or name == "viewer" or changed:
                    self.terminal.say(f"{'added to ' * changed}{name}: {text}")
                self.gave_up |= name == "diagnosis" and level in ("ERROR", "FATAL")
            status = child.status
            stays = name in self.choices or name == "diagnosis"
            early = bool(status) or (stays and self.children["replay"].status is None)
            if status is not None and early and name not in self.dead:
                self.dead.add(name)
                self.terminal.say(f"{name} has ended too early: {child.last_words()}")

    def _start(self, watch: Watch, waited: float) -> str:
        """Join in as the last, see to it that the replay begins; a line on what it waits for."""
        alive = self._needed()
        absent = watch.absent(alive)
        if absent:
            hint = ": after an update they compile their code first, half a minute" if waited > 5.0 else ""
            return f"waiting for {', '.join(absent)}{hint}"
        self.ready_at = self.ready_at or waited
        late = waited - self.ready_at > (LATE if not self.dead else 2.0)
        viewer = "viewer" in self.children and "viewer" not in self.dead
        if viewer and watch.counted <= len(alive) and not watch.subscribed and not late:
            return "waiting for the viewer"
        watch.be_counted()
        if (self.dead or late) and watch.counted > len(alive) and not self.resumed:
            self.terminal.say(f"beginning without {', '.join(sorted(self.dead)) or 'the viewer'}")
            watch.resume()
            self.resumed = True
        return "waiting for the first sample"

    def _tables(self, watch: Watch) -> None:
        replay = self.children["replay"]
        if replay.status == 0:
            self.terminal.say(f"replay {replay.last_line()}")
        for name, choice in self.choices.items():
            followed = watch.followed[name]
            lost = followed.lost(watch.total)
            self.terminal.say(
                f"\n{name}: model {choice.model}, method {choice.method}, {followed.samples} samples, {lost} lost\n"
            )
            found = followed.found()
            errors = equation_errors(*found) if found else []
            if any(error.samples for error in errors):
                self.terminal.say(f"{parameter_table(*found)}\n\n{error_table(errors)}")
            else:
                self.terminal.say("nothing of the impact was estimated")

    def _wait_for_viewer(self) -> None:
        viewer: Child | None = self.children.get("viewer")
        if viewer is None:
            return
        self.terminal.say()
        if self.story and viewer.status is None:
            viewer.process.terminate()  # it would wait for more
        deadline = time.monotonic() + WRITING
        while viewer.status is None and time.monotonic() < deadline:
            time.sleep(PERIOD)
        self._tell_of_processes()
        if viewer.status is None:
            self.terminal.say(f"viewer: has not finished {self.rrd} within {WRITING:g} s, it is ended now")
            return
        if viewer.status == 0:
            self.terminal.say(f"viewer {viewer.last_line()}")
            rerun = Path(sys.prefix) / "bin" / "rerun"
            again = f"{near(rerun)} {near(self.rrd)}"
            if self.story and not has_display():
                self._picture()
            window = "The viewer stays open; look at it again later" if has_display() else "Look at it"
            self.terminal.say(f"\n{window} with: {again}\n\nWhat to look at, by tab:")
            for tab, what in ([MISSING] if self.story else []) + list(LOOK_AT):
                self.terminal.say(f"  {tab:18} {what}")

    def _picture(self) -> None:
        """What a viewer would show at the end, where there is no screen for it."""
        from ..viewer.screenshot import screenshot  # takes Rerun, which all else here does without

        picture = self.rrd.with_suffix(".png")
        try:
            screenshot(self.rrd, picture)
        except Fault as error:
            self.terminal.say(f"no picture of it: {error}")
        else:
            self.terminal.say(f"its picture: {near(picture.absolute())}")
