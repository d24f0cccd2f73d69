"""Whether a recording holds what the test has and what the nodes have said of it. No ROS here.

Of the last pass every sample that was sent must be there, of each estimator every estimate of these samples, and of a
diagnosis its final answer. Where the replay ended before its pass did, the whole test must be there from some pass; so
must each channel that is recorded, at the instants of the samples beside it.
"""

from collections.abc import Collection, Iterable
from typing import NamedTuple

from .attendance import GONE, Attendance, State
from .numbers import Numbers, Span
from .recorded_topics import NUMBERED, SAMPLES, TEST, About, Choice

ESTIMATOR, DIAGNOSIS = "estimator", "diagnosis"
ESTIMATES = {"block/parameters": "ParametersBlock", "block/residuals": "ResidualsBlock", "forces": "Forces"}
"""Last parts of an estimator's topics, and their types; forces are not said by all."""
SILENT_FOR = 300.0
"""s of silence after which a node is no longer waited for."""
MOST_SPANS = 5
"""Spans of missing numbers that are listed."""


class Pass(NamedTuple):
    """What the replay has said of its last pass over the test."""

    run: int
    first: int  # number of its first sample
    sent: int  # number after that of the last sample sent
    total: int  # samples of the test
    finished: bool  # sent is where it was to end


class Written:
    """Which samples the messages of a topic are about."""

    def __init__(self):
        self.run = 0  # of the last message
        self.last = Numbers()  # in this run
        self.all = Numbers()  # in all of this test
        self.given_up, self.why = Numbers(), ""  # in this run: cannot be had, and why
        self.fetched = Numbers()  # in this run: asked for and given

    def add(self, about: About) -> None:
        self._begin(about.run)
        self.last.add(about.number, about.number + about.count)
        self.all.add(about.number, about.number + about.count)

    def _begin(self, run: int) -> None:
        """A replay that was started again counts its passes from 0 again."""
        if run != self.run:
            self.run, self.last, self.given_up, self.why, self.fetched = run, Numbers(), Numbers(), "", Numbers()

    def lacks(self, of: Pass) -> list[Span]:
        """Of the pass, up to what was sent."""
        return self.last.missing(of.first, of.sent) if self.run == of.run else [(of.first, of.sent)]

    def lacks_some(self, about: About) -> bool:
        return about.run != self.run or bool(self.last.missing(about.number, about.number + about.count))

    def came_late(self, about: About) -> bool:
        """Whether these have been asked for, and were given, before they came by themselves."""
        known = about.run == self.run and about.count > 0
        return known and not self.fetched.missing(about.number, about.number + about.count)

    def give_up(self, run: int, span: Span, why: str) -> None:
        self._begin(run)
        self.given_up.add(*span)
        self.why = why

    def lacks_of_test(self, of: Pass) -> Numbers:
        lacking = Numbers(span for span in self.lacks(of) if span[0] < span[1])
        for span in [] if of.finished else self.all.missing(0, of.total):
            lacking.add(*span)
        return lacking


class ChannelsWritten:
    """Which samples the messages of channels are of: they say an instant, the samples beside them its number."""

    def __init__(self, topics: Collection[str] = ()):
        """topics: of the test's channels that are to be recorded."""
        self.numbers: dict[int, int] = {}  # of the samples, by their instants in ns
        self.written = {topic: Numbers() for topic in topics}
        self.early: dict[str, list[int]] = {topic: [] for topic in topics}  # instants whose samples had not come

    def add_samples(self, first: int, instants: Iterable[int]) -> None:
        for number, instant in enumerate(instants, start=first):
            self.numbers[instant] = number

    def add(self, topic: str, instant: int) -> None:
        if topic not in self.written:  # of another test
            return
        if (number := self.numbers.get(instant)) is None:
            self.early[topic].append(instant)
        else:
            self.written[topic].add(number, number + 1)

    def lacks(self, topic: str, of: Pass) -> Numbers:
        """Samples of the pass that came, and whose value in this channel did not."""
        early, self.early[topic] = self.early[topic], []
        for instant in early:
            self.add(topic, instant)
        written = self.written[topic]
        came = sorted(number for number in self.numbers.values() if of.first <= number < of.sent)
        return Numbers((number, number + 1) for number in came if written.reach(number) == number)


