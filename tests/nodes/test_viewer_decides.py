"""What the viewer makes of what it knows, without a graph: what it waits for, asks for again and shows."""

import time
from types import SimpleNamespace

import pytest
from helpers_alone import Silence, attending

from crash_estimator.nodes import viewer_node, whole_estimates
from crash_estimator.nodes.revised_estimates import RevisedEstimates, Wanted
from crash_estimator.nodes.viewer_node import ViewerNode
from crash_estimator.nodes.whole_estimates import QUIET, WholeEstimates
from crash_replay.attending import Progress


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
