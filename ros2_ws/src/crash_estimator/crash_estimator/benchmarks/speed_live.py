"""The rows that need the graph: throughput, real time, latency, jitter, and what the viewer costs."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from crash_replay.bag import read_bag, write_bag
from crash_replay.same_messages import messages_by_topic

from ..core.compiled.estimator import CompiledEstimator
from ..core.methods import make_estimator
from ..model_file import load_model
from .speed_graph import Graph, Pass, jitter, latencies
from .speed_lockstep import burning, recorded, said
from .speed_named import making
from .speed_recordings import chain, ringing
from .speed_row import Row, per_call

BODIES = 3
"""Of the model: 3 equations, 6 parameters."""
SIZES = {"parameters": 2 * BODIES, "residuals": BODIES, "forces": BODIES, "bodies": BODIES + 1}
METHODS = ("mrls", "constrained_kalman")
FLAT_OUT = 1000.0
"""Times real time: the replay sends as fast as it is taken."""
KEPT = 0.99
"""Share of real time below which a rate is not held."""


@dataclass(frozen=True)
class Effort:
    """How long to measure."""

    singles: float = 1.0  # s at 10 kHz, of a throughput in single messages
    blocks: float = 10.0  # and in blocks
    seen: float = 40.0  # and in blocks that a viewer takes in
    turns: int = 6  # of throughputs, each kind once in each
    rounds: int = 2  # of latencies, each against its reference in turn
    hold: float = 60.0  # s that the highest rate must be held
    probe: float = 4.0  # s that a rate is tried before
    rates: tuple[float, ...] = (10e3, 20e3, 40e3)  # Hz
    latency: int = 2000  # samples, at 1 kHz
    jitter: float = 3.0  # s, at 1 kHz
    lockstep: int = 10  # runs


def ratio(rounds: np.ndarray, kind: int, other: int) -> float:
    """Of two kinds' figures, by the median over the rounds."""
    return float(np.median(rounds[:, kind] / rounds[:, other]))


