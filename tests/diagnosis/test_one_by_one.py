"""How effects are added one by one: the fits are made up, which is added and what is asked then is judged."""

from types import SimpleNamespace

import pytest
from helpers_made_up_steps import model, step

from crash_estimator.core.diagnosis import THRESHOLDS
from crash_estimator.core.diagnosis.selection import forward_selection
from crash_estimator.core.diagnosis.selection.candidate_fits import CandidateFit
from crash_estimator.core.diagnosis.selection.selection_step import SelectionStep


@pytest.mark.parametrize(("gains", "added"), [((500.0, 400.0, 0.0), 2), ((0.0,), 0), ((500.0,) * 9, None)])
def test_effects_are_added_one_by_one_as_long_as_they_gain_anything(monkeypatch, gains, added):
    """And no more of them than the most steps there are, whatever they gain."""
    left = iter(gains)
    path, final = one_by_one(monkeypatch, 100.0, lambda before: step(before, next(left)), noise_with=1)
    assert len(final.additions) == len(path) - 1 == (THRESHOLDS.few if added is None else added)


@pytest.mark.parametrize("noise_with", [3, 4])
def test_beyond_two_effects_only_one_that_leaves_noise_is_added(monkeypatch, noise_with):
    path, final = one_by_one(monkeypatch, 50.0, step, noise_with=noise_with)
    assert len(final.additions) == len(path) - 1 == (3 if noise_with == 3 else 2)


@pytest.mark.parametrize(("left", "gain", "added"), [(1.0, 9.0, 0), (1.0, 11.0, 1), (1.2, 9.0, 1), (1.2, 19.0, 1)])
def test_beside_noise_a_first_effect_must_stand_out_from_none_and_a_second_one_more(monkeypatch, left, gain, added):
    """The last two leave more than noise as given, and noise with the first one: what comes next must gain 20."""
    path, final = one_by_one(monkeypatch, left, lambda before: step(before, gain))
    assert len(final.additions) == len(path) - 1 == added


FITS = [(10000.0, False, 2), (50.0, False, 3), (10000.0, True, 1), (50.0, True, 2)]


@pytest.mark.parametrize(("left", "rare", "fits"), FITS)
def test_what_would_not_be_believed_is_not_fitted(monkeypatch, left, rare, fits):
    """Far from noise beyond two or beside a rare effect: what is left is looked at, and no candidate fitted to it."""
    asked = []
    path, _ = one_by_one(monkeypatch, left, lambda before: asked.append(before) or step(before), rare=rare)
    assert len(asked) == fits and path[-1].candidates == []


@pytest.mark.parametrize("noise_with", [2, 3])
def test_beside_a_rare_effect_only_one_that_leaves_noise_is_added(monkeypatch, noise_with):
    _, final = one_by_one(monkeypatch, 50.0, step, noise_with=noise_with, rare=True)
    assert (len(final.additions) > 1) == (noise_with == 2)


@pytest.mark.parametrize("rare", [True, False])
def test_beside_a_rare_effect_only_one_elsewhere_is_looked_at(monkeypatch, rare):
    beside, elsewhere = (SimpleNamespace(leaves_noise=noise, candidates=[]) for noise in (True, False))
    monkeypatch.setattr(forward_selection, "is_rare", lambda addition: rare)
    monkeypatch.setattr(forward_selection, "in_recorded_noise", lambda *given: beside)
    monkeypatch.setattr(forward_selection, "only_screened", lambda *given: "nothing else")
    monkeypatch.setattr(forward_selection, "_all_explain_less", lambda *given: False)
    monkeypatch.setattr(forward_selection, "elsewhere_than", lambda magnitudes, rare, step: elsewhere)
    found = forward_selection._next_step(None, {}, model(50.0, 1), [])
    assert found == ("nothing else" if rare else beside)


@pytest.mark.parametrize(("rare", "beside"), [(False, [0, 1]), (True, [0])])
def test_a_rare_effect_is_asked_for_alone_and_beside_a_common_one(monkeypatch, rare, beside):
    asked = []
    with_rare_ones = lambda m, e, first, found: asked.append(len(first.before.additions)) or first  # noqa: E731
    one_by_one(monkeypatch, 50.0, step, rare=rare, with_rare_ones=with_rare_ones)
    assert asked == beside


def test_what_explains_too_little_is_not_added_and_nothing_after_it(monkeypatch):
    told = [False, True]
    path, final = one_by_one(monkeypatch, 1e3, lambda before: step(before), little=lambda *given: told.pop(0))
    assert len(final.additions) == 1 and final is path[1].before and len(path) == 2 and not told


def test_what_was_found_until_the_limit_is_asked_whether_all_of_it_is_needed(monkeypatch):
    """The search is over once a second one was added."""
    found = []
    monkeypatch.setattr(forward_selection, "search_is_over", lambda: len(found) == 2)
    monkeypatch.setattr(forward_selection, "without_the_superseded", lambda m, path, final: ("fewer", final))
    path, final = one_by_one(monkeypatch, 100.0, lambda before: found.append(before) or step(before))
    assert path == "fewer" and len(final.additions) == 2


none_leads = forward_selection._none_leads


@pytest.fixture(autouse=True)
def any_leads_and_none_is_superseded(monkeypatch):
    monkeypatch.setattr(forward_selection, "_none_leads", lambda step: False)
    monkeypatch.setattr(forward_selection, "without_the_superseded", lambda m, path, final: (path, final))


