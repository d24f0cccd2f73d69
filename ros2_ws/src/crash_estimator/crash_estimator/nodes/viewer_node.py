"""The node of `viewer`: what estimators and diagnosis say goes to Rerun; `viewer_command` says with what."""

import os
import subprocess
import sys
import time
from collections.abc import Callable, Hashable, Sequence
from contextlib import suppress
from functools import cache, partial

from crash_msgs.msg import Event, Samples, TestInfo
from rclpy.node import Node
from rclpy.subscription import Subscription
from rclpy.task import Future

from crash_replay.attending import Attending, Progress
from crash_replay.complaints import Complaints
from crash_replay.foreign_text import visible
from crash_replay.health import HealthReport
from crash_replay.namespaces import is_own
from crash_replay.node_parameters import declare_parameters, names_in
from crash_replay.output import check_outputs
from crash_replay.qos import LATCHED, SAID, STREAM, UNACKNOWLEDGED
from crash_replay.recording import Test
from crash_replay.ros_messages import decoded, test_from_msg
from crash_replay.ros_runtime import run
from crash_replay.said import say

from ..core.effects.applied import applied
from ..core.structure import ModelError, Structure
from ..model_file import load_model
from ..ready_models import ready_models
from ..viewer.native import has_display, open_viewer
from ..viewer.recorder import Recorder
from ..viewer.sinks import Sinks
from ..viewer.web import WebViewer
from .effect_requests import with_effects
from .hearing import hear
from .revised_estimates import RevisedEstimates
from .viewer_account import Account
from .viewer_health import viewer_health
from .viewer_messages import BLOCK_OF, FINDING_OF, test_block
from .viewer_parameters import PARAMETERS
from .whole_estimates import WholeEstimates

SETTLED = 0.3
"""s for which all publishers must have been there: they hear of their subscriber a little later than it of them."""

HURRIED, PATIENT = 9.0, 60.0
"""s to end the file: where a signal has come before the end, who sent it waits not for long (`launch`: 10 s)."""


