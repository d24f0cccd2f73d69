"""What nodes make of what they know, without a graph: each is asked what it does next."""

import time
from collections import deque
from types import SimpleNamespace

import numpy as np
import pytest
from helpers_alone import Silence, attending

from crash_estimator.kept import Rows
from crash_estimator.nodes import catching_up, composed, diagnosis_parameters, viewer_node, whole_estimates
from crash_estimator.nodes.diagnosis_messages import revision_name
from crash_estimator.nodes.diagnosis_node import DiagnosisNode
from crash_estimator.nodes.diagnosis_worker import Worker
from crash_estimator.nodes.estimator_node import EstimatorNode
from crash_estimator.nodes.estimator_parameters import table_for
from crash_estimator.nodes.hearing import hear
from crash_estimator.nodes.intake import Intake
from crash_estimator.nodes.later import Later
from crash_estimator.nodes.revised_estimates import RevisedEstimates, Wanted
from crash_estimator.nodes.viewer_node import ViewerNode
from crash_estimator.nodes.whole_estimates import QUIET, WholeEstimates
from crash_replay.attending import Progress
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


@pytest.mark.parametrize(
    ("said", "quiet", "state", "silence", "nothing"),
    [
        (True, 2.0 * QUIET, "gone", 0.0, True),
        (True, 0.5 * QUIET, "gone", 0.0, False),  # something of it may still be on its way
        (True, 2.0 * QUIET, "there", 0.0, False),
        (True, 2.0 * QUIET, "there", 1e4, True),
        (False, 2.0 * whole_estimates.DISCOVERY, "there", 0.0, True),
        (False, 0.5 * whole_estimates.DISCOVERY, "there", 0.0, False),
    ],
)
def test_when_nothing_more_is_expected_of_an_estimator(monkeypatch, said, quiet, state, silence, nothing):
    monkeypatch.setattr(whole_estimates, "GONE", {"gone"})
    of = attending(**({"done": False} if said else {}))
    of.others.state, of.others.silence = lambda *given: state, lambda name: silence
    whole = WholeEstimates(Silence(), "e", of, lambda topic, raw: None)
    whole.came = time.monotonic() - quiet
    assert whole.waits_for_nothing() == nothing


def test_after_an_answer_or_in_vain_as_much_is_asked_for_as_at_first():
    whole = WholeEstimates(Silence(), "e", attending(), lambda topic, raw: None)
    most = whole.most
    for after in (lambda: whole._fill(None, 0, 0), lambda: whole._give_up(0, 0, 1, "nobody has them")):
        whole.most = 3  # only some of them could be had
        after()
        assert whole.most == most


@pytest.mark.parametrize(("first", "wanted"), [(0, Wanted(4, 1, 0, 60)), (20, Wanted(4, 1, 20, 60)), (60, None)])
def test_of_a_new_revision_is_wanted_what_was_before_it_in_its_pass(first, wanted):
    revised = RevisedEstimates(Silence(), "e", lambda topic, raw: None)
    replay = SimpleNamespace(run=1, first=first)
    revised.follow(SimpleNamespace(states=[], attending=attending(replay), name="/e"))
    revised._want(4, 1, 60)
    assert revised.wanted == wanted and revised.revision == 4


@pytest.mark.parametrize("got", [25, 40])
def test_a_revision_is_asked_for_till_all_of_it_has_come(monkeypatch, got):
    out, asked = [], []
    monkeypatch.setattr("crash_estimator.nodes.revised_estimates.serialize_message", lambda message: message)
    revised = RevisedEstimates(Silence(), "e", lambda topic, raw: out.append(raw))
    revised._ask = asked.append
    revised.wanted, revised.call, revised.held = Wanted(4, 1, 20, 60), None, [("forces", "later")]
    part = SimpleNamespace(time_ns=range(got))
    call = SimpleNamespace(result=lambda: SimpleNamespace(success=True, forces=part, parameters=part, residuals=part))
    revised.call = call
    revised._answered(call)
    if got < 40:
        assert revised.wanted.next == 20 + got and len(asked) == 1 and "later" not in out
    else:
        assert revised.wanted is None and not asked and out[-1] == "later"


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


@pytest.mark.parametrize(
    ("settled", "saved", "done"),
    [(True, True, True), (True, False, False), (False, True, False), (False, False, False)],
)
def test_a_viewer_is_done_when_all_has_come_and_is_saved(settled, saved, done):
    state = SimpleNamespace(run=1, number=60)
    node = SimpleNamespace(
        attending=attending(state), replay_goes_on=True, counted=None, total=100, _reason=lambda: "",
        account=SimpleNamespace(settled=lambda: settled, missing=lambda: 0), recorder=SimpleNamespace(saved=saved),
    )  # fmt: skip
    found = ViewerNode._progress(node)
    assert isinstance(found, Progress) and found.done == done and (found.run, found.next) == (1, 60)


