"""The samples of a replay in their order and whole: what is missing is asked for before what comes after it is handed
out, and what the replay has sent while this node was stopped is asked for though nothing comes after it."""

from collections import deque
from typing import Protocol

from crash_msgs.msg import Samples
from rclpy.node import Node

from crash_replay.attending import Attending

from ..following.arrivals import Arrival, Arrivals, Waiting
from ..kept import Rows
from .asking import Asking
from .catching_up import CatchingUp, Place


class Consumer(Protocol):
    """What is done with them."""

    def begin_pass(self) -> None: ...
    def keep(self, rows: Rows) -> None: ...  # they have come, in whatever order
    def gap(self, number: int) -> tuple[int, int] | None: ...  # what is wanted before sample `number`: start, stop
    def take(self, samples: Waiting) -> None: ...  # the next ones
    def leave_out(self, run: int, number: int) -> None: ...  # samples up to this one have come already
    def stamp_of(self, rows: Rows) -> int: ...  # ns, of the first
    def fitting(self, samples: Samples) -> Rows: ...  # those of an answer; raises RecordingError


class Intake:
    def __init__(self, node: Node, replay: str, attending: Attending, consumer: Consumer):
        """replay: as of Asking."""
        self.log, self.attending, self.consumer = node.get_logger(), attending, consumer
        self.arrivals, self.waiting = Arrivals(), deque[Waiting]()
        self.asked_again = 0  # samples
        self.listening = False  # to a test
        self.rest_of = 0  # the pass that more is asked of while nothing waits
        self.refused: Place | None = None  # nothing more can be had from here on
        self.asking = Asking(node, replay, attending, self._on_asked, consumer.fitting)
        self.catching_up = CatchingUp(node, attending, self._place, self._ask_for_rest)

    def begin_test(self, listening: bool) -> None:
        self.arrivals, self.refused, self.listening = Arrivals(), None, listening
        self.catching_up.came()
        self.forget_waiting()

    def forget_waiting(self) -> list[Waiting]:
        """What waits is no longer wanted; it is given back."""
        forgotten = list(self.waiting)
        self.asking.begin_test()
        self.waiting.clear()
        return forgotten

    @property
    def next(self) -> int:
        """Every sample of the pass before this one has been handed out, or cannot be had."""
        return self.waiting[0].arrival.rows.number if self.waiting else self.arrivals.next

    @property
    def why_not(self) -> str:
        """Why what is missing cannot be had."""
        return self.asking.why_not

    def receive(self, run: int, rows: Rows, stamp_ns: int) -> None:
        """Samples of a pass have come; stamp_ns: of the first of them."""
        self.catching_up.came()
        arrival = self.arrivals.receive(run, rows)
        if arrival.repeated:
            self.log.warning(
                f"samples from number {rows.number} come after number {rows.number + arrival.repeated - 1}: what was "
                "seen before is left out; is there a second replay?",
                throttle_duration_sec=5.0,
            )
            if not len(arrival.rows.time_ns):
                return self.consumer.leave_out(run, rows.end - 1)
            stamp_ns += int(arrival.rows.time_ns[0] - rows.time_ns[0])
        self.consumer.keep(arrival.rows)
        self.waiting.append(Waiting(arrival, run, stamp_ns, self._first(run)))
        self._work()

    def _work(self) -> None:
        """Hand out what waits, unless what was missed before it may still come."""
        while self.waiting and not self.asking.busy:
            head = self.waiting[0]
            if head.arrival.begins and not head.begun:
                head.begun = True
                self.consumer.begin_pass()
            gap = None if head.without else self.consumer.gap(head.arrival.rows.number)
            if gap and self.asking.ask(*gap):
                return
            self.consumer.take(self.waiting.popleft())

    def _on_asked(self, rows: Rows | None) -> None:
        if not self.waiting:
            return self._on_rest(rows)
        head = self.waiting[0]
        if rows is None:
            head.without = True
        else:
            self.consumer.keep(rows)
            head.sent_again += len(rows.time_ns)
            self.asked_again += len(rows.time_ns)
            missed = rows.without(max(0, head.first - rows.number))
            if len(missed.time_ns):  # of this pass: to be handed out themselves
                found = Arrival(missed, begins=False, lost=0, repeated=0)
                self.waiting.appendleft(Waiting(found, head.run, self.consumer.stamp_of(missed), head.first))
        self._work()

    # what the replay has sent, and nothing after it comes

    def _first(self, run: int) -> int:
        """Number of the first sample of a pass, as the replay says it, else the first that came."""
        state = self.attending.replay_state
        return state.first if state and state.run == run else self.arrivals.first

    def _place(self) -> Place | None:
        """While samples still come, who joins late learns from the first of them what it lacks."""
        state = self.attending.replay_state
        place = (self.arrivals.run if self.arrivals.begun else -1), self.arrivals.next
        free = self.listening and not (self.waiting or self.asking.busy)
        due = self.arrivals.begun or (state and state.state == state.FINISHED)
        return place if free and due and place != self.refused else None

    def _ask_for_rest(self, run: int, start: int, stop: int) -> None:
        self.rest_of = run
        if self.asking.ask(start, stop):
            self.log.warning(f"samples {start} to {stop - 1} have not come: asking the replay for them")
        else:
            self._on_rest(None)

    def _on_rest(self, rows: Rows | None) -> None:
        if rows is None:
            self.refused = self._place()
            return
        self.asked_again += len(rows.time_ns)
        self.receive(self.rest_of, rows, self.consumer.stamp_of(rows))
        self.catching_up.ask_at_once()
