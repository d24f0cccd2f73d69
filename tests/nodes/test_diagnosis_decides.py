"""What a diagnosis node makes of what it knows, without a graph: when it asks, and when it is done."""

from types import SimpleNamespace

import numpy as np
import pytest

from crash_estimator.nodes import diagnosis_parameters
from crash_estimator.nodes.diagnosis_messages import revision_name
from crash_estimator.nodes.diagnosis_node import DiagnosisNode
from crash_estimator.nodes.diagnosis_worker import Worker


def diagnosis(**given) -> SimpleNamespace:
    """A diagnosis with all 1000 samples of its test."""
    kept = SimpleNamespace(time_ns=np.arange(1000) * 100_000, missing=lambda end: 0, until=lambda end: f"until {end}")
    wanted = SimpleNamespace(every_ns=5_000_000, tolerance=None, seconds=9.0)
    return SimpleNamespace(
        kept=kept, end=500, total=1000, run=0, asked=None, wanted=wanted, time_zero=0, structure="model", revision=0,
        finals={}, questions=[], _has_enough=lambda: True, **given,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("asked_at", "end", "asks"),
    [
        (None, 500, True),
        (490, 500, False),  # a millisecond later
        (449, 500, True),  # 5 ms later
        (990, 1000, True),  # the test is complete, whatever time has passed
        (999, 1000, True),  # once more, for the final answer
    ],
)
def test_when_a_diagnosis_asks_again(asked_at, end, asks):
    node = diagnosis()
    node.end = end
    node.worker = SimpleNamespace(ask=node.questions.append)
    if asked_at is not None:
        node.asked = SimpleNamespace(time_ns=asked_at * 100_000, number=asked_at, final=False)
    DiagnosisNode._ask(node)
    assert len(node.questions) == asks
    if asks:
        assert node.questions[0].final == (asked_at == 999) and node.questions[0].recording == f"until {end}"


@pytest.mark.parametrize(("kept", "end", "taken"), [(True, 8, True), (True, 1 << 40, False), (False, 8, False)])
def test_a_diagnosis_keeps_what_channels_say_of_its_test_up_to_what_it_has_room_for(kept, end, taken):
    put = []
    node = SimpleNamespace(kept=SimpleNamespace(put_rows=put.append) if kept else None, end=0)
    DiagnosisNode._on_feed(node, SimpleNamespace(end=end, values=np.zeros((4, 2))))
    assert bool(put) == taken and node.end == (end if taken else 0)


class Pipe:
    """The worker's end."""

    def __init__(self, *replies):
        self.replies, self.sent = list(replies), []

    def poll(self):
        return bool(self.replies)

    def recv(self):
        reply = self.replies.pop(0)
        if isinstance(reply, Exception):
            raise reply
        return reply

    def send(self, content):
        self.sent.append(content)

    def close(self):
        pass


def worker(*replies, busy=True, wanted=True) -> Worker:
    found = Worker.__new__(Worker)
    found.process = SimpleNamespace(wait=lambda: -9, kill=lambda: None)
    found._pipe, found.task, found.to_ask_again, found.deaths = Pipe(*replies), None, None, 0
    found.busy, found.wanted, found.long = busy, wanted, False
    return found


def test_a_reply_is_taken_once_and_then_nothing_is_waited_for():
    one = worker("answer")
    assert one.reply() == "answer" and not one.busy and not one.wanted
    one._pipe.replies.append("stray")
    assert one.reply() is None, "nothing was asked"


def test_a_reply_that_nobody_waits_for_is_left_out():
    one = worker("answer", wanted=False)
    assert one.reply() is None and not one.busy


def test_a_worker_that_is_busy_and_silent_is_waited_for():
    one = worker()
    assert one.reply() is None and one.busy


@pytest.mark.parametrize(
    ("wanted", "before", "again"), [(True, None, True), (False, None, False), (False, "old", True)]
)
def test_what_was_wanted_of_a_process_that_died_is_asked_of_the_next(monkeypatch, wanted, before, again):
    one = worker(EOFError(), wanted=wanted)
    one.task, one.to_ask_again = SimpleNamespace(final=False), SimpleNamespace(final=False) if before else None
    expected = one.task if wanted else one.to_ask_again
    monkeypatch.setattr(Worker, "_start", lambda self: setattr(self, "_pipe", Pipe("it is there")))
    assert one.reply() is None and one.deaths == 1
    assert one.to_ask_again is (expected if again else None)
    one.busy = True
    assert one.reply() is None and one._pipe.sent == ([expected] if again else [])


@pytest.mark.parametrize(
    ("asked", "busy", "done"), [(True, False, True), (True, True, False), (False, False, False), (None, False, False)]
)
def test_a_diagnosis_is_done_when_its_final_answer_is_given(asked, busy, done):
    node = SimpleNamespace(
        kept=SimpleNamespace(missing=lambda end: 0), end=60, total=60, run=1, stopped="", cannot_be_had="",
        asked=None if asked is None else SimpleNamespace(final=asked), worker=SimpleNamespace(busy=busy),
        model=SimpleNamespace(complete=True), prepared=True,
    )  # fmt: skip
    assert DiagnosisNode._progress(node).done == done


def test_a_revision_is_named_by_what_was_taken_out_and_added():
    friction, damper = (SimpleNamespace(type=kind, target="front") for kind in ("friction", "damper"))
    given = SimpleNamespace(name="car", effects=[friction])
    assert revision_name(given, given, []) == "car"
    changed = SimpleNamespace(name="car", effects=[])
    assert revision_name(given, changed, [damper]) == "car - friction on front + damper on front"


@pytest.mark.parametrize(("given", "seconds"), [(0.0, None), (8.0, 8.0)])
def test_a_diagnosis_without_a_time_limit_has_the_iterations_of_the_command(given, seconds):
    values = {name: allowed.default for name, allowed in diagnosis_parameters.PARAMETERS.items()} | {
        "time_limit": given
    }
    assert diagnosis_parameters.Wanted.from_values(values).seconds == seconds
