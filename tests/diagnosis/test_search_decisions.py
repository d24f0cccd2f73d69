"""How far a search goes: the fits are made up, what is tried after them is judged."""

from types import SimpleNamespace

import numpy as np
import pytest
from helpers_made_up_fits import candidate, model

from crash_estimator.core.diagnosis import THRESHOLDS
from crash_estimator.core.diagnosis.online import candidate_turns
from crash_estimator.core.diagnosis.online.candidate_turns import OnlineState
from crash_estimator.core.diagnosis.selection import candidate_fits, forward_selection, pair_search, selection_step
from crash_estimator.core.diagnosis.selection.acceptance import needed_share
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.effect import Addition

MAGNITUDES = SimpleNamespace(structure=None)


CARE = ["along", "slowly", "other_variants", "anew", "profile"]


@pytest.mark.parametrize(
    ("out_of_reach", "explains_most", "found", "left", "tried"),
    [
        (False, True, (), 50.0, CARE),
        (False, False, (), 50.0, [CARE[1], CARE[-1]]),
        (False, False, (), 150.0, CARE),
        (True, False, (), 150.0, CARE),
        (True, True, (), 150.0, []),
        (True, False, ("one",), 150.0, []),
        (False, False, ("one",), 150.0, []),
        (False, True, ("one",), 50.0, CARE),
    ],
)
def test_care_is_taken_within_reach_of_noise_and_with_a_further_effect_where_most_is_explained(
    monkeypatch, out_of_reach, explains_most, found, left, tried
):
    """What explains less is fitted neither in other ways nor anew, but of a real structure."""
    called = []

    class Search:
        def __init__(self, *given):
            self.profile = lambda: called.append("profile")
            self.from_motion = self.from_model = lambda given: None  # are done whatever is found
            self.remembered_otherwise = lambda: None  # likewise

        def __getattr__(self, name):
            return lambda *given: called.append(name)

        out_of_reach = staticmethod(lambda: out_of_reach)
        explains_most = staticmethod(lambda: explains_most)
        reached_the_floor = staticmethod(lambda: False)
        ranking = staticmethod(lambda: called)

    monkeypatch.setattr(candidate_fits, "_Search", Search)
    monkeypatch.setattr(candidate_fits, "candidates", lambda *given: ())
    monkeypatch.setattr(candidate_fits, "screen", lambda *given: [])
    monkeypatch.setattr(candidate_fits, "search_is_over", lambda: False)
    before = model(mean_square=left, additions=found)
    assert candidate_fits.fit_candidates(None, {}, before, thorough=True) == tried


@pytest.mark.parametrize(("white", "asked"), [(False, ["hardly screened", "along"]), (True, ["hardly screened"])])
def test_rivals_that_a_screening_does_not_see_are_fitted_beside_what_leaves_noise(monkeypatch, white, asked):
    """And others along its motion, but where the model leaves noise as given."""
    called = []

    class Search:
        def __init__(self, *given):
            pass

        def __getattr__(self, name):
            return lambda *given: None

        reached_the_floor = staticmethod(lambda: True)
        hardly_screened = staticmethod(lambda: called.append("hardly screened"))
        along = staticmethod(lambda: called.append("along"))

    monkeypatch.setattr(candidate_fits, "_Search", Search)
    monkeypatch.setattr(candidate_fits, "candidates", lambda *given: ())
    monkeypatch.setattr(candidate_fits, "screen", lambda *given: [])
    monkeypatch.setattr(candidate_fits, "search_is_over", lambda: False)
    candidate_fits.fit_candidates(None, {}, model(white=white), thorough=True)
    assert called == asked


@pytest.mark.parametrize(("leaves_noise", "explained", "over", "looked_for"), [
    (False, 0.9, False, True), (True, 0.9, False, False), (False, 0.96, False, False), (False, 0.9, True, False),
])  # fmt: skip
def test_an_effect_on_two_elements_is_looked_for_only_where_one_does_not_explain_nearly_all_and_there_is_time(
    monkeypatch, leaves_noise, explained, over, looked_for
):
    asked, given = [], model(white=True)
    first = SimpleNamespace(
        leaves_noise=leaves_noise, share_removed=explained, candidates=[], before=given, doubted=[], as_recorded=[]
    )
    monkeypatch.setattr(forward_selection, "share_removed", lambda before, after: explained)
    monkeypatch.setattr(forward_selection, "common_effects", lambda *given: {})
    monkeypatch.setattr(forward_selection, "search_is_over", lambda: over)
    monkeypatch.setattr(forward_selection, "two_of_one_effect", lambda *given: asked.append(given) or [])
    monkeypatch.setattr(forward_selection, "two_at_once", lambda *given: None)
    monkeypatch.setattr(forward_selection, "_one_by_one", lambda *given: ([first], model()))
    forward_selection.forward_selection(MAGNITUDES, {}, given, first)
    assert bool(asked) == looked_for