class ViewerNode(Node):
    def __init__(self) -> None:
        super().__init__("viewer", automatically_declare_parameters_from_overrides=True)
        asked = declare_parameters(self, PARAMETERS)
        # On a busy machine the estimators go first, the picture comes later: this holds for all threads made from here
        # on, Rerun's too, but not for the middleware's, whose acknowledgements the estimators may wait for.
        os.nice(10)
        log = self.get_logger().info
        self.names, self.exits = names_in(asked["estimators"]), asked["exit_when_finished"]
        port, wants_window, models = asked["port"], asked["open"], names_in(asked["models"])
        check_outputs({"parameter rrd:": asked["rrd"] or None}, models)
        sinks = Sinks(port, asked["rrd"], asked["memory_limit"])
        self.structure_named = cache(partial(structure_named, models))
        self.test: Test | None = None
        warn = self.get_logger().warning
        self.recorder = Recorder(sinks, tuple(self.names), say=warn, structure_of=self._structure_of)
        if port not in (0, sinks.port):  # 0 asks for any
            log(f"port {port} is in use, taking {sinks.port}")
        self.window: subprocess.Popen | None = None
        self.invitation = f"look at it live with: rerun --connect {sinks.url}"
        if wants_window and has_display():
            self.window = open_viewer(sinks.url)  # the server is up: a window that comes first would not try again
            log(f"viewer opened on {sinks.url}")
        else:
            log(self.invitation)
        self.web = WebViewer(sinks.url, asked["web_port"]) if asked["web"] and not has_display() else None
        if self.web:
            log(f"or in a browser on this machine: {self.web.page}")
        if sinks.rrd:
            log(f"writing {visible(sinks.rrd)}")
        self.done = Future()
        self.total = 0  # samples of the test
        self.counted: Subscription | None = None
        self.replay_goes_on = False
        self.said_finished = False
        self.estimates: dict[str, WholeEstimates] = {}  # by estimator
        self.revised: dict[str, RevisedEstimates] = {}
        self.heard_since = time.monotonic()
        self.attending = Attending(self, "viewer", self._progress)
        self.account = Account(self.attending, self.estimates, self.revised)
        complaints = Complaints(lambda line: self.get_logger().warning(line))
        hear(self, complaints, TestInfo, "test", self._on_test, LATCHED)
        for topic, (kind, make) in FINDING_OF.items():
            queue = partial(self._on_finding, kind, make)
            self.create_subscription(kind, topic, queue, SAID, raw=True)
        for name in self.names:
            self._follow(name)
        HealthReport(self, "queue", partial(viewer_health, self.recorder))
        self.create_timer(0.1, self._look_around)
        self.attending.tell()

    def _follow(self, name: str) -> None:
        def queue(topic: str, raw: bytes) -> None:
            kind, make = BLOCK_OF[topic]
            self._queue(kind, partial(make, name), None if topic == "events" else (name, topic), raw)

        self.revised[name] = RevisedEstimates(self, name, queue)
        self.estimates[name] = WholeEstimates(self, name, self.attending, self.revised[name].take)
        self.revised[name].follow(self.estimates[name])
        self.create_subscription(Event, f"{name}/events", partial(queue, "events"), STREAM, raw=True)

    def _queue(self, kind: type, make: Callable, stream: Hashable, raw: bytes) -> None:
        self.recorder.put(lambda: make(decoded(raw, kind)), stream, len(raw))

    def _on_finding(self, kind: type, make: Callable, raw: bytes) -> None:
        self.account.hear(kind, raw)
        self._queue(kind, make, None, raw)

    def _on_test(self, message: TestInfo) -> None:
        test = test_from_msg(message)  # raises where it cannot be a test
        self.total = message.samples
        self.account.begin_test(message.samples)
        for whole in self.estimates.values():
            whole.begin_test()
        for revised in self.revised.values():
            revised.begin_test()
        self.test = test
        self.recorder.put(partial(test_block, message))

    def _structure_of(self, estimator: str, revision: int, model: str) -> Structure | None:
        """The model that an estimator has spoken from, its effects at work; None where it is not known."""
        structure = self.structure_named(model)
        if structure is None or self.test is None:
            return None
        said = self.estimates[estimator].states if revision else ()
        effects = [state.model_effects for state in said if state.revision == revision]
        with suppress(ModelError):  # an effect of a user's own file
            structure = with_effects(structure, effects[-1], self.test) if effects else structure
            return applied(structure, self.test)
        return None

    def _progress(self) -> Progress:
        """What there is to say on `attendance`: it needs no samples, so that no replay waits for it to get them."""
        state, ready = self.attending.replay_state, self.replay_goes_on or self.counted is not None
        if not self.total:
            return Progress(ready=ready)
        run, number = (state.run, state.number) if state else (0, 0)
        reason = self._reason()
        done = self.account.settled() and self.recorder.saved
        return Progress(run, self.total, number, self.account.missing(), done, reason, ready)

    def _reason(self) -> str:
        """What the picture lacks, as far as it is known."""
        lacking = self.account.lacking() if self.account.settled() else []
        return "; ".join([*lacking, *self.recorder.faults])

    def _look_around(self) -> None:
        """Find estimators, let a waiting replay count this viewer, and end with the replay when asked to."""
        if not self.names:
            for name in sorted(self._estimators_around() - self.estimates.keys()):
                self._follow(name)
        self._be_counted()
        if self.window and self.window.poll() is not None:
            self.get_logger().info(f"the viewer was closed or could not run; {self.invitation}")
            self.window = None
        over = self.account.replay_is_over()
        if over != self.said_finished:  # the replay ends when it knows that this node has heard of the last sample
            self.said_finished = over
            self.attending.tell()
        if self.exits and over and self.account.settled() and self.recorder.idle:
            self.done.set_result(None)

    def _estimators_around(self) -> set[str]:
        own = self.get_namespace().rstrip("/") + "/"
        kind, last = "crash_msgs/msg/ResidualsBlock", "/block/residuals"
        topics = [topic for topic, kinds in self.get_topic_names_and_types() if kind in kinds and topic.endswith(last)]
        return {topic.removeprefix(own).removesuffix(last) for topic in topics if is_own(self, topic)}

    def _be_counted(self) -> None:
        """Subscribe to `samples` once all estimators can be heard, until the first sample.

        A replay that waits for one subscriber more than there are estimators so begins when they can be seen.
        """
        if self.replay_goes_on:
            if self.counted:
                self.destroy_subscription(self.counted)
                self.counted = None
        elif self.counted is None and self.estimates:
            if not all(estimates.found for estimates in self.estimates.values()):
                self.heard_since = time.monotonic()
            elif time.monotonic() - self.heard_since > SETTLED:
                begun = self._on_first_sample
                self.counted = self.create_subscription(Samples, "samples", begun, UNACKNOWLEDGED, raw=True)
                self.attending.tell()

    def _on_first_sample(self, _raw: bytes) -> None:
        self.replay_goes_on = True


def structure_named(paths: Sequence[str], name: str) -> Structure | None:
    """The model of this name, from one of the files or a ready one."""
    for path in (*paths, str(ready_models().get(name, ""))):
        structure = load_model(path) if path else None
        if structure and structure.name == name:
            return structure
    return None


def main() -> int:
    return run(ViewerNode, until=lambda node: node.done, close=close)


def close(node: ViewerNode) -> str:
    """Say where what was shown is kept -> a line on what it lacks, or ""."""
    whole = node.account.settled() and node.recorder.idle
    lacking = node.account.lacking() if node.total else []
    if lacking and not whole:
        lacking.append("ended before the rest came")
    for line in node.recorder.close(PATIENT if whole else HURRIED, "; ".join(lacking)):
        say(line)
    node.attending.leave()
    if node.web:
        node.web.close()
    lacking += node.recorder.faults
    return f"incomplete: {'; '.join(lacking)}" if lacking else ""


if __name__ == "__main__":
    sys.exit(main())