@pytest.mark.parametrize(("revision", "effects"), [(0, None), (1, ["first"]), (2, ["second"]), (3, None)])
def test_the_curves_of_a_revision_are_those_of_its_own_effects(monkeypatch, revision, effects):
    used = []
    monkeypatch.setattr(viewer_node, "with_effects", lambda structure, found, test: used.append(found) or structure)
    monkeypatch.setattr(viewer_node, "applied", lambda structure, test: structure)
    said = [SimpleNamespace(revision=k, model_effects=[name]) for k, name in ((1, "first"), (2, "second"))]
    node = SimpleNamespace(
        structure_named=lambda model: "structure", test="test", estimates={"e": SimpleNamespace(states=said)}
    )
    assert ViewerNode._structure_of(node, "e", revision, "model") == "structure"
    assert used == ([effects] if effects else [])


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


@pytest.mark.parametrize(
    ("word", "expected"),
    [
        ({"run": 1, "done": True}, True),
        ({"run": 0, "done": True, "reason": "no test"}, True),
        ({"run": 0, "done": True}, False),
        ({"run": 1}, False),
    ],
)
def test_all_is_expected_that_an_estimator_has_had_its_last_word_on(word, expected):
    of, asked = attending(SimpleNamespace(run=1, first=3), **word), []
    whole = WholeEstimates(Silence(), "e", of, lambda topic, raw: None)
    for stream in whole.streams.values():
        stream.expect = lambda *given: asked.append(given)
    whole._expect_all_that_was_said()
    assert asked == [(1, 3, of.others.word("e").next)] * len(whole.streams) * expected


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


@pytest.mark.parametrize(
    ("counted", "estimators", "found", "subscribes"),
    [(False, True, True, 1), (False, True, False, 0), (True, True, True, 0), (False, False, True, 0)],
)
def test_a_viewer_is_counted_once_it_hears_some_estimator_and_each_wholly(counted, estimators, found, subscribes):
    made = []
    node = SimpleNamespace(
        replay_goes_on=False, counted="counted" if counted else None, heard_since=-1e9, _on_first_sample=None,
        estimates={"e": SimpleNamespace(found=found)} if estimators else {},
        create_subscription=lambda *given, **more: made.append(given) or "counted",
        attending=SimpleNamespace(tell=lambda: None),
    )  # fmt: skip
    ViewerNode._be_counted(node)
    assert len(made) == subscribes


@pytest.mark.parametrize(
    ("structure", "test", "known"), [("model", "test", True), (None, "test", False), ("model", None, False)]
)
def test_a_structure_is_drawn_where_both_the_model_and_the_test_are_known(monkeypatch, structure, test, known):
    monkeypatch.setattr(viewer_node, "applied", lambda structure, test: "drawn")
    node = SimpleNamespace(structure_named=lambda model: structure, test=test, estimates={})
    assert (ViewerNode._structure_of(node, "e", 0, "model") == "drawn") == known


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


@pytest.mark.parametrize(
    ("asked", "display", "served"),
    [(True, False, True), (True, True, False), (False, False, False), (False, True, False)],
)
def test_a_page_is_served_where_it_is_asked_for_and_no_window_can_be_had(monkeypatch, asked, display, served):
    settings = {name: allowed.default for name, allowed in viewer_node.PARAMETERS.items()}
    made_up = {
        "declare_parameters": lambda node, table: settings | {"web": asked, "open": False},
        "check_outputs": lambda *given: None, "has_display": lambda: display,
        "Sinks": lambda *given: SimpleNamespace(port=settings["port"], url="url", rrd=""),
        "Recorder": lambda *given, **more: None, "WebViewer": lambda url, port: SimpleNamespace(page="page"),
        "Attending": lambda *given: SimpleNamespace(tell=lambda: None), "Account": lambda *given: None,
        "HealthReport": lambda *given: None, "hear": lambda *given: None, "Future": lambda: None,
    }  # fmt: skip
    for name, instead in made_up.items():
        monkeypatch.setattr(viewer_node, name, instead)
    monkeypatch.setattr(viewer_node.os, "nice", lambda n: None)
    monkeypatch.setattr(viewer_node.Node, "__init__", lambda *given, **more: None)
    for name in ("create_subscription", "create_timer"):
        monkeypatch.setattr(ViewerNode, name, lambda *given, **more: None)
    monkeypatch.setattr(ViewerNode, "get_logger", lambda node: SimpleNamespace(info=print, warning=print))
    assert bool(ViewerNode().web) == served


def test_a_revision_is_named_by_what_was_taken_out_and_added():
    friction, damper = (SimpleNamespace(type=kind, target="front") for kind in ("friction", "damper"))
    given = SimpleNamespace(name="car", effects=[friction])
    assert revision_name(given, given, []) == "car"
    changed = SimpleNamespace(name="car", effects=[])
    assert revision_name(given, changed, [damper]) == "car - friction on front + damper on front"


@pytest.mark.parametrize(("given", "seconds"), [(0.0, float("inf")), (8.0, 8.0)])
def test_a_diagnosis_without_a_time_limit_has_all_the_time(given, seconds):
    values = {name: allowed.default for name, allowed in diagnosis_parameters.PARAMETERS.items()} | {
        "time_limit": given
    }
    assert diagnosis_parameters.Wanted.from_values(values).seconds == seconds
