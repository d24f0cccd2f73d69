"""What the selection does with what its fits have found: the fits are made up, what follows from them is judged."""

from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest
from helpers_made_up_steps import model, step

from crash_estimator.core.diagnosis.online import candidate_turns
from crash_estimator.core.diagnosis.report import diagnosis as report
from crash_estimator.core.diagnosis.selection import assumptions, fitted_model, pair_search, selection_path
from crash_estimator.core.diagnosis.selection.acceptance import needed_gain
from crash_estimator.core.diagnosis.selection.fitted_model import forces_jump
from crash_estimator.core.diagnosis.selection.score_screening import Screened
from crash_estimator.core.diagnosis.selection.thresholds import THRESHOLDS


@pytest.mark.parametrize(
    ("left", "believed"),
    [
        ((100.0, 50.0, 10.0, 1.0), 3),  # together they leave noise, and the first ones do not
        ((100.0, 50.0, 3.0, 1.0), 2),  # the first ones leave next to nothing
        ((100.0, 50.0, 10.0, 9.0), 2),  # all of them leave more than noise
        ((100.0, 50.0, 10.0), 2),  # no more than are believed
    ],
)
def test_how_many_additions_are_believed_together(left, believed):
    models = [model(mean_square, k) for k, mean_square in enumerate(left)]
    path = selection_path.SelectionPath(None, [step(m) for m in models[:-1]], models[-1], models[-1].fit, (), 36)
    found = selection_path.first_believed(path)
    assert len(found.final.additions) == found.as_recorded.additions == believed
    assert len(found.steps) == min(believed + 1, len(models) - 1)


@pytest.mark.parametrize(("left", "over"), [(1.0, False), (1.5, True)])
def test_what_leaves_noise_or_has_no_time_is_not_searched_in_a_smaller_band(monkeypatch, left, over):
    path = selection_path.SelectionPath(None, [], model(left), None, (), 36)
    monkeypatch.setattr(assumptions, "_selected", lambda *given: path)
    monkeypatch.setattr(assumptions, "search_is_over", lambda: over)
    assert assumptions.select(None, (), {}) is path  # the band would be asked of its fit, which is none


class Band(NamedTuple):
    """A record of which all is compared, or what is below so many Hz."""

    below: float = np.inf

    def in_band(self, below):
        return Band(below)


@pytest.mark.parametrize(
    ("mean_square", "rings", "gone_on"), [(1.5, True, True), (2.5, True, False), (1.5, False, False)]
)
def test_what_rings_is_gone_on_with_below_the_band_as_soon_as_the_best_first_candidate_leaves_nothing_else(
    monkeypatch, mean_square, rings, gone_on
):
    """Under the contacts that were found; not where more than about the noise is left."""
    asked = []
    best = SimpleNamespace(fit=SimpleNamespace(mean_square=mean_square, evidence=0.0), addition="friction")
    given = SimpleNamespace(white=False, found=())
    first = selection_path.SelectionPath("found", [SimpleNamespace(best=best)], given, None, (Band(),), 36, whole=False)

    def selected(structure, records, effects):
        asked.append((structure, records[0].below, effects))
        return first if len(asked) == 1 else first._replace(records=tuple(records), whole=True)

    monkeypatch.setattr(assumptions, "_selected", selected)
    monkeypatch.setattr(assumptions, "analyse", lambda fitted: fitted)
    monkeypatch.setattr(assumptions, "vibrates_from", lambda left, records: 240.0 if rings else np.inf)
    monkeypatch.setattr(assumptions, "found_as_common", lambda effects, added: {"looked for first": added})
    found = assumptions.select("stated", (Band(),), {})
    assert assumptions._rings(first) == gone_on and found.whole == gone_on
    assert asked[1:] == ([("found", 240.0, {"looked for first": ["friction"]})] if gone_on else [])
    assert not assumptions._rings(first._replace(records=(Band(240.0),))), "below the band nothing more rings"


@pytest.mark.parametrize(("wanted", "over", "searches"), [(True, False, 2), (False, False, 1), (True, True, 1)])
def test_finer_curves_are_tried_where_they_are_wanted_and_there_is_time(monkeypatch, wanted, over, searches):
    begun, given = [], model(1.5)
    made_up = {
        "first_step": lambda *given: SimpleNamespace(leaves_noise=True),
        "forward_selection": lambda *given: begun.append(given) or ([step(given[2])], given[2]),
        "sized_models": lambda steps, final: [final],
        "fit_given": lambda *given: model(1.5),
        "drift_of": lambda fit: SimpleNamespace(constant=True),
        "analyse": lambda fit: None,
        "_with_finer_curves": lambda *given: SimpleNamespace(cells=72) if wanted else None,
        "up_to_the_least_error": lambda steps, final: (steps, final),
        "search_is_over": lambda: over,
    }
    for name, instead in made_up.items():
        monkeypatch.setattr(assumptions, name, instead)
    magnitudes = SimpleNamespace(structure=None, records=(), cells=36)
    assumptions._with_curves_as_fine_as_needed(magnitudes, given, {})
    assert len(begun) == searches


