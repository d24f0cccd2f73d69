"""The node of `estimator`: a model and a method that follow the replayed samples; `estimator_command` says with
what."""

import sys
from collections.abc import Callable
from functools import partial
from typing import Any

from crash_msgs.msg import Samples, TestInfo
from crash_msgs.srv import AddEffect, RemoveEffect
from rclpy.node import Node
from std_srvs.srv import Trigger

from crash_replay.attending import Attending, Progress
from crash_replay.complaints import Complaints
from crash_replay.health import HealthReport
from crash_replay.limits import most_samples
from crash_replay.node_parameters import declare_parameters, follow_changes, given_to, names_in
from crash_replay.qos import EVERY_SAMPLE, LATCHED, UNLATCHED
from crash_replay.recording import RecordingError
from crash_replay.ros_messages import stamp_ns, test_from_msg
from crash_replay.ros_runtime import run

from ..core.compile_cache import compiling_said
from ..core.effects.change import remove_effect
from ..core.structure import ModelError
from ..following.again import estimated_again
from ..following.arrivals import Waiting, missing_text
from ..following.columns import Columns, FilterFailure
from ..following.follower import Follower
from ..kept import Kept, Rows
from .channel_feed import ChannelFeed
from .effect_requests import with_effect
from .estimates_again import EstimatesAgain
from .estimator_health import estimator_health
from .estimator_model import EstimatorModel, model_asked
from .estimator_parameters import table_for
from .estimator_topics import EstimatorTopics
from .hearing import hear
from .intake import Intake
from .samples import Received, fitting, received, rows_of, what_is_wrong


