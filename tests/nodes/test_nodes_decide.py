"""What nodes make of what they know, without a graph: each is asked what it does next."""

from collections import deque
from types import SimpleNamespace

import numpy as np
import pytest
from helpers_alone import Silence

from crash_estimator.kept import Rows
from crash_estimator.nodes import catching_up, composed
from crash_estimator.nodes.estimator_node import EstimatorNode
from crash_estimator.nodes.estimator_parameters import table_for
from crash_estimator.nodes.hearing import hear
from crash_estimator.nodes.intake import Intake
from crash_estimator.nodes.later import Later
from crash_replay.recording import RecordingError


@pytest.mark.parametrize(("incomplete", "status"), [(["", ""], 0), (["", "kalman: 3 samples missing"], 1)])
def test_all_in_one_ends_with_1_where_an_estimator_lacks_anything(monkeypatch, incomplete, status):
    told = []
    monkeypatch.setattr(composed, "tell", told.append)
    others = SimpleNamespace(names=lambda: [])
    replay = SimpleNamespace(
        topics=SimpleNamespace(audience=SimpleNamespace(attending=SimpleNamespace(others=others))),
        asked={"finish_timeout": 1.0},
        pacing=SimpleNamespace(stopped=False),
    )
    estimators = [SimpleNamespace(attending=SimpleNamespace(leave=lambda line=line: line)) for line in incomplete]
    assert composed.hear_out(replay, estimators) == status
    assert told == [line for line in incomplete if line]


@pytest.mark.parametrize("model", ["", 5, None, "no_such_file.yaml"])
def test_a_model_that_is_none_has_no_preset_of_its_own(model):
    assert table_for({"model": model}) == table_for({})


def later(taken, clock):
    published = []
    return Later(published.append, taken, clock), published


def test_after_a_rush_what_waits_is_published_within_the_time_of_a_look_and_as_it_is_taken():
    now = iter(np.arange(0.0, 100.0, 2e-3))  # each look at the clock is 2 ms later
    one, published = later(lambda: True, lambda: float(next(now)))
    one.rush = SimpleNamespace(look=lambda: False, count=lambda samples: None)
    for k in range(20):
        one.put(lambda k=k: bytes([k]), 1, wait=True)
    one.look()
    assert 3 <= len(published) <= 6 and published == [bytes([k]) for k in range(len(published))]
    one.rush = SimpleNamespace(look=lambda: True, count=lambda samples: None)
    before = len(published)
    one.look()
    assert len(published) == before, "in a rush nothing goes out"
    one.put(lambda: b"now", 1, wait=False)
    assert published[-1] == b"now" and len(published) == 21 and one.held == 0


def test_an_estimator_answers_for_the_last_sample_that_it_was_given():
    answers = []
    node = SimpleNamespace(
        topics=SimpleNamespace(answer=lambda run, number, missed: answers.append((run, number, missed))),
        intake=SimpleNamespace(arrivals=SimpleNamespace(missed=0)), _estimate=lambda samples: None,
    )  # fmt: skip
    node._tell_of_missing = lambda samples: None
    node.leave_out = lambda run, number: EstimatorNode.leave_out(node, run, number)
    rows = Rows(40, np.arange(10), np.zeros((10, 1)))
    EstimatorNode.take(node, SimpleNamespace(run=2, arrival=SimpleNamespace(rows=rows)))
    assert answers == [(2, 49, 0)]


@pytest.mark.parametrize(("position", "at"), [(0, 0), (1, 0), (70, 69)])
def test_a_change_of_the_model_is_told_of_the_last_sample_that_it_comes_after(position, at):
    events = []
    topics = SimpleNamespace(time_zero=1000, event=lambda *given: events.append(given))
    kept = SimpleNamespace(time_ns=np.arange(100) * 7)
    node = SimpleNamespace(
        follower=SimpleNamespace(position=position, kept=kept), intake=SimpleNamespace(arrivals=SimpleNamespace(run=1)),
        model=SimpleNamespace(revision=2), topics=topics, test_message=None, _say_from_now_on=lambda test: None,
        _publish_state=lambda run, number, stamp: events.append(stamp),
    )  # fmt: skip
    EstimatorNode._tell_of_change(node, "revision 2")
    assert events[0][-1] == events[1] == 1000 + 7 * at