def test_the_first_effect_of_a_path_was_followed_where_a_second_was_fitted_beside_it():
    one = SimpleNamespace(key=("friction", "spring"))
    first = SimpleNamespace(before=model(), candidates=[candidate(500.0)])
    second = SimpleNamespace(before=model(additions=(one,)), candidates=[candidate(1.0)])
    screened = SimpleNamespace(before=second.before, candidates=[candidate(1.0, fitted=False)])
    followed = [forward_selection._followed(path) for path in ([first], [first, screened], [first, second])]
    assert followed == [None, None, one.key]


def test_what_was_followed_one_by_one_or_explains_too_little_is_not_followed_in_a_pair(monkeypatch):
    tried = []
    monkeypatch.setattr(pair_search, "analyse", lambda fit: SimpleNamespace(mean_square=2.0))
    monkeypatch.setattr(pair_search, "cost_of_noise", lambda records: 0.0)
    monkeypatch.setattr(pair_search, "fit_candidates", lambda m, effects, key, least: tried.append(key) or [])
    monkeypatch.setattr(pair_search, "effects_beside", lambda *given: {})
    little = {("stop", "a"): True}
    monkeypatch.setattr(pair_search, "as_fitted", lambda mod, one: one.addition.key)
    monkeypatch.setattr(pair_search, "band_of", lambda *given: None)
    monkeypatch.setattr(pair_search, "explains_too_little", lambda before, key, band: little.get(key, False))
    found = [candidate(900.0, ("friction", "a")), candidate(800.0, ("damping", "a")), candidate(700.0, ("stop", "a"))]
    assert pair_search.two_at_once(MAGNITUDES, {}, model(), found, [], ("friction", "a")) is None
    assert tried == [("damping", "a")]


@pytest.mark.parametrize(("removed", "believed"), [((0.1, 0.2), True), ((0.1, 0.14), False)])
def test_a_further_step_goes_on_only_where_a_candidate_explains_more_than_too_little(monkeypatch, removed, believed):
    step = SimpleNamespace(leaves_noise=False, before=None, candidates=[candidate(gain) for gain in removed])
    monkeypatch.setattr(forward_selection, "in_recorded_noise", lambda *given: step)
    monkeypatch.setattr(forward_selection, "only_screened", lambda *given: "screened")
    monkeypatch.setattr(forward_selection, "is_rare", lambda addition: False)
    monkeypatch.setattr(forward_selection, "band_of_steps", lambda steps: None)
    monkeypatch.setattr(forward_selection, "as_fitted", lambda before, one: one.gain)
    monkeypatch.setattr(forward_selection, "share_explained", lambda before, gain, band: gain)
    found = forward_selection._next_step(None, {}, model(additions=("one",)), ["the first step"])
    assert found == (step if believed else "screened")


@pytest.mark.parametrize(("white", "asked"), [(False, [{"friction", "gas"}]), (True, [])])
def test_where_one_by_one_leaves_more_than_noise_pairs_are_tried_rare_effects_among_them(monkeypatch, white, asked):
    tried, effects = [], {"friction": 1, "gas": 2}
    first = selection_step.SelectionStep(model(white=True), [candidate(500.0)])
    monkeypatch.setattr(forward_selection, "common_effects", lambda structure, every: {"friction": 1})
    monkeypatch.setattr(forward_selection, "search_is_over", lambda: False)
    monkeypatch.setattr(forward_selection, "_one_by_one", lambda *given: ([first], model(white=white)))
    monkeypatch.setattr(forward_selection, "two_at_once", lambda m, effects, *given: tried.append(set(effects)))
    path, _ = forward_selection.forward_selection(MAGNITUDES, effects, model(), first)
    assert path == [first] and tried == asked


