"""`viewer`: shows what the estimators say in Rerun, live, and writes it to a .rrd file.

Subscribes to `test`, `replay_state`, each estimator's `parameters`, `residuals`, `forces` and `events`, and the
diagnosis' `ranking`, `misfit` and `revisions`. Callbacks only queue what comes; decoding, drawing and waiting for a
slow screen happen in the recorder's own thread.
"""

import os
import subprocess
import sys
import time
from collections.abc import Callable, Hashable, Sequence
from functools import cache, partial

from crash_msgs.msg import ReplayState, Samples, TestInfo
from rclpy.node import Node
from rclpy.subscription import Subscription
from rclpy.task import Future

from crash_replay.complaints import Complaints
from crash_replay.foreign_text import visible
from crash_replay.health import HealthReport
from crash_replay.node_parameters import NAME, Allowed, declare_parameters, names_in
from crash_replay.output import check_outputs
from crash_replay.qos import LATCHED, SAID, STREAM, UNACKNOWLEDGED
from crash_replay.ros_messages import decoded, test_from_msg
from crash_replay.ros_runtime import run
from crash_replay.said import say

from ..core.structure import Structure
from ..model_file import load_model, ready_models
from ..viewer.native import has_display, open_viewer
from ..viewer.recorder import Recorder
from ..viewer.sinks import Sinks
from .hearing import hear
from .node_health import viewer_health
from .viewer_messages import BLOCK_OF, FINDING_OF, test_block

QUIET = 3.0
"""s without a message after which a finished replay counts as shown, though samples are missing."""

SETTLED = 0.3
"""s for which all publishers must have been there: they hear of their subscriber a little later than it of them."""


PARAMETERS = {
    "estimators": Allowed([""], "names of estimators; empty: all there are", pattern=NAME),
    "models": Allowed([""], "files of models other than the ready ones, for the validation"),
    "port": Allowed(9876, "of the gRPC server on 127.0.0.1 that viewers connect to; 0: a free one", 0, 65_535),
    "rrd": Allowed("crash.rrd", "file that the recording is written to; empty: none"),
    "memory_limit": Allowed(
        "1GiB",
        "what the server keeps for viewers that come late, such as 500MB or 10%",
        pattern=r"\d{1,6}(%|[kMGT]i?B|B)",
    ),
    "open": Allowed(True, "open the native viewer where there is a display"),
    "exit_when_finished": Allowed(False, "end with the replay"),
}