def test_samples_that_all_came_before_are_answered_again():
    """Whoever sent them waits for the answer, to the last of them."""
    answered = []
    arrival = SimpleNamespace(repeated=10, rows=SimpleNamespace(time_ns=[]))
    intake = SimpleNamespace(
        catching_up=SimpleNamespace(came=lambda: None), log=SimpleNamespace(warning=lambda *given, **more: None),
        arrivals=SimpleNamespace(receive=lambda run, rows: arrival), _work=lambda: None,
        consumer=SimpleNamespace(leave_out=lambda run, number: answered.append((run, number))),
    )  # fmt: skip
    Intake.receive(intake, 1, Rows(30, np.arange(10), np.zeros((10, 1))), 0)
    assert answered == [(1, 39)]


@pytest.mark.parametrize("waits", [True, False])
def test_all_in_one_stays_till_the_others_have_all_they_want_or_the_time_is_up(monkeypatch, waits):
    """Who is there and is not done asks the estimators again for what it lacks."""
    looks = []
    monkeypatch.setattr(composed.time, "sleep", looks.append)
    others = SimpleNamespace(
        names=lambda: ["viewer"], there=lambda name: True, word=lambda name: SimpleNamespace(done=len(looks) >= 3)
    )
    replay = SimpleNamespace(
        topics=SimpleNamespace(audience=SimpleNamespace(attending=SimpleNamespace(others=others))),
        asked={"finish_timeout": 1000.0 if waits else -1.0},
        pacing=SimpleNamespace(stopped=False),
    )
    assert composed.hear_out(replay, []) == 0
    assert len(looks) == (3 if waits else 0)


@pytest.mark.parametrize(("number", "handed_out"), [(10, 3), (12, 5), (14, 5), (3, 0)])
def test_of_samples_sent_again_those_of_the_pass_are_handed_out(number, handed_out):
    """Five samples from `number` on, of a pass that begins with sample 12: those before it only are remembered."""

    def rows(first, count):
        return SimpleNamespace(time_ns=range(count), number=first, without=lambda n: rows(first + n, max(0, count - n)))

    kept = []
    head = SimpleNamespace(first=12, run=1, sent_again=0, without=False)
    consumer = SimpleNamespace(keep=kept.append, stamp_of=lambda rows: 0)
    node = SimpleNamespace(waiting=deque([head]), consumer=consumer, asked_again=0, _work=lambda: None)
    Intake._on_asked(node, rows(number, 5))
    before = [one for one in node.waiting if one is not head]
    assert [len(one.arrival.rows.time_ns) for one in before] == [handed_out] * bool(handed_out)
    assert head.sent_again == node.asked_again == len(kept[0].time_ns) == 5


@pytest.mark.parametrize(
    ("since_look", "since_sample", "asks"),
    [(0.5, 2.0, True), (0.5, 0.5, False), (5.0, 5.0, False)],  # the last: the process itself was stopped
)
def test_what_is_behind_is_asked_for_where_nothing_comes_though_this_process_ran(
    monkeypatch, since_look, since_sample, asks
):
    asked, now = [], 100.0
    monkeypatch.setattr(catching_up.time, "monotonic", lambda: now)
    late = catching_up.CatchingUp(Silence(), None, None, None)
    late.looked_at, late.came_at, late.ask_at_once = now - since_look, now - since_sample, lambda: asked.append(now)
    late.look()
    assert len(asked) == asks and late.looked_at == now


def test_messages_are_heard_as_their_bytes():
    """What does not decode is left out with a line, and the next is taken."""
    made, taken, complaints = [], [], []
    node = SimpleNamespace(create_subscription=lambda *given, **more: made.append((given, more)))
    said = SimpleNamespace(complain=lambda topic, text: complaints.append(text))
    hear(node, said, int, "samples", taken.append, None, decode=lambda raw: _two_bytes(raw))
    ((_, _, on_message, _), more) = made[0]
    assert more == {"raw": True}
    for raw in (b"ab", b"a", b"cd"):
        on_message(raw)
    assert taken == [b"ab", b"cd"] and complaints == ["topic samples: too short: left out"]


def _two_bytes(raw: bytes) -> bytes:
    if len(raw) < 2:
        raise RecordingError("too short")
    return raw