def test_pairs_are_of_the_candidates_for_the_model_as_given_though_a_first_effect_went_again(monkeypatch):
    """The path then begins with what was fitted beside that one, whose fits are of a larger model."""
    tried = []
    first, second = (selection_step.SelectionStep(model(white=True), [], [k]) for k in ("given", "later"))
    first = first._replace(doubted=["rare"])
    monkeypatch.setattr(forward_selection, "common_effects", lambda structure, every: {})
    monkeypatch.setattr(forward_selection, "search_is_over", lambda: False)
    monkeypatch.setattr(forward_selection, "_one_by_one", lambda *given: ([second], model()))
    monkeypatch.setattr(forward_selection, "two_at_once", lambda m, e, given, *others: tried.append(others[0]))
    forward_selection.forward_selection(MAGNITUDES, {}, model(), first)
    assert tried == [["rare", "given"]]


def test_a_search_that_is_over_has_looked_at_all_candidates_once(monkeypatch):
    step = SimpleNamespace(best=None, before=None, candidates=[])
    monkeypatch.setattr(forward_selection, "search_is_over", lambda: True)
    monkeypatch.setattr(forward_selection, "common_effects", lambda *given: {})
    monkeypatch.setattr(forward_selection, "_next_step", lambda *given: step)
    monkeypatch.setattr(forward_selection, "with_rare_ones", lambda m, e, first, found: first)
    monkeypatch.setattr(forward_selection, "_none_leads", lambda step: False)
    monkeypatch.setattr(forward_selection, "weighed", lambda m, e, done, path, evenly: done)
    monkeypatch.setattr(forward_selection, "better", lambda one, other: False)
    monkeypatch.setattr(forward_selection, "without_the_superseded", lambda m, path, final: (path, final))
    path, _ = forward_selection._one_by_one(MAGNITUDES, {}, model(), [])
    assert path == [step]


def test_a_larger_noise_is_that_of_a_candidate_that_gains(monkeypatch):
    """Of those that do, the one whose noise makes the recordings likeliest: the largest whitener."""
    step = selection_step.SelectionStep(
        model(), [candidate(500.0), candidate(300.0), candidate(0.5 * THRESHOLDS.gain), candidate(900.0, fitted=False)]
    )
    monkeypatch.setattr(selection_step, "analyse", lambda fit: SimpleNamespace(residual=fit.evidence))
    monkeypatch.setattr(selection_step, "bounded", lambda residual, records: residual)
    whitener = {500.0: 1.0, 300.0: 2.0, 0.5 * THRESHOLDS.gain: 9.0}
    monkeypatch.setattr(
        selection_step,
        "with_inflated_noise",
        lambda records, left: (SimpleNamespace(of=left, whitener=whitener[left] * np.eye(2)),),
    )
    (found,) = selection_step._noise_left_by(step, ())
    assert found.of == 300.0


@pytest.mark.parametrize("astray", [True, False])
def test_in_another_noise_a_model_starts_from_the_measured_motion_and_from_its_own_fit(monkeypatch, astray):
    other, fit_there = "from its own", SimpleNamespace(cost=9.0, problem=SimpleNamespace(narrowed=lambda *given: given))
    found = SimpleNamespace(fit=fit_there, refitted=lambda start, schedule, hopeless: (other, start, hopeless))
    monkeypatch.setattr(selection_step, "fit_model", lambda magnitudes, records, additions: found)
    monkeypatch.setattr(selection_step, "better", lambda one, than: astray and than is found)
    before = SimpleNamespace(additions=(), fit=SimpleNamespace(layout="layout", point="point"))
    told = selection_step._fitted_from_either(None, (), before)
    assert told == ((other, ("layout", "point"), 9.0) if astray else found)


@pytest.mark.parametrize(("changes", "gain", "fitted", "times"), [
    ((1.0, 0.06, 0.06), 500.0, True, 3), ((1.0, 0.04, 0.06), 500.0, True, 1), ((0.01, 0.04), 500.0, True, 1),
    ((1.0, 0.06, 0.06), 0.9 * THRESHOLDS.gain, True, 1), ((1.0, 0.06, 0.06), 500.0, False, 1),
])  # fmt: skip
def test_the_noise_is_taken_larger_until_it_stays_as_it_is(monkeypatch, changes, gain, fitted, times):
    """However little it changes the first time: until then it was the sensors'. Once, where nothing counts in it."""
    quietness, larger, ways = 0.0, [], []

    def louder(step, records):
        nonlocal quietness
        quietness -= changes[len(larger)]
        return (SimpleNamespace(whitener=np.exp(quietness / 2) * np.eye(2)),)

    def refitted(magnitudes, records, before):
        larger.append(records)
        return SimpleNamespace(**vars(model()) | {"records": records})

    monkeypatch.setattr(selection_step, "analyse", lambda fit: SimpleNamespace(white=False))
    monkeypatch.setattr(selection_step, "_noise_left_by", louder)
    monkeypatch.setattr(selection_step, "_fitted_from_either", refitted)
    found = [candidate(gain, fitted=fitted)]
    monkeypatch.setattr(selection_step, "fit_candidates", lambda *given, in_other_noise: ways.append("fitted") or found)
    monkeypatch.setattr(selection_step, "screen_candidates", lambda *given: ways.append("screened") or found)
    monkeypatch.setattr(selection_step, "band_of_steps", lambda steps: None)
    monkeypatch.setattr(selection_step, "evenly_fitted", lambda *given: None)
    selection_step.weighed(None, {}, selection_step.SelectionStep(model(), [candidate(500.0, fitted=fitted)]))
    assert len(larger) == times and ways == ["fitted" if fitted else "screened"] * times


