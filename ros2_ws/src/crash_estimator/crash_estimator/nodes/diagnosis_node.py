"""The node of `diagnosis`: what the model lacks, asked as the samples come; `diagnosis_command` says with what."""

import sys
from functools import partial
from typing import TYPE_CHECKING, Any

from crash_msgs.msg import Ranking, Samples, TestInfo
from rclpy.node import Node
from rclpy.task import Future

from crash_replay.attending import Attending, Progress
from crash_replay.bag import read_bag
from crash_replay.complaints import Complaints
from crash_replay.health import HealthReport
from crash_replay.limits import most_samples
from crash_replay.node_parameters import declare_parameters, follow_changes, names_in
from crash_replay.qos import EVERY_SAMPLE, LATCHED
from crash_replay.recording import RecordingError
from crash_replay.ros_messages import stamp, stamp_ns, test_from_msg
from crash_replay.ros_runtime import run

from ..core.effects import EFFECTS
from ..core.effects.user import load_effects
from ..core.kinematics import Kinematics
from ..core.structure import ModelError, Structure
from ..kept import Kept, Rows
from ..model_file import load_model
from .asking import Asking
from .catching_up import CatchingUp
from .channel_feed import ChannelFeed
from .diagnosis_health import diagnosis_health
from .diagnosis_messages import Moment
from .diagnosis_parameters import PARAMETERS, Wanted
from .diagnosis_telling import Telling
from .diagnosis_worker import Task, Worker, WorkerError
from .hearing import hear
from .model_revisions import ModelRevisions
from .samples import Received, fitting, received, rows_of, what_is_wrong

if TYPE_CHECKING:  # an answer brings it along
    from ..core.diagnosis import OnlineAnswer

LOOK = 0.02
"""s of wall clock between two looks whether an answer has come."""

TOLERATED = 0.01
"""Share of the samples so far that may be missing: the motion is integrated across small gaps only."""