class Completeness:
    """Keeps account of a recording."""

    def __init__(self, choice: Choice, others: Attendance, samples_topic: str = "/samples"):
        self.choice, self.others, self.samples_topic = choice, others, samples_topic
        self.written: dict[str, Written] = {}  # by topic, of the types NUMBERED
        self.channels = ChannelsWritten()
        self.types: dict[str, str] = {}  # of the topics that were found
        self.finals: dict[str, int] = {}  # by diagnosis, run of its last final ranking
        self.revisions: dict[str, int] = {}  # by estimator, of its model
        self.total = 0  # samples of the test
        self.replayed: Pass | None = None
        self.known_to_replay: dict[str, str] = {}  # node that it hears and that is there -> its role

    def found(self, topic: str, kind: str) -> None:
        self.types[topic] = kind
        if kind in NUMBERED:
            self.written.setdefault(topic, Written())

    def begin_test(self, total: int, channels: Collection[str] = ()) -> None:
        """channels: their topics, of which those that are not to be recorded are passed over."""
        self.total, self.replayed, self.finals = total, None, {}
        self.written = {topic: Written() for topic in self.written}
        self.channels = ChannelsWritten([topic for topic in channels if self.choice.wants_channel(topic)])

    def revise(self, node: str, revision: int) -> None:
        """An estimator's model may have become another one: what it says of the same samples then is not the same."""
        if revision != self.revisions.get(node):
            for topic in self.estimates(node):
                self.of(topic).fetched = Numbers()
        self.revisions[node] = revision

    def test_to_come(self) -> bool:
        """Whether its topic has been found, and nothing has come on it yet."""
        return TEST in self.types.values() and not self.total

    def channels_to_come(self) -> bool:
        """Whether a channel of the test that is to be recorded has not been found yet."""
        return not self.channels.written.keys() <= self.types.keys()

    def of(self, topic: str) -> Written:
        return self.written.setdefault(topic, Written())

    def lacks(self, topic: str, about: About) -> bool:
        """Whether a message about these samples would bring anything."""
        return self.of(topic).lacks_some(about)

    def give_up(self, topic: str, span: Span, why: str) -> None:
        """These numbers of the last pass cannot be had."""
        self.of(topic).give_up(self.last_pass.run, span, why)

    @property
    def last_pass(self) -> Pass:
        """As the replay says, or as far as it can be told without one."""
        if self.replayed:
            return self.replayed
        run = max((written.run for written in self.written.values()), default=0)
        return Pass(run, 0, 0, self.total, finished=False)

    def samples(self) -> list[str]:
        """The topic with the samples, where it was found."""
        return [self.samples_topic] if self.types.get(self.samples_topic) == SAMPLES else []

    def estimates(self, node: str) -> list[str]:
        """An estimator's topics that must be complete."""
        topics = {f"{node}/{name}": f"crash_msgs/msg/{kind}" for name, kind in ESTIMATES.items()}
        must = [topic for topic, kind in topics.items() if self.choice.wants(topic, kind)]
        return [topic for topic in must if topic in self.types or not topic.endswith("/forces")]

    def nodes(self, *roles: str) -> list[str]:
        """Who has said a word of himself, here or to the replay: on a busy machine one may be found here too late."""
        known = (name for name, role in self.known_to_replay.items() if role in roles)
        return sorted({*self.others.names(*roles), *known})

    def through(self, node: str) -> bool:
        """Whether nothing more is to be expected of an estimator or a diagnosis."""
        if self.others.word(node) is None:
            return False
        if self.others.state(node) in GONE or self.others.silence(node) > SILENT_FOR:
            return True
        word, of = self.others.word(node), self.last_pass
        if word.total == 0 or not of.sent:  # it has no test that it could say anything on
            return True
        if word.run != of.run:
            return word.done and bool(word.reason)  # it can say nothing on any pass
        # where a pass ends before the test does, there is nothing to conclude from
        return word.done or (of.sent < of.total and word.next >= of.sent)

    def missing(self) -> list[str]:
        """What the recording lacks: topic, how many of how many, which, and why."""
        of = self.last_pass
        if not of.total:
            return ["no test was heard, so nobody knows what is missing"]
        missing = [self._missing_of(topic, of, "") for topic in self.samples()]
        if not self.samples() and self.replayed and self.choice.wants(self.samples_topic, SAMPLES):
            missing.append("samples: the topic was not found")
        for topic in sorted(self.channels.written.keys() & self.types.keys()):
            missing.append(_lacking(topic, self.channels.lacks(topic, of), of))
        for node in self.nodes(ESTIMATOR):
            missing += [self._missing_of(topic, of, self._why(node)) for topic in self.estimates(node)]
        for node in self.nodes(DIAGNOSIS) if of.finished and of.sent == of.total else []:
            topic = f"{node}/ranking"
            if self.choice.wants(topic, "crash_msgs/msg/Ranking") and self.finals.get(node) != of.run:
                missing.append(f"{topic}: no final answer{_because(self._why(node))}")
        missing += [f"no topic fits {pattern} (parameter topics)" for pattern in self.choice.in_vain(self.types)]
        return [text for text in missing if text]

    def _missing_of(self, topic: str, of: Pass, why: str) -> str:
        written = self.of(topic)
        because = "; ".join(dict.fromkeys(filter(None, [why, written.why])))
        return _lacking(topic, written.lacks_of_test(of), of, because)

    def _why(self, node: str) -> str:
        if (word := self.others.word(node)) is None:
            return f"the replay hears {node}, no word of it came here"
        state = self.others.state(node)
        how = self.others.how(node, state) if state in (State.LEFT, State.KILLED, State.SILENT) else ""
        return "; ".join(filter(None, [f"{node} {how}" if how else "", word.reason]))


def _lacking(topic: str, lacking: Numbers, of: Pass, why: str = "") -> str:
    """A line on what a topic lacks of a pass, "" where it lacks nothing."""
    if not len(lacking):
        return ""
    needed = of.sent - of.first if of.finished else of.total
    shown = Numbers(lacking.spans[:MOST_SPANS])
    more = ", ..." if len(lacking.spans) > MOST_SPANS else ""
    return f"{topic}: {needed - len(lacking)} of {needed}, without {shown}{more}{_because(why)}"


def _because(reason: str) -> str:
    return f" ({reason})" if reason else ""
