"""What the demonstration sees of the graph: how far the replay is, and what estimators and diagnosis say."""

import time
from collections.abc import Sequence
from functools import partial

from crash_msgs.msg import Misfit, Ranking, ReplayState, Samples, TestInfo
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from rclpy.subscription import Subscription

from crash_replay.attending import Attending, Progress
from crash_replay.qos import LATCHED, SAID, UNACKNOWLEDGED

from ..core.estimate import Description, Estimate
from ..nodes.estimate_messages import description_from, estimates_from
from ..nodes.viewer_messages import misfit_block, ranking_block
from ..nodes.whole_estimates import TOPICS, WholeEstimates, about_of
from ..viewer.findings import MisfitBlock, RankingBlock
from .terminal import bar

SETTLED = 0.3
"""s for which all estimators must have been found: they find who listens a little later than they are found."""


class Said:
    """What one estimator has said in the newest pass, as it came."""

    def __init__(self) -> None:
        self.messages: dict[str, list[bytes]] = {topic: [] for topic in TOPICS}
        self.run = 0

    def add(self, topic: str, raw: bytes) -> None:
        about = about_of(raw, TOPICS[topic])
        if about.run != self.run or about.number == 0:
            self.messages[topic].clear()
            self.run = about.run
        self.messages[topic].append(raw)

    def found(self) -> tuple[Description, list[Estimate]] | None:
        """The estimates as the estimator made them; None where it has said nothing."""
        if not all(self.messages.values()):
            return None
        said = [[deserialize_message(raw, kind) for raw in self.messages[topic]] for topic, kind in TOPICS.items()]
        return description_from(*(messages[0] for messages in said)), estimates_from(*said)


class Watch(Node):
    """Listens, and takes part in the attendance: the replay does not begin before all is heard."""

    def __init__(self, names: Sequence[str], for_tables: bool):
        """names: of the estimators; for_tables: keep all that they say."""
        super().__init__("demo")
        self.test: TestInfo | None = None
        self.counted: Subscription | None = None
        self.found_since = time.monotonic()
        self.attending = Attending(self, "demo", self._progress)
        self.said = {name: Said() for name in names}
        keep = {name: said.add if for_tables else lambda topic, raw: None for name, said in self.said.items()}
        self.estimates = {name: WholeEstimates(self, name, self.attending, keep[name]) for name in names}
        self.create_subscription(TestInfo, "test", lambda message: setattr(self, "test", message), LATCHED)
        self.findings: list[RankingBlock | MisfitBlock] = []  # that nobody has taken yet
        for topic, kind, block in (("ranking", Ranking, ranking_block), ("misfit", Misfit, misfit_block)):
            take = partial(lambda block, message: self.findings.append(block(message)), block)
            self.create_subscription(kind, f"diagnosis/{topic}", take, SAID)
        self.attending.tell()

    def _progress(self) -> Progress:
        """What there is to say on `attendance`: it needs no samples, and so has dealt with all that were sent."""
        run, number = (self.state.run, self.state.number) if self.state else (0, 0)
        return Progress(run, self.total, number, ready=self.counted is not None)

    def look(self) -> None:
        """Be ready once all estimators can be heard, and tell the replay at its end that it may go."""
        if not all(one.found for one in self.estimates.values()):
            self.found_since = time.monotonic()
        elif not self.counted and time.monotonic() - self.found_since > SETTLED:
            self.counted = self.create_subscription(Samples, "samples", lambda raw: None, UNACKNOWLEDGED, raw=True)
            self.attending.tell()
        if self.finished and self.attending.own.next < self.state.number:
            self.attending.tell()

    def new_findings(self) -> list[RankingBlock | MisfitBlock]:
        """What the diagnosis has said since the last time."""
        found, self.findings = self.findings, []
        return found

    @property
    def state(self) -> ReplayState | None:
        return self.attending.replay_state

    @property
    def waiting(self) -> bool:
        """Whether the replay has yet to begin."""
        return self.state is None or self.state.state == ReplayState.WAITING

    @property
    def paused(self) -> bool:
        return self.state is not None and self.state.state == ReplayState.PAUSED

    @property
    def finished(self) -> bool:
        """Whether the replay has sent its last sample."""
        return self.state is not None and self.state.state == ReplayState.FINISHED

    @property
    def total(self) -> int:
        """Samples of the recording; 0 while it is not known."""
        return self.test.samples if self.test else 0

    @property
    def run(self) -> int:
        return self.state.run if self.state else 0

    def has(self, name: str) -> int:
        """Samples of the newest pass that an estimator has said everything on."""
        return self.estimates[name].has(self.run)

    def settled(self, name: str) -> bool:
        """Whether all that an estimator has to say of the whole test has come, or cannot come any more."""
        return bool(self.total) and self.estimates[name].reached(self.run, self.total)

    def lacks(self, name: str) -> str:
        """What is missing of the whole test of an estimator, and why."""
        first = self.state.first if self.state else 0
        return self.estimates[name].lacks(self.run, first, self.total)

    def lost(self) -> int:
        """Samples that an estimator has said nothing on, or that could not be had of it."""
        lost = (stream.lost for one in self.estimates.values() for stream in one.streams.values())
        return max(lost, default=0)

    def progress(self, encoding: str | None) -> str:
        """One line: time in the crash, samples, rate and lost samples."""
        state = self.state
        if state is None or not state.number:
            return "no sample yet"
        rate = state.rate_actual or state.rate_asked
        paused = "  paused" if self.paused else ""
        return (
            f"{1e3 * state.time:6.1f} ms  {bar(state.number / state.total, encoding)}  {state.number}/{state.total} "
            f"samples  {rate:.3g} x real time  {self.lost()} lost{paused}"
        )