class DiagnosisNode(Node):
    def __init__(self, **options) -> None:
        """options: of rclpy's Node. Raises ModelError, RecordingError or ParameterError with one line."""
        super().__init__("diagnosis", automatically_declare_parameters_from_overrides=True, **options)
        asked = declare_parameters(self, PARAMETERS)
        model, effects, replay = asked["model"], asked["effects"], asked["replay"]
        self.values, self.wanted, self.adds = asked, Wanted.from_values(asked), asked["add_first"]
        self.effects = EFFECTS | (load_effects(effects) if effects else {})
        structure = load_model(model, self.effects)
        self.bags = names_in(asked["with_bags"])
        for bag in self.bags:
            Kinematics(structure, read_bag(bag).test)
        self.kept: Kept | None = None  # None: no test yet, or one that the model does not fit
        self.time_zero = 0  # stamp of the impact, ns
        self.run, self.total, self.end = 0, 0, 0  # samples of the test; number of the next sample
        self.asked: Moment | None = None  # what the last task is, or was, about; None: something has changed since
        self.stopped = ""  # why nothing can be said
        self.cannot_be_had = ""  # why, of what was missed in this pass
        self.at_fault = ""  # why nothing is diagnosed on this test
        self.done = Future()  # when nothing more can be diagnosed
        self.prepared = False  # its process has compiled its code
        self.rest_of = 0  # the pass that what has not come is asked of
        self.finals: dict[tuple[int, int], OnlineAnswer] = {}  # by revision and samples missing
        self.complaints = Complaints(lambda line: self.get_logger().error(line))
        self.telling = Telling(self, structure)
        self.worker = Worker(structure, effects, self.bags)
        test = lambda: self.kept.test if self.kept else None  # noqa: E731
        others = names_in(asked["estimators"])
        self.model = ModelRevisions(self, structure, self.effects, others, test, self._on_other_model)
        self.attending = Attending(self, "diagnosis", self._progress)
        self.asking = Asking(self, replay, self.attending, self._on_samples_again, self._fitting)
        self.catching_up = CatchingUp(self, self.attending, self._place, self._ask_for_rest)
        self.feed = ChannelFeed(self, "samples", self._on_feed_begins, self._on_feed)
        HealthReport(self, "answers", partial(diagnosis_health, self))
        hear(self, self.complaints, TestInfo, "test", self._on_test, LATCHED)
        hear(self, self.complaints, Samples, "samples", self._on_samples, EVERY_SAMPLE, received)
        self.create_timer(LOOK, self._look)
        follow_changes(self, PARAMETERS, self._on_parameters)
        self.attending.tell()

    @property
    def structure(self) -> Structure:
        """The model that is asked about, with what was added to it."""
        return self.model.structure

    @property
    def revision(self) -> int:
        return self.model.number

    def destroy_node(self) -> None:
        self.worker.close()
        super().destroy_node()

    # what comes

    def _on_test(self, message: TestInfo) -> None:
        self._begin_anew()
        self.kept, self.finals, self.at_fault = None, {}, ""
        self.total, self.run, self.end = message.samples, -1, 0
        self.telling.begin_test()
        try:
            test = test_from_msg(message)
            Kinematics(self.structure, test)
        except (ModelError, RecordingError) as error:
            self.at_fault = " ".join(str(error).split())
            self.get_logger().error(f"{self.at_fault}; nothing is diagnosed on this test")
            return
        self.kept = Kept(test)
        self.time_zero = stamp_ns(message.time_zero)
        name = self.telling.name(self.structure)
        self.get_logger().info(f"test {test.id}: model {name}, with {len(self.bags)} other recordings")
        self.feed.set_test(message)

    def _on_samples(self, message: Received) -> None:
        if self.kept is None:
            return
        self.catching_up.came()
        if wrong := what_is_wrong(message, self.kept, self.total):
            self.complaints.complain(
                "misfit",
                f"samples from number {message.number}: {wrong}: left out; is there a second replay, of another test?",
            )
            return
        rows = rows_of(message)
        self.kept.put_rows(rows)
        if message.run != self.run or message.number == 0:
            self._begin_anew()
            self.run, self.end = message.run, rows.end
        self.end = max(self.end, rows.end)

    def _on_feed_begins(self, renumbered: bool) -> None:
        if self.kept is None:
            return
        if renumbered:
            self.kept = Kept(self.kept.test)
        self._begin_anew()
        self.run, self.end = self.run + 1, 0

    def _on_feed(self, rows: Rows) -> None:
        if self.kept is not None and rows.end <= most_samples(rows.values.shape[1]):
            self.kept.put_rows(rows)
            self.end = max(self.end, rows.end)

    def _fitting(self, samples: Samples) -> Rows:
        return fitting(samples, self.kept, self.total)

    def _place(self) -> tuple[int, int] | None:
        """What has come of the test, where more may be asked for."""
        free = self.kept is not None and not (self.asking.busy or self.cannot_be_had)
        return (self.run, self.end) if free else None

    def _ask_for_rest(self, run: int, start: int, stop: int) -> None:
        self.rest_of = run
        if not self.asking.ask(start, stop):
            self.cannot_be_had = self.asking.why_not

    def _on_samples_again(self, rows: Rows | None) -> None:
        if rows is None:
            self.cannot_be_had = self.asking.why_not
        elif self.kept is not None:
            self.kept.put_rows(rows)
            if rows.end > self.end or self.run != self.rest_of:
                self.run, self.end = self.rest_of, rows.end
            self.catching_up.ask_at_once()

    def _begin_anew(self) -> None:
        """What was asked is no longer the question."""
        self.asked, self.stopped, self.cannot_be_had = None, "", ""
        self.asking.begin_test()
        self.telling.begin_pass()
        self.worker.drop()

    def _progress(self) -> Progress:
        """What there is to say on `attendance`."""
        if self.kept is None:
            said = Progress(total=self.total, next=self.total, done=bool(self.total), reason=self.at_fault)
            return said._replace(ready=self.prepared)
        missing = self.kept.missing(self.end)
        final = self.asked is not None and self.asked.final and not self.worker.busy
        why = self.stopped or (self.cannot_be_had if missing or self.end < self.total else "")
        done = (final or bool(self.stopped)) and self.model.complete
        return Progress(self.run if self.run >= 0 else 0, self.total, self.end, missing, done, why, self.prepared)

    # what is asked and said

    def _look(self) -> None:
        """Take the answer that has come, and ask the next question."""
        if not (self.prepared or self.worker.busy):
            self.prepared = True
            self.attending.tell()
        try:
            reply = self.worker.reply()
        except WorkerError as error:
            self.at_fault, self.kept = str(error), None
            self.done.set_result(None)
            return
        if reply is not None and reply.error:
            self.stopped = reply.error
            self.get_logger().error(f"{reply.error}; no more is said until the test, the pass or the model changes")
        elif reply is not None and reply.answer is not None:
            self._conclude(self.asked, reply.answer)
        if self.kept is not None and self.end and not (self.worker.busy or self.asking.busy or self.stopped):
            self._ask()

    def _ask(self) -> None:
        time_ns = int(self.kept.time_ns[self.end - 1])
        asked, complete, every = self.asked, self.end == self.total, self.wanted.every_ns
        new = asked is None or time_ns - asked.time_ns >= every or (complete and asked.number < self.end - 1)
        if not (new or (complete and not asked.final)) or not self._has_enough():
            return
        at = stamp(self.time_zero + time_ns)
        self.asked = Moment(self.run, self.end - 1, time_ns, at, self.structure, self.revision, final=not new)
        known = self.finals.get((self.revision, self.kept.missing(self.end))) if self.asked.final else None
        if known:
            self._conclude(self.asked, known)
        else:
            recording, wanted = self.kept.until(self.end), self.wanted
            self.worker.ask(Task(self.structure, recording, self.asked.final, wanted.tolerance, wanted.seconds))

    def _has_enough(self) -> bool:
        """Whether next to no sample is missing; asks for those that are."""
        gap = self.kept.gap(0, self.end)
        if gap and not self.cannot_be_had:
            self.rest_of = self.run
            if self.asking.ask(*gap):
                return False
            self.cannot_be_had = self.asking.why_not
        missing = self.kept.missing(self.end)
        if missing > TOLERATED * self.end:
            self.stopped = f"{missing} of {self.end} samples were not seen"
            self.get_logger().warning(
                f"{self.stopped}: nothing is said on this pass; seek to the start for a whole one"
            )
        return not self.stopped

    def _conclude(self, at: Moment, answer: "OnlineAnswer") -> None:
        self.telling.tell(at, answer, self.kept, self.time_zero)
        if not at.final:
            return
        self._add_found(at, answer)
        self.attending.tell()

    def _add_found(self, at: Moment, answer: "OnlineAnswer") -> None:
        self.finals[at.revision, self.kept.missing(at.number + 1)] = answer
        if self.adds and answer.found and answer.verdict != Ranking.UNEXPLAINED:
            self.adds = False
            self.model.add(answer.found[0])

    def _on_parameters(self, new: dict[str, Any]) -> None:
        """What may be left, or the time there is for it, is another: the question is asked once more."""
        before, values = self.wanted, self.values | new
        self.wanted, self.values = Wanted.from_values(values), values
        if self.wanted._replace(every_ns=before.every_ns) != before:
            self.finals.clear()
            self._begin_anew()

    def _on_other_model(self) -> str:
        self._begin_anew()
        return self.telling.name(self.structure)


def main() -> int:
    return run(DiagnosisNode, until=lambda node: node.done, close=close)


def close(node: DiagnosisNode) -> str:
    """A line on what its answers lack, or ""."""
    lacks = node.attending.leave()
    return f"error: {node.at_fault}" if node.done.done() and node.at_fault else lacks


if __name__ == "__main__":
    sys.exit(main())
