"""What the demonstration sees of the graph: counts every sample and keeps what the estimators say."""

from collections.abc import Sequence

from crash_msgs.msg import Forces, Misfit, Parameters, Ranking, ReplayState, Residuals, Samples, TestInfo
from rcl_interfaces.srv import ListParameters
from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import Trigger

from crash_replay.qos import EVERY_SAMPLE, LATCHED, SAID, STREAM

from ..core.estimate import Description, Estimate
from ..nodes.estimate_messages import description_from, estimates_from
from ..nodes.viewer_messages import misfit_block, ranking_block
from ..viewer.findings import MisfitBlock, RankingBlock
from .terminal import bar

TOPICS = {"parameters": Parameters, "residuals": Residuals, "forces": Forces}


class Count:
    """Samples of the newest pass over the recording on one topic; they are numbered, so that what is missing shows."""

    def __init__(self):
        self.run, self.samples, self.next = 0, 0, 0

    def add(self, message: Samples | Parameters | Residuals | Forces) -> bool:
        """Whether the message begins a new pass."""
        begins = message.run != self.run
        if begins:
            self.run, self.samples = message.run, 0
        self.samples += len(message.time_ns)
        self.next = message.number + len(message.time_ns)
        return begins

    def lost(self, total: int = 0) -> int:
        """Missing samples, up to the newest one that has come or, at the end, of all."""
        return max(self.next, total) - self.samples


class Followed:
    """What one estimator has said in the newest pass."""

    def __init__(self):
        self.counts = {topic: Count() for topic in TOPICS}
        self.said: dict[str, list] = {topic: [] for topic in TOPICS}

    def add(self, topic: str, message: Parameters | Residuals | Forces) -> None:
        if self.counts[topic].add(message):
            self.said[topic].clear()
        self.said[topic].append(message)

    @property
    def samples(self) -> int:
        """Those of which everything has come."""
        return min(count.samples for count in self.counts.values())

    def lost(self, total: int = 0) -> int:
        return max(count.lost(total) for count in self.counts.values())

    def found(self) -> tuple[Description, list[Estimate]] | None:
        """The estimates as the estimator made them; None where it has said nothing."""
        if not self.samples:
            return None
        said = [self.said[topic] for topic in TOPICS]
        return description_from(*(messages[0] for messages in said)), estimates_from(*said)


class Watch(Node):
    """Listens to the replay and to the estimators."""

    def __init__(self, names: Sequence[str], others: Sequence[str] = ()):
        """names: of the estimators; others: further nodes that the replay must not begin without."""
        super().__init__("demo")
        self.test: TestInfo | None = None
        self.state: ReplayState | None = None
        self.time_ns: int | None = None  # of the last sample seen, since the impact
        self.samples = Count()
        self.followed = {name: Followed() for name in names}
        self.subscribed = False
        self.create_subscription(TestInfo, "test", lambda message: setattr(self, "test", message), LATCHED)
        self.create_subscription(ReplayState, "replay_state", lambda message: setattr(self, "state", message), LATCHED)
        for name, followed in self.followed.items():
            for topic, kind in TOPICS.items():
                self._follow(name, topic, kind, followed)
        self.findings: list[RankingBlock | MisfitBlock] = []  # that nobody has taken yet
        for topic, kind, block in (("ranking", Ranking, ranking_block), ("misfit", Misfit, misfit_block)):
            take = lambda message, block=block: self.findings.append(block(message))  # noqa: E731
            self.create_subscription(kind, f"diagnosis/{topic}", take, SAID)
        everybody = (*names, *others)
        self.clients_of = {name: self.create_client(ListParameters, f"{name}/list_parameters") for name in everybody}
        self.answers: dict[str, Future] = {}
        self.resume_service = self.create_client(Trigger, "replay/resume")

    def _follow(self, name: str, topic: str, kind: type, followed: Followed) -> None:
        self.create_subscription(kind, f"{name}/{topic}", lambda message: followed.add(topic, message), STREAM)

    def absent(self, names: Sequence[str]) -> list[str]:
        """Nodes of these that have not answered yet.

        Who answers has found all subscriptions of this node, because they were made before the clients that ask:
        its first message will not be missed.
        """
        for name in names:
            if name not in self.answers and self.clients_of[name].service_is_ready():
                self.answers[name] = self.clients_of[name].call_async(ListParameters.Request())
        return [name for name in names if name not in self.answers or not self.answers[name].done()]

    def be_counted(self) -> None:
        """Subscribe to `samples`, for which the replay waits."""
        if not self.subscribed:
            self.create_subscription(Samples, "samples", self._on_samples, EVERY_SAMPLE)
            self.subscribed = True

    def new_findings(self) -> list[RankingBlock | MisfitBlock]:
        """What the diagnosis has said since the last time."""
        found, self.findings = self.findings, []
        return found

    def _on_samples(self, message: Samples) -> None:
        self.samples.add(message)
        self.time_ns = message.time_ns[-1]

    def resume(self) -> None:
        """Let a replay that waits for its subscribers begin."""
        self.resume_service.call_async(Trigger.Request())

    @property
    def waiting(self) -> bool:
        """Whether the replay has yet to begin."""
        return self.state is None or self.state.state == ReplayState.WAITING

    @property
    def counted(self) -> int:
        """Subscribers on `samples` that the replay knows."""
        return self.state.subscribers if self.state else 0

    @property
    def total(self) -> int:
        """Samples of the recording; 0 while it is not known."""
        return self.test.samples if self.test else 0

    def lost(self, total: int = 0) -> int:
        """Samples missed, by whomever."""
        return self.samples.lost(total) + sum(followed.lost(total) for followed in self.followed.values())

    @property
    def heard(self) -> int:
        """Grows while anything comes."""
        return self.samples.samples + sum(followed.samples for followed in self.followed.values())

    def progress(self, encoding: str | None, total: int = 0) -> str:
        """One line: time in the crash, samples, rate and lost samples; at the end, lost of `total`."""
        if self.time_ns is None or self.state is None:
            return "no sample yet"
        share = self.samples.next / self.total if self.total else 0.0
        rate = self.state.rate_actual or self.state.rate_asked
        paused = "  paused" if self.state.state == ReplayState.PAUSED else ""
        return (
            f"{self.time_ns * 1e-6:6.1f} ms  {bar(share, encoding)}  {self.samples.next}/{self.total} samples  "
            f"{rate:.3g} x real time  {self.lost(total)} lost{paused}"
        )
