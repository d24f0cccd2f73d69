"""The node of `record`: what replay, estimators and diagnosis publish goes to a file; `record_command` says with
what."""

import sys
import time
from contextlib import suppress
from pathlib import Path

from crash_msgs.msg import EstimatorState, Ranking, ReplayState, TestInfo
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from rclpy.task import Future

from .attendance import GONE
from .attending import REPLAY, Attending, Progress
from .completeness import DIAGNOSIS, ESTIMATOR, SILENT_FOR, Completeness, Pass
from .fault import Fault, NobodyReads
from .fetching import Fetching
from .health import Health, HealthReport, Level
from .listening import Listening
from .namespaces import namespace_of
from .node_parameters import declare_parameters, names_in
from .numbers import Numbers
from .record_parameters import PARAMETERS
from .recorded_topics import CHANNELS, DIAGNOSTICS, NUMBERED, Choice, about, instants_of, stamp_of, unreadable
from .recorder import Heard, Recorder
from .ros_runtime import run
from .said import say
from .selection import regular_expression

LOOK = 0.1
"""s between two looks for new topics, and for the end."""
QUIET = 1.0
"""s without a message, once all have said their last word, that end the recording."""
REPLAY_SILENT = 60.0
"""s of silence after which a replay counts as gone."""
STOOD_STILL = 2.0
"""s between two looks that are worth saying."""
GOES_ON = {"crash_msgs/msg/Attendance", "crash_msgs/msg/ReplayState", DIAGNOSTICS}
"""What is said as long as a node is there."""


class RecordError(Fault):
    """Nothing can be recorded; the message is one readable line."""


