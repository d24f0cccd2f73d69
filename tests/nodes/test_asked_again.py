"""What nodes do about what they have missed, without a graph: whom they ask, for what, and when they are done."""

from types import SimpleNamespace

import pytest
from crash_msgs.msg import ReplayState
from crash_msgs.srv import GetEstimates
from helpers_alone import Silence, attending
from helpers_estimation import ESTIMATED, oscillator, oscillator_recording
from rclpy.serialization import deserialize_message

from crash_estimator.core.diagnosis.report.tolerance import DEFAULT
from crash_estimator.core.methods import make_estimator
from crash_estimator.following.follower import Follower
from crash_estimator.kept import Kept, Rows
from crash_estimator.nodes import diagnosis_answerer
from crash_estimator.nodes.asking import Asking
from crash_estimator.nodes.diagnosis_node import DiagnosisNode
from crash_estimator.nodes.estimate_messages import EstimateMessages
from crash_estimator.nodes.estimates_again import EstimatesAgain
from crash_estimator.nodes.estimator_model import EstimatorModel
from crash_estimator.nodes.estimator_node import EstimatorNode
from crash_estimator.nodes.intake import Intake
from crash_replay.ros_messages import stamp_ns

FINISHED, PLAYING = (
    ReplayState(state=state, run=1, number=100) for state in (ReplayState.FINISHED, ReplayState.PLAYING)
)


@pytest.mark.parametrize(
    ("has_come", "state", "listening", "busy", "asks"),
    [
        (False, None, True, False, False),
        (False, PLAYING, True, False, False),  # the first sample will tell what it lacks
        (False, FINISHED, True, False, True),
        (True, PLAYING, True, False, True),
        (True, None, True, False, True),
        (True, PLAYING, False, False, False),
        (True, PLAYING, True, True, False),
    ],
)
def test_who_has_missed_the_end_asks_for_it(has_come, state, listening, busy, asks):
    """Who joins late too, but while samples still come only from the first of them on."""
    arrivals = SimpleNamespace(begun=has_come, run=1, next=40)
    intake = SimpleNamespace(
        attending=attending(state), arrivals=arrivals, listening=listening, waiting=(), refused=None,
        asking=SimpleNamespace(busy=busy),
    )  # fmt: skip
    place = Intake._place(intake)
    assert (place is not None) == asks
    if asks:
        assert (place == (1, 40)) == has_come
        intake.refused = place
        assert Intake._place(intake) is None  # what was refused is not asked for again


@pytest.mark.parametrize(("given", "there", "name"), [("", [], "replay"), ("", ["p"], "p"), ("own", ["p"], "own")])
def test_which_replay_is_asked(given, there, name):
    others = SimpleNamespace(names=lambda kind: ["gone", *there], there=lambda name: name in there)
    asking = Asking(Silence(), given, SimpleNamespace(others=others), None, None)
    assert asking.client.srv_name == f"{name}/get_samples"


@pytest.mark.parametrize(
    ("next_one", "state", "waiting", "later", "done"),
    [
        (400, PLAYING, False, False, True),
        (399, PLAYING, False, False, False),
        (400, PLAYING, True, False, False),  # some are still to be estimated
        (400, PLAYING, False, True, False),  # some estimates are still to be published
        (100, FINISHED, False, False, True),  # the replay was stopped there
        (100, PLAYING, False, False, False),
    ],
)
def test_when_an_estimator_is_through(next_one, state, waiting, later, done):
    node = SimpleNamespace(
        test_message=SimpleNamespace(samples=400), stopped="", attending=attending(state),
        follower=SimpleNamespace(kept=SimpleNamespace(missing=lambda number: 0)),
        intake=SimpleNamespace(arrivals=SimpleNamespace(run=1), next=next_one, waiting=waiting, refused=None),
        topics=SimpleNamespace(later=SimpleNamespace(waiting=later)),
    )  # fmt: skip
    progress = EstimatorNode._progress(node)
    assert (progress.done, progress.next, progress.total) == (done, next_one, 400)


def test_an_estimator_that_nothing_fits_is_done_at_once():
    node = SimpleNamespace(test_message=SimpleNamespace(samples=400), follower=None, at_fault="no channel")
    progress = EstimatorNode._progress(node)
    assert progress.done and progress.next == progress.total == 400 and progress.reason == "no channel"