class Live:
    """Bags, model and environment, made once."""

    def __init__(self, folder: Path, environment: dict[str, str], effort: Effort):
        self.folder, self.environment, self.effort = folder, environment, effort
        self.model = chain(BODIES, folder / "chain.yaml")
        self.runs = 0

    def bag(self, channels: int, seconds: float, rate: float) -> Path:
        return write_bag(ringing(channels, seconds, rate), self.folder / f"{channels}_{seconds:g}_{rate:g}.mcap", True)

    def graph(self, names: tuple[str, ...]) -> Graph:
        self.runs += 1
        return Graph(self.folder / f"run{self.runs}", self.environment, names)

    def throughput(self) -> Iterator[Row]:
        kinds = ("single messages", 1, self.effort.singles), ("blocks as the replay chooses", 0, self.effort.blocks)
        for title, block, seconds in kinds:
            rounds, lost = self._throughputs(self.bag(4, seconds, 10e3), block)
            relay, ours, alone = np.median(rounds, axis=0)
            of_relay, of_alone = (0.0 if lost else ratio(rounds, 1, k) for k in (0, 2))
            what = f"samples a second, replay to parameters and residuals, {title}"
            said = f"{ours:,.0f} /s, {lost} lost"
            yield Row(what, said, f"bare relay {relay:,.0f} /s", of_relay, None if block == 0 else 0.8)
            if block == 0:  # a block's samples cost the relay nothing: what bounds the node is its own computing
                beside = f"the recursion alone {alone:,.0f} /s"
                yield Row(f"{what}, beside computing them", said, beside, of_alone, 0.8)

    def _throughputs(self, bag: Path, block: int) -> tuple[np.ndarray, int]:
        """Samples a second of relay, ours and the recursion alone in turns; samples that ours has lost."""
        runs = []

        def ours() -> float:
            runs.append(self._pass(bag, block))
            return runs[-1].per_second

        relay = lambda: self._pass(bag, block, relay=True).per_second  # noqa: E731
        rounds = self._in_turns(relay, ours, lambda: self._alone(bag))
        return rounds, sum(run.lost for run in runs)

    def _in_turns(self, *kinds: Callable[[], float]) -> np.ndarray:
        """(rounds, kinds): each kind's figure in every round, the other way round every second time.

        A pass takes a second or two, and on a machine that others use scatters by more than what is to be measured.
        What they do for longer than a round is in all of its figures, and not in their ratio.
        """
        rounds = np.zeros((self.effort.turns, len(kinds)))
        for k, row in enumerate(rounds):
            for j in range(len(kinds))[:: 1 if k % 2 == 0 else -1]:
                row[j] = kinds[j]()
        return rounds

    def _alone(self, bag: Path) -> float:
        """Samples a second of the estimator's own computing, in this process."""
        recording = read_bag(bag)
        estimator = make_estimator(load_model(str(self.model)), recording.test, "constrained_kalman")
        assert isinstance(estimator, CompiledEstimator)
        part = recording.time_ns[:1000], recording.values[:1000]
        return 1000.0 / per_call(lambda: estimator.follow(estimator.init(), *part))

    def _pass(self, bag: Path, block: int, relay: bool = False, viewer: bool = False, named: bool = False) -> Pass:
        with self.graph(("node",)) as graph:
            if relay:
                graph.relay("node", **SIZES)
            else:
                graph.estimator("node", self.model, "constrained_kalman")
            if viewer:
                graph.children.start(
                    "viewer", "crash_estimator", "viewer", open=False, rrd=str(graph.children.logs / "seen.rrd")
                )
            graph.settle()
            if named:
                graph.listener.hear_by_name()
                graph.spin(0.5)  # to be found: what nobody listens to is not made
            if viewer:
                graph.spin_until(lambda: graph.listener.count_subscribers("/node/forces") > 0, "the viewer listens")
            done = graph.replay(bag, 1 + viewer, rate=FLAT_OUT, block=block)
            if named:
                all_by_name = lambda: min(graph.listener.by_name.values()) >= done.sent  # noqa: E731
                graph.spin_until(all_by_name, "every sample is said by name")
            return done

    def _without_and_with(self, listener: str, seconds: float, block: int) -> tuple[np.ndarray, float, float]:
        """Samples a second in turns without and with one more listener, and their medians."""
        bag = self.bag(4, seconds, 10e3)
        passes = (lambda on=on: self._pass(bag, block, **{listener: on}).per_second for on in (False, True))
        rounds = self._in_turns(*passes)
        return rounds, *np.median(rounds, axis=0)

    def viewer(self) -> Iterator[Row]:
        rounds, without, with_it = self._without_and_with("viewer", self.effort.seen, block=0)
        what = "the viewer's cost on the estimator's throughput, in a rush: forces are made and all is drawn after it"
        said = f"{with_it:,.0f} /s with it", f"{without:,.0f} /s without"
        yield Row(what, *said, 1.0 - ratio(rounds, 1, 0), 0.05, least=False)

    def named(self) -> Iterator[Row]:
        yield making(self.model, ringing(BODIES, 0.1))
        rounds, without, with_it = self._without_and_with("named", self.effort.singles, block=1)
        each = (1.0 / with_it - 1.0 / without) * 1e6
        what = "samples a second, single messages, while one Python node hears parameters and residuals by name as well"
        said = f"{with_it:,.0f} /s: {each:.0f} us a sample more", f"{without:,.0f} /s to blocks alone"
        yield Row(what, *said, ratio(rounds, 1, 0))

    def real_time(self) -> Iterator[Row]:
        """Rates are tried in turn; the highest that is kept is held for the whole time."""
        recorded = 20e3
        bag, highest, notes = self.bag(16, 0.5, recorded), 0.0, []
        with self.graph(METHODS) as graph:
            for method in METHODS:
                graph.estimator(method, self.model, method)
            graph.settle()
            for rate in self.effort.rates:
                run = graph.replay(bag, 2, self.effort.probe, rate=rate / recorded)
                notes.append(f"{rate / 1e3:g} kHz: {run.rate / (rate / recorded):.3f} of it, {run.lost} lost")
                if run.rate < KEPT * rate / recorded or run.lost:
                    break
                highest = rate
            if highest:
                run = graph.replay(bag, 2, self.effort.hold, rate=highest / recorded)
                kept, block = run.rate / (highest / recorded), run.sent / run.messages
                said = f"{highest / 1e3:g} kHz, {self.effort.hold:g} s: {kept:.3f} of it, {run.lost} lost"
                said += f", {block:.3g} a message"
                if kept < KEPT or run.lost:
                    highest = 0.0
            else:
                said = "none of those tried"
        what = "highest real-time rate held, 16 channels, two estimators"
        yield Row(what, said, "tried " + "; ".join(notes), highest / 20e3, 1.0)

    def latency(self) -> Iterator[Row]:
        recording, found = ringing(4, self.effort.latency / 1000.0, 1000.0), {"relay": [], "estimator": []}
        for _ in range(self.effort.rounds):
            for kind, all_of_it in found.items():
                with self.graph(("node",)) as graph:
                    if kind == "relay":
                        graph.relay("node", **SIZES)
                    else:
                        graph.estimator("node", self.model, "constrained_kalman")
                    graph.settle()
                    delay = latencies(graph, recording, 1000.0, self.effort.latency)
                    all_of_it.append(delay[len(delay) // 10 :])
        for share, reach in ((50, None), (99, 1.5)):
            ours, theirs = (min(np.percentile(d, share) for d in found[kind]) for kind in ("estimator", "relay"))
            said = f"{ours * 1e3:.3f} ms", f"bare relay {theirs * 1e3:.3f} ms"
            yield Row(f"latency sample to parameters at 1 kHz, p{share}", *said, ours / theirs, reach, least=False)

    def jitter(self) -> Iterator[Row]:
        bag = self.bag(4, self.effort.jitter, 1000.0)
        off = jitter(self.folder / "jitter", self.environment, bag, 1e-3)
        for what, each, reach in (("as published", off.published, 1.0), ("as a subscriber gets them", off.came, None)):
            p50, p99 = (np.percentile(each, share) * 1e3 for share in (50, 99))
            said = f"{p99:.3f} ms (p50 {p50:.3f} ms)", "0.2 ms on an idle machine"
            yield Row(f"jitter of samples at 1 kHz {what}, p99", *said, p99 / 0.2, reach, least=False)

    def lockstep(self) -> Iterator[Row]:
        """The last of the runs loses an estimator on the way: of it only what the estimators say of each sample is
        compared.

        One that comes back tells where from its estimates hold, which is an event more, and says what it has caught up
        with once more, in one block.
        """
        bag, files = self.bag(4, 0.12, 1000.0), []
        with burning():
            for k in range(self.effort.lockstep):
                with self.graph(METHODS) as graph:
                    file, last = graph.children.logs / "estimates.mcap", k == self.effort.lockstep - 1
                    files.append(recorded(graph, self.model, bag, file, kill=last))
        whole, first = [messages_by_topic(file) for file in files[:-1]], messages_by_topic(files[0])
        same = sum(messages == first for messages in whole) + (said(files[-1]) == said(files[0]))
        each = sum(map(len, said(files[0]).values()))
        count = f"{same} of {len(files)} recordings the same, {each} rows of estimates each"
        what = "lock-step on busy cores, in the last run an estimator is killed and started again"
        yield Row(what, count, "the first's messages (the last's rows), to the last byte", same / len(files), 1.0)
