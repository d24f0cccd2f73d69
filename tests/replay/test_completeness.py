"""Whether a recording is complete, and what is said where it is not."""

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from crash_replay.attendance import Attendance, Word
from crash_replay.completeness import SILENT_FOR, Completeness, Pass, Written
from crash_replay.numbers import Numbers
from crash_replay.recorded_topics import FORCES, PARAMETERS, RANKING, RESIDUALS, SAMPLES, About, Choice

SPANS = st.lists(st.tuples(st.integers(0, 60), st.integers(0, 9)), max_size=12)


@given(SPANS, st.integers(0, 60), st.integers(0, 60))
def test_numbers_are_a_set_of_numbers(parts, start, stop):
    numbers, expected = Numbers(), set()
    for begin, length in parts:
        numbers.add(begin, begin + length)
        expected |= set(range(begin, begin + length))
    missing = [k for a, b in numbers.missing(start, stop) for k in range(a, b)]
    assert missing == sorted(set(range(start, stop)) - expected)
    assert len(numbers) == len(expected)
    assert all(a < b for a, b in numbers.spans)
    assert all(b < a for (_, b), (a, _) in pairwise(numbers.spans))
    reach = numbers.reach(start)
    assert reach not in expected and set(range(start, reach)) <= expected


def test_what_comes_in_order_takes_one_span():
    numbers = Numbers()
    for k in range(1000):
        numbers.add(k, k + 1)
    assert numbers.spans == [(0, 1000)]
    assert str(Numbers([(0, 1), (3, 9)])) == "0, 3 to 8"


class Graph:
    """A replay, an estimator and a diagnosis as they say of themselves, at a time of its own."""

    def __init__(self, choice: Choice = Choice(), total: int = 100):
        self.now, self.total = 0.0, total
        self.others = Attendance(clock=lambda: self.now, host="here", ended=lambda process: process == 13)
        self.account = Completeness(choice, self.others)
        kinds = {"/samples": SAMPLES, "/kalman/block/parameters": PARAMETERS, "/kalman/block/residuals": RESIDUALS}
        for topic, kind in {**kinds, "/kalman/forces": FORCES, "/diagnosis/ranking": RANKING}.items():
            if choice.wants(topic, kind):
                self.account.found(topic, kind)
        self.account.begin_test(total)

    def replay(self, run: int = 0, first: int = 0, sent: int = 100, finished: bool = True) -> None:
        self.account.replayed = Pass(run, first, sent, self.total, finished)

    def write(self, start: int, stop: int, run: int = 0, topics: str = "/samples /kalman/") -> None:
        for topic, written in self.account.written.items():
            if topic.startswith(tuple(topics.split())):
                written.add(About(run, start, stop - start))

    def say(self, node: str, role: str, **fields) -> None:
        self.others.hear(Word(node, role, "here", fields.pop("process", 5), total=self.total, ready=True, **fields))


def whole(choice: Choice = Choice()) -> Graph:
    graph = Graph(choice)
    graph.replay()
    graph.say("/kalman", "estimator", next=100, done=True)
    graph.say("/diagnosis", "diagnosis", next=100, done=True)
    graph.write(0, 100)
    graph.account.finals["/diagnosis"] = 0
    return graph


def test_all_samples_all_estimates_and_the_final_answer_are_complete():
    graph = whole()
    assert graph.account.missing() == []
    assert graph.account.through("/kalman") and graph.account.through("/diagnosis")


def test_who_is_known_to_the_replay_alone_is_waited_for_and_named():
    """On a busy machine a diagnosis was found after the replay's end only: its answer was lost, without a word."""
    graph = whole()
    graph.account.known_to_replay = {"/second": "diagnosis", "/other": "estimator", "/rerun": "viewer"}
    assert graph.account.nodes("estimator", "diagnosis") == ["/diagnosis", "/kalman", "/other", "/second"]
    assert not graph.account.through("/second") and not graph.account.through("/other")
    parameters, residuals, answer = graph.account.missing()
    assert parameters.startswith("/other/block/parameters: 0 of 100, without 0 to 99 (the replay hears /other, ")
    assert residuals.startswith("/other/block/residuals: 0 of 100")
    assert answer == "/second/ranking: no final answer (the replay hears /second, no word of it came here)"
    graph.say("/second", "diagnosis", next=100, done=True)
    assert graph.account.through("/second")