class ViewerNode(Node):
    def __init__(self) -> None:
        super().__init__("viewer", automatically_declare_parameters_from_overrides=True)
        asked = declare_parameters(self, PARAMETERS)
        # On a busy machine the estimators go first, the picture comes later: this holds for all threads made from here
        # on, Rerun's too, but not for the middleware's, whose acknowledgements the estimators may wait for.
        os.nice(10)
        log = self.get_logger().info
        self.estimators, self.exits = names_in(asked["estimators"]), asked["exit_when_finished"]
        port, wants_window, models = asked["port"], asked["open"], names_in(asked["models"])
        check_outputs({"parameter rrd:": asked["rrd"] or None}, models)
        sinks = Sinks(port, asked["rrd"], asked["memory_limit"])
        known = cache(partial(structure_named, models))
        warn = self.get_logger().warning
        self.recorder = Recorder(sinks, tuple(self.estimators), say=warn, structure_of=known)
        if sinks.port != port:
            log(f"port {port} is in use, taking {sinks.port}")
        self.window: subprocess.Popen | None = None
        self.invitation = f"look at it live with: rerun --connect {sinks.url}"
        if wants_window and has_display():
            self.window = open_viewer(sinks.url)  # the server is up: a window that comes first would not try again
            log(f"viewer opened on {sinks.url}")
        else:
            log(self.invitation)
        if sinks.rrd:
            log(f"writing {visible(sinks.rrd)}")
        self.done = Future()
        self.finished = False
        self.counted: Subscription | None = None
        self.replay_goes_on = False
        self.followed: set[str] = set()
        self.inputs: list[Subscription] = []
        self.heard_since = time.monotonic()
        complaints = Complaints(lambda line: self.get_logger().warning(line))
        hear(self, complaints, TestInfo, "test", self._on_test, LATCHED)
        hear(self, complaints, ReplayState, "replay_state", self._on_state, LATCHED)
        for topic, (kind, make) in FINDING_OF.items():
            queue = partial(self._queue, kind, make, None)
            self.create_subscription(kind, topic, queue, SAID, raw=True)
        for name in self.estimators:
            self._follow(name)
        HealthReport(self, "queue", partial(viewer_health, self.recorder))
        self.create_timer(0.1, self._look_around)

    def _follow(self, name: str) -> None:
        self.followed.add(name)
        for topic, (kind, make) in BLOCK_OF.items():
            queue = partial(self._queue, kind, partial(make, name), None if topic == "events" else (name, topic))
            self.inputs.append(self.create_subscription(kind, f"{name}/{topic}", queue, STREAM, raw=True))

    def _queue(self, kind: type, make: Callable, stream: Hashable, raw: bytes) -> None:
        self.recorder.put(lambda: make(decoded(raw, kind)), stream, len(raw))

    def _on_test(self, message: TestInfo) -> None:
        test_from_msg(message)  # raises where it cannot be a test
        self.recorder.put(partial(test_block, message))

    def _on_state(self, message: ReplayState) -> None:
        self.finished = message.state == ReplayState.FINISHED

    def _look_around(self) -> None:
        """Find estimators, let a waiting replay count this viewer, and end with the replay when asked to."""
        if not self.estimators:
            for name in sorted(self._estimators_around() - self.followed):
                self._follow(name)
        self._be_counted()
        if self.window and self.window.poll() is not None:
            self.get_logger().info(f"the viewer was closed or could not run; {self.invitation}")
            self.window = None
        quiet = time.monotonic() - self.recorder.last_put > QUIET
        if self.exits and self.finished and self.recorder.idle and (self.recorder.complete or quiet):
            self.done.set_result(None)

    def _estimators_around(self) -> set[str]:
        own = self.get_namespace().rstrip("/") + "/"
        kind = "crash_msgs/msg/Residuals"
        topics = [topic for topic, kinds in self.get_topic_names_and_types() if kind in kinds]
        return {topic.removeprefix(own).removesuffix("/residuals") for topic in topics if topic.endswith("/residuals")}

    def _be_counted(self) -> None:
        """Subscribe to `samples` once all estimators can be heard, until the first sample.

        A replay that waits for one subscriber more than there are estimators so begins when they can be seen.
        """
        if self.replay_goes_on:
            if self.counted:
                self.destroy_subscription(self.counted)
                self.counted = None
        elif self.counted is None and self.inputs:
            if not all(subscription.get_publisher_count() for subscription in self.inputs):
                self.heard_since = time.monotonic()
            elif time.monotonic() - self.heard_since > SETTLED:
                begun = self._on_first_sample
                self.counted = self.create_subscription(Samples, "samples", begun, UNACKNOWLEDGED, raw=True)

    def _on_first_sample(self, _raw: bytes) -> None:
        self.replay_goes_on = True


def structure_named(paths: Sequence[str], name: str) -> Structure | None:
    """The model of this name, from one of the files or a ready one."""
    for path in (*paths, ready_models().get(name)):
        structure = load_model(path) if path else None
        if structure and structure.name == name:
            return structure
    return None


def main() -> int:
    return run(ViewerNode, until=lambda node: node.done, close=close)


def close(node: ViewerNode) -> None:
    """Say where what was shown is kept."""
    for line in node.recorder.close():
        say(line)


if __name__ == "__main__":
    sys.exit(main())