@pytest.mark.parametrize(("curve", "left", "found", "white_with", "taken"), [
    ("curve", 1.5, 1, 144, 144),  # what was found may stand for a kink
    ("curve", 1.5, 1, None, None),
    (None, 1.5, 1, 144, None),  # there is none to be finer
    ("curve", 1.5, 0, 144, None),  # nothing was found that could
    ("curve", 50.0, 1, 144, None),  # no kink leaves so much
    ("curve", 50.0, 2, 72, 72),  # of two the other alone
])  # fmt: skip
def test_curves_are_finer_where_effects_may_stand_for_their_folds(monkeypatch, curve, left, found, white_with, taken):
    monkeypatch.setattr(assumptions, "measure_magnitudes", lambda s, r, n: SimpleNamespace(records=r, cells=n))
    fitted = lambda by, records, additions: SimpleNamespace(white=by.cells == white_with)  # noqa: E731
    monkeypatch.setattr(assumptions, "fit_model", fitted)
    final = SimpleNamespace(found=found * ("effect",), given=(), white=True)
    layout = SimpleNamespace(links=[SimpleNamespace(curve=curve)])
    given = SimpleNamespace(residuals=SimpleNamespace(mean_square=left), fit=SimpleNamespace(layout=layout))
    finer = assumptions._with_finer_curves(SimpleNamespace(structure=None, records=()), given, final, False, None)
    assert (finer and finer.cells) == taken


@pytest.mark.parametrize(("knots", "goes_on"), [((0.0, 0.1), True), ((0.0, 0.1, 0.2), False)])
def test_a_fit_in_doubt_goes_on_from_the_one_that_was_not_where_the_curves_are_the_same(monkeypatch, knots, goes_on):
    """An element may have no curve of its own: there is nothing to compare then."""
    layout = lambda knots: SimpleNamespace(  # noqa: E731
        links=[SimpleNamespace(curve=None), SimpleNamespace(curve=SimpleNamespace(knots=np.array(knots)))]
    )
    problem = SimpleNamespace(layout=layout((0.0, 0.1)), widened=lambda *given: 0, moved=lambda *given: "there")
    before = model(1.5)
    before.fit.layout, before.fit.theta, before.fit.trajectories = layout(knots), None, None
    starts = []
    monkeypatch.setattr(assumptions, "make_problem", lambda *given: problem)
    monkeypatch.setattr(assumptions, "fit_model", lambda *given: starts.append(given[3]))
    assumptions._in_doubt(SimpleNamespace(records=()), before)
    assert starts == ["there" if goes_on else None]


@pytest.mark.parametrize(("together", "pairs"), [(300.0, 1), (50.0, 0)])
def test_an_effect_on_two_elements_is_tried_on_both(monkeypatch, together, pairs):
    """Neither explains enough alone; what the second one adds to the first must count for a pair."""
    given = model(100.0)
    one, other = (step(given).candidates[0] for _ in range(2))
    monkeypatch.setattr(pair_search, "as_fitted", lambda *given: model(50.0, 1))
    monkeypatch.setattr(pair_search, "_leading", lambda mod, candidates: candidates)
    monkeypatch.setattr(pair_search, "fit_model", lambda *given: model(1.0, 2, evidence=together))
    found = pair_search.two_of_one_effect(SimpleNamespace(), given, [one, other])
    assert len(found) == pairs
    for pair in found:
        assert [len(made.before.additions) for made in pair.path] == [0, 1] and pair.path[1].best.gain == together


FALLS_TO_ZERO = dict(tension=False, parallel=(), remembering=(), damping=None, known_damping=0.0)


@pytest.mark.parametrize(
    ("link", "jumps"),
    [
        ({}, False),
        ({"parallel": ("friction",)}, True),
        ({"remembering": ("bouc_wen",)}, True),
        ({"damping": 3}, True),
        ({"known_damping": 900.0}, True),
        ({"damping": 3, "tension": True}, False),  # it never separates
    ],
)
def test_what_makes_a_force_jump_where_a_contact_ends(link, jumps):
    layout = SimpleNamespace(links=[SimpleNamespace(**FALLS_TO_ZERO | link)])
    assert bool(forces_jump(layout)) == jumps