class EstimatorNode(Node):
    def __init__(self, **options) -> None:
        """options: of rclpy's Node, such as parameter_overrides. Raises ModelError or ParameterError with one line."""
        super().__init__("estimator", automatically_declare_parameters_from_overrides=True, **options)
        asked = declare_parameters(self, table := table_for(given_to(self)))
        with compiling_said(self.get_logger().info):
            self.model = model_asked(asked)
        self.test_message: TestInfo | None = None
        self.unlatched: TestInfo | None = None  # come by itself, and to come once more if its publisher latches
        self.follower: Follower | None = None  # None: no test yet, or one that the model does not fit
        self.latest: Columns | None = None  # estimates of this test
        self.stopped = ""  # why no filter can go on with these numbers, until the next pass
        self.at_fault = ""  # why nothing is estimated on this test
        self.complaints = Complaints(lambda line: self.get_logger().error(line))
        self.warnings = Complaints(lambda line: self.get_logger().warning(line))
        self.topics = EstimatorTopics(self, names_in(asked["value_topics"]))
        self.again = EstimatesAgain(self)
        self.attending = Attending(self, "estimator", self._progress)
        self.intake = Intake(self, asked["replay"], self.attending, self)
        HealthReport(self, "filter", partial(estimator_health, self))
        self.create_service(Trigger, "~/reset", self._on_reset)
        self.create_service(AddEffect, "~/add_effect", self._on_add_effect)
        self.create_service(RemoveEffect, "~/remove_effect", self._on_remove_effect)
        follow_changes(self, table, self._on_settings)
        self.feed, self.feed_run = ChannelFeed(self, "samples", self._on_feed_begins, self._on_feed), -1
        hear(self, self.complaints, TestInfo, "test", self._on_test, LATCHED)
        hear(self, self.complaints, TestInfo, "test", self._on_unlatched_test, UNLATCHED)
        hear(self, self.complaints, Samples, "samples", self._on_samples, EVERY_SAMPLE, received)
        self.attending.tell()

    def _on_unlatched_test(self, message: TestInfo) -> None:
        """From a publisher that latches nothing: rosbag2's, of a bag without quality of service."""
        if message != self.test_message:
            self._begin_test(message)
            self.unlatched = message

    def _on_test(self, message: TestInfo) -> None:
        twice, self.unlatched = message == self.unlatched, None
        again = self.feed.active and message == self.test_message  # rosbag2's player begins its bag once more
        if not (twice or again):
            self._begin_test(message)

    def _begin_test(self, message: TestInfo) -> None:
        self.test_message, self.follower, self.stopped, self.at_fault = message, None, "", ""
        self.latest = None
        self.intake.begin_test(listening=False)
        try:
            test = test_from_msg(message)
            estimator = self.model.estimator(test)
        except (ModelError, RecordingError) as error:
            self.at_fault = " ".join(str(error).split())
            self.get_logger().error(f"{self.at_fault}; nothing is estimated on this test")
            return
        self.follower = Follower(estimator, Kept(test))
        self.intake.begin_test(listening=True)
        self.again.begin_test(stamp_ns(message.time_zero))
        self._say_from_now_on(message)
        self.get_logger().info(f"test {test.id}: model {self.model.structure.name}, method {self.model.method}")
        self.feed.set_test(message)

    def _on_samples(self, message: Received) -> None:
        if self.follower is None or not self._fits(message):
            return self.leave_out(message.run, message.number + max(0, len(message.time_ns) - 1))
        self.intake.receive(message.run, rows_of(message), message.stamp_ns)

    def _fits(self, message: Received) -> bool:
        wrong = what_is_wrong(message, self.follower.kept, self.test_message.samples)
        if wrong:
            self.complaints.complain(
                "misfit",
                f"samples from number {message.number}: {wrong}: left out; is there a second replay, of another test?",
            )
        return not wrong

    def fitting(self, samples: Samples) -> Rows:
        return fitting(samples, self.follower.kept, self.test_message.samples)

    def _on_feed_begins(self, renumbered: bool) -> None:
        self.feed_run += 1
        if renumbered and self.follower:
            kept = self.follower.kept
            self.follower = Follower(self.follower.estimator, Kept(kept.test))

    def _on_feed(self, rows: Rows) -> None:
        if self.follower and rows.end <= most_samples(rows.values.shape[1]):
            self.intake.receive(self.feed_run, rows, self.stamp_of(rows))

    # what is done with the samples, in their order: the intake's consumer

    def begin_pass(self) -> None:
        self.stopped = ""
        if self.follower.floor:  # what was reset
            self.follower = Follower(self.follower.estimator, self.follower.kept)
            self.again.begin(self.follower, self.model.revision)

    def keep(self, rows: Rows) -> None:
        self.follower.keep(rows)

    def gap(self, number: int) -> tuple[int, int] | None:
        return None if self.stopped else self.follower.gap(number)

    def take(self, samples: Waiting) -> None:
        self._tell_of_missing(samples)
        self._estimate(samples)
        self.leave_out(samples.run, samples.arrival.rows.end - 1)

    def leave_out(self, run: int, number: int) -> None:
        self.topics.answer(run, number, self.intake.arrivals.missed)

    def stamp_of(self, rows: Rows) -> int:
        return self.topics.time_zero + int(rows.time_ns[0])

    def _progress(self) -> Progress:
        """What there is to say on `attendance`."""
        test, follower = self.test_message, self.follower
        if test is None:
            return Progress()
        if follower is None:
            return Progress(total=test.samples, next=test.samples, done=True, reason=self.at_fault)
        arrivals, number = self.intake.arrivals, self.intake.next
        state = self.attending.replay_state
        sent = state.number if state and state.state == state.FINISHED and state.run == arrivals.run else test.samples
        missing = follower.kept.missing(number)
        reason = self.stopped or (self.intake.why_not if missing or self.intake.refused else "")
        through = number >= sent and not (self.intake.waiting or self.topics.later.waiting)
        return Progress(arrivals.run, test.samples, number, missing, done=through, reason=reason)

    def _estimate(self, samples: Waiting) -> None:
        if self.stopped:
            return
        try:
            columns = self.follower.follow(samples.arrival.rows)
        except FilterFailure as failure:
            self.stopped, columns = str(failure), failure.done
            self.get_logger().error(
                f"{failure}; it starts again with the next pass over the test, or with the service ~/reset"
            )
        if columns:
            self.latest = columns
            self.topics.estimates(samples.run, columns, samples.stamp_ns)

    def _tell_of_missing(self, samples: Waiting) -> None:
        """Say what did not come before these samples, and what the estimates rest on."""
        arrival, number = samples.arrival, samples.arrival.rows.number
        if not (arrival.lost or arrival.begins or samples.sent_again):
            return
        holds_from = self.follower.holds_from(number)
        missing = arrival.lost or samples.sent_again + self.follower.kept.missing(number)
        if missing:
            text = missing_text(number, missing, samples.sent_again, holds_from, arrival.begins)
            self.warnings.complain("lost", text)
            self.topics.event("lost", "samples", float(missing), text, samples.run, number, samples.stamp_ns)
        self._publish_state(samples.run, number, samples.stamp_ns)

    def _publish_state(self, run: int, number: int, stamp_ns: int) -> None:
        counts = {"missed": self.intake.arrivals.missed, "asked_again": self.intake.asked_again}
        self.topics.tell_state(self.model, run, number, stamp_ns, holds_from=self.follower.holds_from(number), **counts)

    def _on_add_effect(self, request: AddEffect.Request, response: AddEffect.Response) -> AddEffect.Response:
        test, model = self.follower.kept.test if self.follower else None, self.model
        return self._answer(
            lambda: model.with_structure(with_effect(model.structure, request, model.known_effects, test)), response
        )

    def _on_remove_effect(
        self, request: RemoveEffect.Request, response: RemoveEffect.Response
    ) -> RemoveEffect.Response:
        model = self.model
        return self._answer(
            lambda: model.with_structure(remove_effect(model.structure, request.effect, request.target)), response
        )

    def _answer(self, change: Callable[[], EstimatorModel], response):
        try:
            response.message = self._change(change())
            response.success = True
        except (ModelError, RecordingError) as error:
            response.message = " ".join(str(error).split())
        return response

    def _on_settings(self, values: dict[str, Any]) -> None:
        self._change(self.model.with_settings(values))

    def _change(self, model: EstimatorModel) -> str:
        """Go on with another model, as if it had been this one from the first sample on; what is new, in a line.

        Raises ModelError or RecordingError, and all stays as it is.
        """
        old, done = self.follower, ""
        try:
            model.try_out()
            if old:
                self.follower, done = estimated_again(old, model.estimator(old.kept.test))
        except FilterFailure as failure:
            raise ModelError(f"{failure}: model {self.model.structure.name} stays as it is") from None
        self.model, self.stopped, self.latest = model, "", None
        effects = ", ".join(model.effects()) or "no effect"
        text = f"revision {model.revision}: {model.structure.name} with {effects}" + (f"; {done}" if done else "")
        self.get_logger().info(text)
        if old:
            self._tell_of_change(text)
        elif self.test_message:  # which the model may now fit
            self._begin_test(self.test_message)
        return text

    def _tell_of_change(self, text: str) -> None:
        number, run, revision = self.follower.position, self.intake.arrivals.run, self.model.revision
        self._say_from_now_on(self.test_message)
        at = self.topics.time_zero + int(self.follower.kept.time_ns[max(0, number - 1)])
        self.topics.event("effect", "model", float(revision), text, run, number, at)
        self._publish_state(run, number, at)

    def _say_from_now_on(self, test: TestInfo) -> None:
        """What is said comes from the present model."""
        self.again.begin(self.follower, self.model.revision)
        self.topics.begin(self.follower.estimator.description, self.model.revision, test.time_zero)

    def _on_reset(self, _request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        if self.follower:
            waiting, self.stopped = self.intake.forget_waiting(), ""
            self.follower = Follower(self.follower.estimator, self.follower.kept, floor=self.intake.arrivals.next)
            self.again.begin(self.follower, self.model.revision)
            for samples in waiting:  # a replay in lock-step goes on
                self.leave_out(samples.run, samples.arrival.rows.end - 1)
        response.success, response.message = True, "the next sample starts from the model's initial values"
        return response


def main() -> int:
    return run(EstimatorNode, close=lambda node: node.attending.leave())


if __name__ == "__main__":
    sys.exit(main())