@pytest.mark.parametrize(("added", "share"), [
    ([], THRESHOLDS.most), (["hysteresis"], THRESHOLDS.nearly_all),
    (["coulomb_friction", "constant_force"], THRESHOLDS.most),
    (["coulomb_friction", "hysteresis"], THRESHOLDS.practically_all),
    (["yielding"], THRESHOLDS.nearly_all), (["constant_force", "yielding"], THRESHOLDS.nearly_all),
    (["bottoming_out"], THRESHOLDS.nearly_all), (["clearance"], THRESHOLDS.most),
    (["bottoming_out", "yielding"], 1.0),
])  # fmt: skip
def test_a_curve_or_a_law_with_two_constants_must_explain_nearly_all_and_two_laws_of_one_element_more(added, share):
    additions = [Addition(EFFECTS[name], "spring", variant=EFFECTS[name].variants[0]) for name in added]
    assert needed_share(additions) == share


@pytest.mark.parametrize(("white", "by_fit"), [(False, {2, 6, 10}), (True, {0, 2, 4, 6, 8, 10})])
def test_every_other_screening_is_along_the_model_s_own_motion(monkeypatch, white, by_fit):
    """A strong effect is seen along the measured one, a weak one along the model's."""
    seen, before = [], model(white=white)
    monkeypatch.setattr(candidate_turns, "candidates", lambda *given: ())
    monkeypatch.setattr(candidate_turns, "screen", lambda *given, fitted: seen.append(fitted) or ())
    for updates in range(0, 12, 2):
        candidate_turns._screened(OnlineState(updates=updates), None, {}, before)
    assert {2 * k for k, fitted in enumerate(seen) if fitted is before.fit} == by_fit


@pytest.mark.parametrize(("leader", "has_fit", "goes_on"), [
    (True, True, True), (True, False, False), (False, True, False), (False, False, False),
])  # fmt: skip
def test_only_the_leader_goes_on_from_its_own_last_fit(monkeypatch, leader, has_fit, goes_on):
    fits = []
    addition = SimpleNamespace(key=("friction", "spring"))
    monkeypatch.setattr(candidate_turns, "make_problem", lambda *given: "problem")
    monkeypatch.setattr(candidate_turns, "carried_on", lambda last, problem: f"on from {last}")
    monkeypatch.setattr(
        candidate_turns, "fit", lambda problem, start, *more, **m: fits.append(start) or SimpleNamespace(cost=1.0)
    )
    state = OnlineState(
        leaders=(addition if leader else SimpleNamespace(key=addition.key),),
        fits={addition.key: "its last"} if has_fit else {},
    )
    candidate_turns._fit(state, model(), None, addition, None)
    assert fits == (["on from its last"] if goes_on else [None])


def test_a_candidate_is_not_taken_for_one_that_is_gone(monkeypatch):
    """Its place in memory may be another's that was fitted before: then a run's answer hung on where objects lay."""
    fitted = []
    monkeypatch.setattr(candidate_fits, "fit", lambda *given: fitted.append(1))
    monkeypatch.setattr(candidate_fits._Search, "_problem", lambda self, addition: None)
    monkeypatch.setattr(candidate_fits._Search, "_note", lambda self, addition, found: None)
    search = candidate_fits._Search(None, SimpleNamespace(fit=SimpleNamespace(cost=1.0), white=False), ())
    for k in range(20):
        search._fit(Addition(EFFECTS["unmodelled_body"], f"channel {k}"))
    assert len(fitted) == 20