class RecordNode(Node):
    """Finds the topics by their types and hands what comes to a `Recorder` and to the account of what is missing."""

    def __init__(self) -> None:
        super().__init__("record", automatically_declare_parameters_from_overrides=True)
        asked = declare_parameters(self, PARAMETERS)
        for name in ("regex", "exclude_regex"):
            regular_expression(asked[name], name)
        lists = names_in(asked["topics"]), names_in(asked["exclude"])
        choice = Choice(*lists, self.get_namespace(), asked["regex"], asked["exclude_regex"])
        self.recorder = opened(asked["to"])
        self.attending = Attending(self, "record", self._progress)
        self.account = Completeness(choice, self.attending.others, self.resolve_topic_name("samples"))
        self.listening = Listening(self, choice, asked["wait_for"], self._hear, self._channels_to_come)
        self.fetching = Fetching(self, self.account, self._hear)
        self.replayed = self.all_said = False  # a replay is or was there; nothing more is to be expected
        self.last = self.looked = time.monotonic()  # when a message came; when it was looked
        self.stood_still: list[str] = []
        self.full: OSError | None = None
        self.done, self.finished = Future(), False
        HealthReport(self, "file", self._health)
        self.create_timer(LOOK, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    # what comes

    def _hear(self, topic: Heard, data: bytes) -> None:
        if self.finished:
            return
        if why := unreadable(topic.type, data):
            return self.get_logger().error(f"{topic.name}: {why}: left out", throttle_duration_sec=10.0)
        if topic.type == DIAGNOSTICS and not said_within(data, self.get_namespace()):
            return
        if topic.own and topic.type in NUMBERED and self.account.of(topic.name).came_late(about(data)):
            return
        try:
            new = self.recorder.hear(topic, data)
        except OSError as error:
            return self._end_full(error)
        if topic.type not in GOES_ON:
            self.last = time.monotonic()
        try:
            if new and topic.own:
                self._take_account(topic, data)
        except Exception as error:  # whatever a message that is none of its type makes the middleware say
            self.get_logger().error(f"{topic.name}: does not decode as {topic.type} ({error}): written as it came")

    def _take_account(self, topic: Heard, data: bytes) -> None:
        if topic.type in NUMBERED:
            self.account.of(topic.name).add(about(data))
            if topic.name == self.account.samples_topic and self.account.channels.written:
                self.account.channels.add_samples(about(data).number, instants_of(data))
        elif topic.type in CHANNELS:
            self.account.channels.add(topic.name, stamp_of(data))
        elif topic.type == "crash_msgs/msg/TestInfo":
            test = deserialize_message(data, TestInfo)
            channels = [self.resolve_topic_name(f"channels/{channel.name}") for channel in test.channels]
            self.account.begin_test(test.samples, channels)
        elif topic.type == "crash_msgs/msg/Ranking":
            ranking = deserialize_message(data, Ranking)
            if ranking.final:
                self.account.finals[topic.name.removesuffix("/ranking")] = ranking.run
        elif topic.type == "crash_msgs/msg/EstimatorState":
            state = deserialize_message(data, EstimatorState)
            self.account.revise(topic.name.removesuffix("/state"), state.revision)

    # what is said of it

    def _progress(self) -> Progress:
        of = self.account.last_pass
        reached, given_up, why = of.sent, 0, ""
        for topic in self.account.samples():
            written = self.account.of(topic)
            known = Numbers([*written.last.spans, *written.given_up.spans] if written.run == of.run else [])
            reached = min(reached, known.reach(of.first))
            given_up, why = len(written.given_up), written.why
        done = self.all_said and reached >= of.sent > 0
        return Progress(of.run, of.total, reached, given_up, done, why, self.listening.ready())

    def _health(self) -> Health:
        values = {"messages": self.recorder.count, "topics": len(self.recorder.topics)}
        return Health(Level.OK, f"records {self.recorder.file.name}", values)

    def _look(self) -> None:
        now = time.monotonic()
        if now - self.looked > STOOD_STILL:
            times = (time.strftime("%H:%M:%S", time.localtime(time.time() - ago)) for ago in (now - self.looked, 0.0))
            self.stood_still.append(" to ".join(times))
            self.last = now
        self.last += max(0.0, now - self.looked - 2 * LOOK)  # while this process stands still it hears nothing
        self.looked = now
        for topic in self.listening.look():
            self.account.found(topic.name, topic.type)
        self._see_replay()
        more, gone, through = self.fetching.look(), self._replay_is_gone(), self._all_are_through()
        self.all_said = through and not more and now - self.last > QUIET
        if gone and (self.all_said or now - self.last > SILENT_FOR):
            self._finish()
        try:
            self.recorder.look()
        except OSError as error:
            self._end_full(error)

    def _see_replay(self) -> None:
        state = self.attending.replay_state
        if state is not None and state.total:
            finished = state.state == ReplayState.FINISHED
            self.account.replayed = Pass(state.run, state.first, state.number, state.total, finished)
            self.account.known_to_replay = {one.node: one.role for one in state.listeners if one.state not in GONE}

    def _channels_to_come(self) -> bool:
        """Whether a test is still to come, or of a replay a channel that is to be recorded."""
        replay_is_there = self.count_publishers("replay_state") > 0
        return self.account.test_to_come() or (replay_is_there and self.account.channels_to_come())

    def _replay_is_gone(self) -> bool:
        others = self.attending.others
        if replays := others.names(REPLAY):
            return all(others.state(name) in GONE or others.silence(name) > REPLAY_SILENT for name in replays)
        there = self.count_publishers("replay_state") > 0
        self.replayed |= there
        return self.replayed and not there

    def _all_are_through(self) -> bool:
        return all(self.account.through(name) for name in self.account.nodes(ESTIMATOR, DIAGNOSIS))

    def _end_full(self, error: OSError) -> None:
        self.full = error
        self._finish()

    def _finish(self) -> None:
        """End by its own will, and not by a signal."""
        self.finished = True
        if not self.done.done():
            self.done.set_result(None)

    def end(self) -> str:
        """End the file -> a line on what is wrong with it, or ""."""
        file, count = self.recorder.file, self.recorder.count
        kinds = {topic.type for name, topic in self.listening.heard.items() if name in self.recorder.topics}
        if kinds <= {"crash_msgs/msg/Attendance"}:  # it hears its own words
            self.recorder.give_up("nothing came")
            file.unlink()
            return (
                "error: nothing came to be recorded: do replay and estimators run, with this ROS_DOMAIN_ID and "
                f"in this namespace ({self.get_namespace()})?"
            )
        self._see_replay()
        missing = "; ".join(self._missing())
        try:
            if not self.full:
                self.recorder.close(missing)
        except OSError as error:
            self.full = error
        self.attending.leave()
        if self.full:
            why = f"{self.full.strerror}: the recording ends here"
            with suppress(OSError):
                self.recorder.give_up(why)
            return f"error: {file}: {why}; what came before can be read"
        said = f"{file}: {count} messages on {len(self.recorder.topics)} topics"
        if missing:
            return f"incomplete: {said}; {missing}"
        with suppress(Fault, NobodyReads):  # the terminal may be closed
            say(f"{said}, complete")
        return ""

    def _missing(self) -> list[str]:
        missing = self.account.missing()
        if not missing:
            return []
        others = self.attending.others
        missing += [f"{name} {others.how(name, others.state(name))}" for name in others.names(REPLAY)]
        if not self.finished:
            missing.append("record was told to end")
        return missing + [f"record stood still from {when}" for when in self.stood_still]


def said_within(data: bytes, namespace: str) -> bool:
    """Whether a DiagnosticArray is about a node of this namespace: all share one topic for it."""
    try:
        about = [status.name.split(":")[0] for status in deserialize_message(data, DiagnosticArray).status]
    except Exception:  # whatever a message that is none of its type makes the middleware say
        return False
    return any(namespace_of(name) == namespace for name in about)


def opened(name: str) -> Recorder:
    """A recorder to the file of that name; raises RecordError."""
    file = Path(name)
    if file.suffix != ".mcap":
        raise RecordError(f"parameter to must be a file that ends in .mcap, got {name!r}: -p to:=estimates.mcap")
    try:
        return Recorder(file)
    except FileExistsError:
        raise RecordError(f"parameter to: {file} exists already: take another name, nothing is overwritten") from None
    except OSError as error:
        hint = f"there is no folder {file.parent}: make it first" if not file.parent.is_dir() else error.strerror
        raise RecordError(f"parameter to: {file} cannot be written: {hint}") from None


def main() -> int:
    return run(RecordNode, until=lambda node: node.done, close=RecordNode.end)


if __name__ == "__main__":
    sys.exit(main())
