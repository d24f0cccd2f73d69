"""Listens to a run: what the estimators and the diagnosis say, how far the replay is, who says what of himself."""

import time
from collections.abc import Callable, Sequence
from functools import partial

import rclpy
from crash_msgs.msg import Attendance as AttendanceMessage
from crash_msgs.msg import ParametersBlock, Ranking, ReplayState
from crash_msgs.srv import GetEstimates
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.task import Future

from crash_replay.attendance import Attendance, Word
from crash_replay.attending import TOPIC
from crash_replay.qos import EVERY_SAMPLE, EVERY_SAMPLE_SAID, LATCHED, SAID

from .contents import answer_in, estimates_in

PIECE = 100
"""Samples that an estimator is asked for at once."""
PATIENCE = 10.0
"""s for it to answer; then it is asked again."""
PAUSE = 1.0
"""s until it is asked again where it had nothing to give."""


class Observer:
    """A node of the judge's own, on the run's domain. It takes no part: nobody waits for it."""

    def __init__(self, domain: int, estimators: Sequence[str], diagnosis: str = "diagnosis"):
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.node = Node("observer", context=self.context)
        self.executor = EventsExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.words = Attendance()
        self.state: ReplayState | None = None
        self.sent_any = False
        self.estimates: dict[str, dict[int, str]] = {name: {} for name in estimators}
        self.contradictions: dict[str, set[int]] = {name: set() for name in estimators}
        self.final: dict[int, str] = {}  # what the diagnosis has said at the end, by revision
        node = self.node
        for name in estimators:
            hear = partial(self._on_parameters, name)
            node.create_subscription(ParametersBlock, f"{name}/block/parameters", hear, EVERY_SAMPLE)
        self._clients = {name: node.create_client(GetEstimates, f"{name}/get_estimates") for name in estimators}
        self._asked: dict[str, tuple[Future, float]] = {}  # the newest call, and when another may be made
        node.create_subscription(Ranking, f"{diagnosis}/ranking", self._on_ranking, SAID)
        node.create_subscription(ReplayState, "replay_state", self._on_state, LATCHED)
        node.create_subscription(AttendanceMessage, TOPIC, self._on_word, EVERY_SAMPLE_SAID)

    def close(self) -> None:
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)

    def spin(self, seconds: float, until: Callable[[], bool] = lambda: False) -> bool:
        """Listen for so long, or until something is so -> whether it is."""
        deadline = time.monotonic() + seconds
        while not (done := until()) and time.monotonic() < deadline:
            self.executor.spin_once(timeout_sec=0.02)
        return done

    @property
    def played(self) -> float:
        """% of the samples that have been sent."""
        return 100.0 * self.state.number / self.state.total if self.state and self.state.total else 0.0

    @property
    def finished(self) -> bool:
        return self.state is not None and self.state.state == ReplayState.FINISHED

    @property
    def total(self) -> int:
        return self.state.total if self.state else 0

    def ask_for_missed(self) -> None:
        """Once the replay is through: what was said while the judge heard nothing, once more. Waits for nobody."""
        for name, said in self.estimates.items() if self.finished else ():
            start = next((number for number in range(self.total) if number not in said), None)
            call, again_at = self._asked.get(name, (None, 0.0))
            now, client = time.monotonic(), self._clients[name]
            if start is None or now < again_at or not client.service_is_ready():
                continue
            if call:
                client.remove_pending_request(call)
            call = client.call_async(GetEstimates.Request(start=start, stop=min(start + PIECE, self.total)))
            call.add_done_callback(partial(self._on_answer, name))
            self._asked[name] = call, now + PATIENCE

    def has_heard_all(self, name: str) -> bool:
        return len(self.estimates[name]) >= self.total

    def _on_answer(self, name: str, call) -> None:
        answered = not call.cancelled() and call.exception() is None and call.result().success
        if answered:
            self._on_parameters(name, call.result().parameters)
        self._asked[name] = call, time.monotonic() + (0.0 if answered else PAUSE)

    def _on_parameters(self, name: str, message: ParametersBlock) -> None:
        for number, digest in estimates_in(message):
            if self.estimates[name].setdefault(number, digest) != digest:
                self.contradictions[name].add(number)
                self.estimates[name][number] = digest

    def _on_ranking(self, message: Ranking) -> None:
        if message.final:
            self.final[message.revision] = answer_in(message)

    def _on_state(self, message: ReplayState) -> None:
        self.state = message
        self.sent_any |= message.number > 0

    def _on_word(self, message: AttendanceMessage) -> None:
        self.words.hear(Word(*(getattr(message, field) for field in Word._fields)))