@pytest.mark.parametrize(("leads", "added"), [([False, False], 0), ([False, True], 2), ([True], 2)])
def test_where_none_leads_in_the_sensors_noise_nor_in_a_larger_one_nothing_is_added(monkeypatch, leads, added):
    asked = iter(leads)
    monkeypatch.setattr(forward_selection, "_none_leads", lambda step: not next(asked))
    path, final = one_by_one(monkeypatch, 1e3, step)
    assert len(final.additions) == len(path) - 1 == added and not list(asked)


@pytest.mark.parametrize(
    ("left", "noise", "shares", "none"),
    [
        (50.0, False, (0.1, 0.4), True),
        (50.0, False, (0.1, 0.6), False),
        (50.0, True, (0.1, 0.4), False),
        (500.0, False, (0.1, 0.4), False),
        (1.5, False, (0.1, 0.4), False),
    ],
)
def test_what_explains_half_may_lead_and_anything_near_noise_or_of_a_real_structure(
    monkeypatch, left, noise, shares, none
):
    monkeypatch.setattr(SelectionStep, "leaves_noise", noise)
    monkeypatch.setattr(forward_selection, "band_of_steps", lambda steps: None)
    monkeypatch.setattr(forward_selection, "as_fitted", lambda before, one: one)
    monkeypatch.setattr(forward_selection, "share_explained", lambda before, share, band: share.gain)
    candidates = [CandidateFit(None, share, "fitted") for share in shares] + [CandidateFit(None, 0.9, None)]
    assert none_leads(SelectionStep(model(left), candidates)) == none


@pytest.mark.parametrize("errs_from", [1, 2, 3])
def test_an_error_of_a_channel_of_little_weight_ends_the_search(monkeypatch, errs_from):
    monkeypatch.setattr(forward_selection, "_errs_by_little", lambda path: len(path) >= errs_from)
    path, final = one_by_one(monkeypatch, 50.0, step)
    assert len(final.additions) == len(path) - 1 == errs_from - 1
    assert path[-1].before is final, "it is told beside what was not added"


@pytest.mark.parametrize(("distorts", "starts", "inflated", "share", "errs"), [
    ("delay", False, True, 0.96, True),
    ("delay", False, True, 0.94, False),
    ("", True, True, 0.96, True),  # of a stated speed
    ("", True, True, 0.94, False),
    ("", False, True, 0.96, False),  # it is no error of a recording
    ("delay", False, False, 0.96, False),  # only noise is left with it
    ("", True, False, 0.96, False),
])  # fmt: skip
def test_when_an_error_of_a_recording_is_of_little_weight(monkeypatch, distorts, starts, inflated, share, errs):
    """That with what was found before nearly all of the misfit is explained, in the band that the model speaks for."""
    first, last = step(model(100.0)), step(model(3.0, 1))
    last.before.fit.problem.noise_is_inflated = inflated
    last.best.addition.effect.distorts, last.best.addition.effect.changes_start = distorts, starts
    explained = {100.0: None, 3.0: SimpleNamespace(share_explained=lambda given: share)}
    monkeypatch.setattr(forward_selection, "band_of_steps", lambda path: 60)
    monkeypatch.setattr(forward_selection, "in_band", lambda fit, residuals, cfc: explained[residuals.mean_square])
    assert forward_selection._errs_by_little([first, last]) == errs


def one_by_one(
    monkeypatch,
    left: float,
    search,
    rare: bool = False,
    little=lambda *given: False,
    noise_with: int = 9,
    hopeless=lambda *given: False,
    with_rare_ones=lambda m, e, first, found: first,
) -> tuple[list, SimpleNamespace]:
    """Each addition takes a tenth of the mean square away; left: of it at first, search: what is found beside a model,
    noise_with: additions with which a candidate leaves noise."""
    white = lambda step: len(step.before.additions) + 1 >= noise_with  # noqa: E731
    monkeypatch.setattr(forward_selection, "common_effects", lambda *given: {})
    monkeypatch.setattr(forward_selection, "is_rare", lambda addition: rare)
    monkeypatch.setattr(forward_selection, "effects_beside", lambda *given: {})
    monkeypatch.setattr(forward_selection, "in_recorded_noise", lambda m, e, before: search(before))
    monkeypatch.setattr(forward_selection, "only_screened", lambda m, e, before, doubted: SelectionStep(before, []))
    monkeypatch.setattr(SelectionStep, "leaves_noise", property(white))
    monkeypatch.setattr(forward_selection, "as_fitted", lambda before, found: None)
    monkeypatch.setattr(forward_selection, "_all_explain_less", hopeless)
    monkeypatch.setattr(forward_selection, "with_rare_ones", with_rare_ones)
    monkeypatch.setattr(forward_selection, "elsewhere_than", lambda magnitudes, rare, step: step)
    monkeypatch.setattr(forward_selection, "weighed", lambda m, e, done, *path, **noises: done)
    monkeypatch.setattr(forward_selection, "_without", lambda model, found: model)
    monkeypatch.setattr(
        forward_selection,
        "added",
        lambda m, before, best: model(0.9 * (before.residuals.mean_square), len(before.additions) + 1),
    )
    monkeypatch.setattr(forward_selection, "band_of_steps", lambda path: None)
    monkeypatch.setattr(forward_selection, "evenly_fitted", lambda *given: "with it")
    monkeypatch.setattr(forward_selection, "explains_too_little", little)
    return forward_selection._one_by_one(SimpleNamespace(structure=None), {}, model(left), [])
