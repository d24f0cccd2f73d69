"""Whether the viewer has got all there is to draw of the newest pass: of each estimator, and of the diagnosis."""

import time
from collections.abc import Mapping
from contextlib import suppress

from crash_msgs.msg import Ranking, ReplayState

from crash_replay.attendance import GONE
from crash_replay.attending import Attending
from crash_replay.recording import RecordingError
from crash_replay.ros_messages import decoded

from .revised_estimates import RevisedEstimates
from .whole_estimates import QUIET, STAYS, WholeEstimates

DIAGNOSIS = "diagnosis"
"""The role, and the name, of the node whose findings are drawn."""
ON_ITS_WAY = 0.5
"""s: what one node has said before another answers it comes that little after the answer at most."""


class Account:
    def __init__(
        self,
        attending: Attending,
        estimates: Mapping[str, WholeEstimates],
        revised: Mapping[str, RevisedEstimates] = {},
    ):
        """estimates, revised: by estimator."""
        self.attending, self.estimates, self.revised = attending, estimates, revised
        self.total = 0
        self.finals: set[int] = set()  # passes that the diagnosis has given a final answer on
        self.found_at = time.monotonic()  # when it has said something for the last time
        self.at_work = 0.0  # when it was not done yet, as far as was seen

    def begin_test(self, total: int) -> None:
        self.total = total
        self.finals.clear()

    def hear(self, kind: type, raw: bytes) -> None:
        """Something that the diagnosis says."""
        self.found_at = time.monotonic()
        with suppress(RecordingError):  # who draws it says so
            if kind is Ranking and (ranking := decoded(raw, Ranking)).final:
                self.finals.add(ranking.run)

    def replay_is_over(self) -> bool:
        """Whether it has sent the last sample of the pass, or is not there any more."""
        state = self.attending.replay_state
        finished = state is not None and state.state == ReplayState.FINISHED
        return finished or self.attending.replay_is_there() is False

    def settled(self) -> bool:
        """Whether nothing more is to be expected."""
        run, _, sent = self._pass()
        over = self.replay_is_over()
        return (
            bool(self.total)
            and all(one.reached(run, sent) or (over and one.waits_for_nothing()) for one in self.estimates.values())
            and all(one.settled for one in self.revised.values())
            and all(self._is_through(name, run) for name in self.attending.others.names(DIAGNOSIS))
        )

    def missing(self) -> int:
        """Samples of the pass that an estimator has said something on, and that cannot be drawn."""
        run, *_ = self._pass()
        lost = [stream.lost for one in self.estimates.values() for stream in one.streams.values() if stream.run == run]
        return max(lost, default=0)

    def lacking(self) -> list[str]:
        """A text on each that is not drawn as a whole."""
        run, first, sent = self._pass()
        lines = [f"{name} {lacks}" for name, one in self.estimates.items() if (lacks := one.lacks(run, first, sent))]
        lines += [f"{name} {one.why_not}" for name, one in self.revised.items() if one.why_not]
        if not self.estimates:
            lines.append("no estimator was heard")
        for name in self.attending.others.names(DIAGNOSIS):
            if run not in self.finals:
                word = self.attending.others.word(name)
                why = word.reason or self.attending.others.how(name, self.attending.others.state(name))
                lines.append(f"no final answer of the diagnosis ({why})")
        return lines

    def _pass(self) -> tuple[int, int, int]:
        """Run, first sample and the one after the last of the newest pass; of the whole test till it is over."""
        state = self.attending.replay_state
        if state is None:
            runs = [stream.run for one in self.estimates.values() for stream in one.streams.values()]
            return max(0, *runs) if runs else 0, 0, self.total
        return state.run, state.first, state.number if state.state == ReplayState.FINISHED else self.total

    def _is_through(self, name: str, run: int) -> bool:
        others, now = self.attending.others, time.monotonic()
        word, state = others.word(name), others.state(name)
        said_all = word.done and (word.run == run or bool(word.reason))
        if not said_all:
            self.at_work = now
        # a little after its last word: what it has added to the estimators is on its way from them
        quiet = now - self.found_at > QUIET and now - self.at_work > ON_ITS_WAY * said_all
        return quiet and (said_all or state in GONE or others.silence(name) > STAYS)