@pytest.mark.parametrize(
    ("run", "end", "came", "stands"),
    [
        (1, 40, (1, 60), (1, 60)),
        (1, 80, (1, 60), (1, 80)),  # a gap was filled, there is more after it
        (0, 80, (1, 60), (1, 60)),  # of the next pass, of which nothing had come
    ],
)
def test_where_the_diagnosis_stands_when_what_it_missed_has_come(run, end, came, stands):
    asked = []
    node = SimpleNamespace(
        run=run, end=end, rest_of=came[0], kept=SimpleNamespace(put_rows=lambda rows: None),
        catching_up=SimpleNamespace(ask_at_once=lambda: asked.append(1)),
    )  # fmt: skip
    DiagnosisNode._on_samples_again(node, SimpleNamespace(end=came[1]))
    assert (node.run, node.end) == stands and asked


def test_each_pass_of_a_bag_that_is_played_again_counts_as_one():
    node = SimpleNamespace(kept=object(), run=0, end=90, _begin_anew=lambda: None)
    estimator = SimpleNamespace(feed_run=0, follower=None)
    for run in (1, 2):
        DiagnosisNode._on_feed_begins(node, renumbered=False)
        EstimatorNode._on_feed_begins(estimator, renumbered=False)
        assert (node.run, node.end, estimator.feed_run) == (run, 0, run)


def test_each_change_of_a_model_is_one_revision():
    given = EstimatorModel(oscillator(ESTIMATED), "mrls", {"forgetting": 0.99}, {}, revision=0)
    changed = given.with_settings({"settings.forgetting": 0.9})
    assert (changed.settings["forgetting"], changed.revision) == (0.9, 1)
    assert changed.with_structure(oscillator()).revision == 2 and given.revision == 0


@pytest.mark.parametrize(("prepared", "busy", "told"), [(False, False, 1), (False, True, 0), (True, False, 0)])
def test_a_diagnosis_says_once_that_it_is_prepared(prepared, busy, told):
    said = []
    node = SimpleNamespace(
        prepared=prepared, kept=None, attending=SimpleNamespace(tell=lambda: said.append(1)),
        worker=SimpleNamespace(busy=busy, reply=lambda: None),
    )  # fmt: skip
    for _ in range(3):
        DiagnosisNode._look(node)
    assert len(said) == told and node.prepared == (not busy)


def test_what_is_said_again_has_the_stamp_of_its_first_sample():
    recording = oscillator_recording(n=60)
    follower = Follower(make_estimator(oscillator(ESTIMATED), recording.test, "mrls"), Kept(recording.test))
    rows = Rows(0, recording.time_ns, recording.values)
    follower.keep(rows)
    said = follower.follow(rows)
    again = EstimatesAgain(Silence())
    again.begin_test(time_zero=10**18)
    again.begin(follower, 0)
    response = again._serve(GetEstimates.Request(start=20, stop=30), GetEstimates.Response())
    assert response.success
    first = EstimateMessages(follower.estimator.description)
    for message, make in ((response.parameters, first.parameters), (response.residuals, first.residuals)):
        at = 10**18 + int(recording.time_ns[20])
        assert (stamp_ns(message.header.stamp), message.number, len(message.time_ns)) == (at, 20, 10)
        whole = deserialize_message(make(10**18, 0, said), type(message))
        assert list(message.time_ns) == list(whole.time_ns[20:30])


@pytest.mark.parametrize(
    ("feeding", "told", "unlatched", "begun"),
    [
        (False, "one", None, True),
        (False, "other", None, True),
        (True, "one", None, False),  # rosbag2's player begins its bag once more
        (True, "other", None, True),
        (False, "one", "one", False),  # the same publisher was heard without latching
    ],
)
def test_a_test_that_is_told_once_more_is_a_new_one_but_from_who_repeats_itself(feeding, told, unlatched, begun):
    tests = []
    node = SimpleNamespace(
        test_message="one", unlatched=unlatched, feed=SimpleNamespace(active=feeding), _begin_test=tests.append
    )
    EstimatorNode._on_test(node, told)
    assert bool(tests) == begun and node.unlatched is None


@pytest.mark.parametrize("stated", [None, DEFAULT._replace(of_peak=0.07)])
def test_what_is_tolerated_is_what_the_task_says_else_the_default(monkeypatch, stated):
    asked = []
    monkeypatch.setattr(diagnosis_answerer, "diagnose", lambda *given: asked.append(given[3]))
    monkeypatch.setattr(diagnosis_answerer, "final_answer", lambda found: found)
    diagnosis_answerer.Answerer({}).answer(diagnosis_answerer.Task(None, None, True, stated, 1.0))
    assert asked == [stated or DEFAULT]