def test_what_is_missing_is_named_with_how_many_which_and_why():
    graph = whole()
    graph.account.begin_test(100)
    graph.replay()
    graph.write(0, 40)
    graph.write(60, 100)
    graph.write(40, 60, topics="/kalman/block/parameters")
    graph.account.give_up("/samples", (40, 60), "/replay has left")
    graph.say("/kalman", "estimator", next=100, done=True, reason="2 samples were NaN")
    assert graph.account.missing() == [
        "/samples: 80 of 100, without 40 to 59 (/replay has left)",
        "/kalman/block/residuals: 80 of 100, without 40 to 59 (2 samples were NaN)",
        "/kalman/forces: 80 of 100, without 40 to 59 (2 samples were NaN)",
        "/diagnosis/ranking: no final answer",
    ]


def test_an_estimator_that_was_killed_is_not_waited_for_and_is_named():
    graph = whole()
    graph.say("/mrls", "estimator", next=30, process=13)
    graph.account.found("/mrls/block/parameters", PARAMETERS)
    graph.write(0, 30, topics="/mrls/")
    assert not graph.account.through("/mrls")
    graph.now = 2.0
    assert graph.account.through("/mrls")
    assert graph.account.missing() == [
        "/mrls/block/parameters: 30 of 100, without 30 to 99 (/mrls was killed)",
        "/mrls/block/residuals: 0 of 100, without 0 to 99 (/mrls was killed)",
    ]


def test_who_says_nothing_any_more_is_waited_for_so_long():
    graph = Graph()
    graph.replay()
    graph.say("/diagnosis", "diagnosis", next=100)
    graph.now = SILENT_FOR - 1.0
    assert not graph.account.through("/diagnosis")
    graph.now = SILENT_FOR + 1.0
    assert graph.account.through("/diagnosis")
    assert any("silent for 301 s" in text for text in graph.account.missing())


def test_of_a_pass_that_began_in_the_middle_what_was_sent_must_be_there():
    graph = whole()
    graph.replay(run=3, first=70)
    for node, role in (("/kalman", "estimator"), ("/diagnosis", "diagnosis")):
        graph.say(node, role, run=3, next=100, done=True)
    graph.account.finals["/diagnosis"] = 3
    graph.write(70, 99, run=3)
    assert [text.partition(":")[2] for text in graph.account.missing()] == [" 29 of 30, without 99"] * 4
    graph.write(99, 100, run=3)
    assert graph.account.missing() == []


def test_a_loop_that_was_ended_in_a_later_pass_is_complete_by_an_earlier_one():
    graph = whole()
    graph.replay(run=1, sent=20, finished=False)
    graph.write(0, 20, run=1)
    assert graph.account.missing() == []
    graph.say("/kalman", "estimator", run=1, next=20)
    assert graph.account.through("/kalman")
    graph.replay(run=1, sent=21, finished=False)
    assert graph.account.missing()[0] == "/samples: 99 of 100, without 20"


def test_from_a_window_of_the_test_nobody_concludes():
    graph = whole()
    graph.replay(sent=50)
    graph.account.finals.clear()
    graph.say("/diagnosis", "diagnosis", next=50)
    assert graph.account.through("/diagnosis") and graph.account.missing() == []


def test_who_can_say_nothing_on_this_test_is_not_waited_for_and_is_named():
    graph = whole()
    graph.replay(run=2)
    graph.write(0, 100, run=2)
    graph.account.finals["/diagnosis"] = 2
    graph.say("/mrls", "estimator", next=100, done=True, reason="test T has no channel car_ax")
    assert graph.account.through("/mrls")
    assert graph.account.missing() == [
        f"/mrls/block/{name}: 0 of 100, without 0 to 99 (test T has no channel car_ax)"
        for name in ("parameters", "residuals")
    ]


def test_a_replay_that_was_started_again_counts_its_passes_anew():
    graph = whole()
    graph.replay(run=4)
    graph.write(0, 60, run=4)
    graph.account.finals.clear()
    graph.replay(run=0)
    graph.write(0, 100, run=0)
    graph.account.finals["/diagnosis"] = 0
    assert graph.account.missing() == []