@pytest.mark.parametrize(("updates", "late", "tried"), [(1, False, 3), (1, True, 2), (0, False, 2), (0, True, 1)])
def test_of_candidates_of_an_update_some_are_tried_whatever_time_they_take(monkeypatch, updates, late, tried):
    """The leaders, or the first of them at every other update, and the one whose turn it is."""
    made = []
    monkeypatch.setattr(candidate_turns, "_screened", lambda *given: ())
    monkeypatch.setattr(candidate_turns, "shortlist", lambda *given: [Screened(addition("friction"), 5.0, 1.0, 1.0)])
    monkeypatch.setattr(candidate_turns, "_variant", lambda magnitudes, addition, turn: addition)
    fitted = SimpleNamespace(evidence=5.0)
    monkeypatch.setattr(candidate_turns, "_fit", lambda s, b, m, addition, one: made.append(addition) or fitted)
    monkeypatch.setattr(candidate_turns, "as_found", lambda tried: tried.addition)

    def addition(name):
        return SimpleNamespace(key=(name, "spring"))

    leaders = addition("damping"), addition("gap")
    gains = {leader.key: 5.0 for leader in leaders}
    state = candidate_turns.OnlineState(updates, leaders, gains)
    before = SimpleNamespace(additions=(), fit=SimpleNamespace(evidence=0.0))
    candidate_turns.try_some(state, None, {}, before, lambda: late)
    assert len(made) == tried


def test_where_a_slower_contact_is_likelier_it_is_judged_as_sharply(monkeypatch):
    asked = []
    first, slower = SimpleNamespace(evidence=1.0), SimpleNamespace(evidence=2.0)
    monkeypatch.setattr(fitted_model, "forces_jump", lambda layout: True)
    monkeypatch.setattr(fitted_model, "fit", lambda *given, **more: slower)
    monkeypatch.setattr(fitted_model, "settled", lambda *given: True)
    monkeypatch.setattr(fitted_model, "analyse", lambda fitted, sharply: asked.append((fitted, sharply)) or "judged")
    problem = SimpleNamespace(layout=None)
    given = SimpleNamespace(point=None, evidence=first.evidence), SimpleNamespace(white=False)
    assert fitted_model._with_more_care(problem, *given) == (slower, "judged")
    assert asked == [(slower, True)]


class Judged(Exception):
    """A verdict has been asked for: what comes after it is not looked at."""


@pytest.mark.parametrize(
    ("effects", "time_zero", "counted"), [(2, True, 2), (2, False, 2), (0, True, 1), (0, False, 0)]
)
def test_a_time_zero_counts_as_what_was_added_where_no_effect_was(monkeypatch, effects, time_zero, counted):
    """With two effects that are believed together it is none too many."""
    models = [model(9.0, k) for k in range(effects + 1)]
    for one in models:
        one.fit.problem.noise_is_inflated = False
    path = selection_path.SelectionPath(
        None, [step(m) for m in models[:-1]] or [step(models[0])], models[-1], None, (), 36
    )
    left, sure = SimpleNamespace(share_explained=lambda before: 0.5), SimpleNamespace(coefficient=2.0, std=1.0)
    made_up = {
        "band_of_steps": lambda steps: None, "left_by": lambda *given: left, "fit_stated": lambda *given: None,
        "sized_models": lambda steps, final: models,
        "free_run": lambda fit: SimpleNamespace(rms=1.0), "step_of": lambda *given: sure, "ranking_of": lambda step: (),
        "_drift_left_by": lambda *given: SimpleNamespace(constant=True), "time_zero_step": lambda *given: sure,
        "as_ranked": lambda moved: moved, "_explained_by_first_effect": lambda *given: 0.9,
        "needed_share": lambda added: 0.75, "_certain": lambda *given: True, "_is_loud": lambda *given: False,
    }  # fmt: skip
    for name, instead in made_up.items():
        monkeypatch.setattr(report, name, instead)
    asked = []

    def judged(evidence, tolerance):
        asked.append(evidence.added)
        raise Judged

    monkeypatch.setattr(report, "verdict_on", judged)
    zero = SimpleNamespace(as_stated=models[0]) if time_zero else None
    with pytest.raises(Judged):
        report._answer(SimpleNamespace(place_of=str), path, SimpleNamespace(stated=False), zero)
    assert asked == [counted]


@pytest.mark.parametrize(
    ("white", "mean_square", "found", "needed"),
    [
        (False, 1.2, 0, THRESHOLDS.gain),
        (False, 0.8, 0, THRESHOLDS.confounded),
        (False, 0.8, 1, THRESHOLDS.gain),
        (True, 1.0, 0, THRESHOLDS.confounded),
        (True, 1.0, 1, THRESHOLDS.gain_beyond_white),
    ],
)
def test_an_effect_has_to_gain_more_where_nothing_may_be_missing(white, mean_square, found, needed):
    residuals = SimpleNamespace(mean_square=mean_square)
    assert needed_gain(SimpleNamespace(white=white, residuals=residuals, found=("effect",) * found)) == needed
