"""What an observer of estimators makes of what has come, and of what has not, without a graph."""

import time
from types import SimpleNamespace

import pytest
from crash_msgs.msg import EstimatorState
from helpers_alone import Silence, attending

from crash_estimator.following.in_order import About
from crash_estimator.nodes import whole_estimates
from crash_estimator.nodes.revised_estimates import RevisedEstimates, Wanted
from crash_estimator.nodes.viewer_account import ON_ITS_WAY, QUIET, Account
from crash_estimator.nodes.whole_estimates import TOPICS, WholeEstimates


def state(revision: int, number: int, run: int = 0) -> EstimatorState:
    return EstimatorState(revision=revision, run=run, number=number)


def whole_of(out: list) -> WholeEstimates:
    return WholeEstimates(Silence(), "e", attending(), lambda topic, raw: out.append((topic, raw)))


def test_the_model_of_a_sample_is_that_of_the_last_state_before_it():
    whole = whole_of([])
    for revision, number in ((0, 0), (1, 100), (2, 200)):
        whole._on_state(state(revision, number))
    assert [whole._revision(0, number) for number in (0, 99, 100, 150, 250)] == [0, 0, 1, 1, 2]
    whole._on_state(state(3, 100))  # the same pass once more: what was said of later samples is no longer so
    assert [whole._revision(0, number) for number in (99, 150, 250)] == [0, 3, 3]


def test_what_one_of_several_topics_lacks_is_given_up_there_and_no_further():
    out = []
    whole = whole_of(out)
    parameters, residuals, forces = (whole.streams[topic] for topic in TOPICS)
    for stream, numbers in ((parameters, (0, 3)), (residuals, (0, 2)), (forces, (0, 1, 2, 3))):
        for number in numbers:
            stream.receive(About(0, number, 1), number, 0)
    assert whole._gap() == (0, 1, 2)
    whole._give_up(0, 1, 9, "nobody can give them again")
    assert (parameters.lost, residuals.lost, forces.lost) == (2, 1, 0)
    assert [stream.next for stream in (parameters, residuals, forces)] == [4, 3, 4]
    assert whole.lacks(0, 0, 4) == "2 of 4 samples (nobody can give them again)"


@pytest.mark.parametrize(("number", "run", "taken"), [(1, 0, True), (2, 0, False), (1, 1, False)])
def test_an_answer_on_other_samples_is_none(monkeypatch, number, run, taken):
    out = []
    whole = whole_of(out)
    for stream in whole.streams.values():
        stream.receive(About(0, 0, 1), "first", 0)
        stream.receive(About(0, 2, 1), "last", 0)
    monkeypatch.setattr(whole_estimates, "serialize_message", lambda message: "again")
    block = SimpleNamespace(run=run, number=number, time_ns=[0])
    whole._fill(SimpleNamespace(parameters=block, residuals=block, forces=block), 0, 1)
    assert out.count(("forces", "again")) == taken and bool(whole.why_not) != taken
    assert [stream.next for stream in whole.streams.values()] == [3, 3, 3]


def test_an_observer_may_begin_before_it_knows_of_any_estimate():
    revised = RevisedEstimates(Silence(), "e", lambda topic, raw: None)
    for whole in (None, SimpleNamespace(states=[])):
        revised.follow(whole)
        revised.begin_test()
        assert revised.settled


def test_a_new_revision_is_news_on_its_own_test_once():
    revised = RevisedEstimates(Silence(), "e", lambda topic, raw: None)
    whole = SimpleNamespace(states=[state(2, 100)], attending=attending(), name="/e")
    revised.follow(whole)
    revised.begin_test()
    assert revised.settled  # that was said on the test before
    whole.states = [state(1, 50)]
    assert not revised.settled
    revised._look()
    assert revised.wanted == Wanted(1, 0, 0, 50)
    revised.call = object()
    revised.client.call_async = None  # it would be an error to ask once more
    revised.client.service_is_ready = lambda: True
    revised.asked = time.monotonic()
    revised._look()
    revised.call, revised.wanted = None, None
    assert revised.settled


@pytest.mark.parametrize(
    ("word", "since", "through"),
    [
        ({"done": True, "run": 1}, 1e3, True),
        ({"done": True, "run": 0}, 1e3, False),  # of the pass before
        ({"done": True, "run": 0, "reason": "no channel"}, 1e3, True),  # it will say nothing of this one either
        ({"done": False, "run": 1}, 1e3, False),
        ({"done": True, "run": 1}, 0.5 * min(QUIET, ON_ITS_WAY), False),  # what it has said is still on its way
    ],
)
def test_when_the_viewer_waits_for_a_diagnosis_no_longer(word, since, through):
    then = time.monotonic() - since
    account = SimpleNamespace(attending=attending(**word), found_at=then, at_work=then)
    assert bool(Account._is_through(account, "diagnosis", 1)) == through