def test_a_replay_that_was_ended_early_has_not_sent_the_test():
    graph = Graph()
    graph.replay(sent=3, finished=False)
    graph.write(0, 3)
    assert graph.account.missing() == ["/samples: 3 of 100, without 3 to 99"]


def test_of_many_gaps_the_first_are_listed():
    graph = Graph()
    graph.replay()
    for k in range(0, 100, 10):
        graph.write(k, k + 9, topics="/samples")
    assert graph.account.missing() == ["/samples: 90 of 100, without 9, 19, 29, 39, 49, ..."]


def test_what_was_not_to_be_recorded_is_not_missing():
    graph = whole(Choice(topics=["/kalman/block/parameters", "test"], exclude=[]))
    assert graph.account.missing() == ["no topic fits test (parameter topics)"]
    graph.account.found("/test", "crash_msgs/msg/TestInfo")
    assert graph.account.missing() == []


def with_channels(*found: str) -> Graph:
    """A whole recording of a test with two channels, one sample each ms; of the channels nothing came yet."""
    graph = whole(Choice(topics=["*"], exclude=["*_vy"]))
    graph.account.begin_test(100, ["/channels/rib_ay", "/channels/rib_vy", "/channels/spine_ay"])
    graph.replay()
    graph.write(0, 100)
    graph.account.finals["/diagnosis"] = 0
    for topic in found:
        graph.account.found(topic, "geometry_msgs/msg/AccelStamped")
    return graph


def test_a_channel_must_be_there_at_the_instants_of_the_samples():
    """One that was found only when samples had begun to come was recorded from there on, and said to be complete."""
    graph = with_channels("/channels/rib_ay", "/channels/spine_ay")
    channels = graph.account.channels
    for number in range(6, 40):
        channels.add("/channels/rib_ay", 1_000_000 * number)  # before the samples: both ways lead here
    channels.add_samples(0, range(0, 100_000_000, 1_000_000))
    for number in range(100):
        channels.add("/channels/spine_ay", 1_000_000 * number)
    for number in range(40, 99):
        channels.add("/channels/rib_ay", 1_000_000 * number)
    channels.add("/channels/rib_vy", 0)  # not asked for
    assert graph.account.missing() == ["/channels/rib_ay: 93 of 100, without 0 to 5, 99"]
    graph.replay(first=10, sent=99)
    assert graph.account.missing() == []


def test_of_channels_nothing_is_said_where_the_samples_are_not_recorded_beside_them():
    graph = with_channels("/channels/rib_ay")
    graph.account.channels.add("/channels/rib_ay", 0)
    assert graph.account.missing() == []


def test_the_test_and_its_channels_are_to_come_until_they_are_found():
    graph = Graph(Choice(topics=["*"]), total=0)
    assert not graph.account.test_to_come()  # none was found: whoever publishes samples may have none
    graph.account.found("/test", "crash_msgs/msg/TestInfo")
    assert graph.account.test_to_come() and not graph.account.channels_to_come()
    graph.account.begin_test(100, ["/channels/rib_ay"])
    assert graph.account.channels_to_come() and not graph.account.test_to_come()
    graph.account.found("/channels/rib_ay", "geometry_msgs/msg/AccelStamped")
    assert not graph.account.channels_to_come()


def test_what_was_asked_for_and_then_comes_by_itself_comes_late():
    written = Written()
    written.add(About(0, 0, 10))
    written.fetched.add(4, 8)
    assert written.came_late(About(0, 4, 1)) and written.came_late(About(0, 5, 3))
    assert not written.came_late(About(0, 7, 2)) and not written.came_late(About(1, 4, 1))
    assert not written.came_late(About(0, 5, 0))  # a new model, before there is anything to say
    written.add(About(1, 0, 1))
    assert not written.came_late(About(1, 4, 1))


def test_of_another_model_the_same_estimates_do_not_come_late():
    graph = whole()
    graph.account.revise("/kalman", 0)
    written = graph.account.of("/kalman/block/parameters")
    written.fetched.add(4, 8)
    graph.account.revise("/kalman", 0)
    assert written.came_late(About(0, 4, 1))
    graph.account.revise("/kalman", 1)
    assert not written.came_late(About(0, 4, 1))


def test_without_a_test_nobody_knows():
    assert Graph(total=0).account.missing() == ["no test was heard, so nobody knows what is missing"]
