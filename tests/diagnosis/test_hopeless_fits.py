"""Fits that are given up once it is known that nothing comes of them, and what is fitted once only."""

from types import SimpleNamespace

import numpy as np
import pytest
from helpers_made_up_fits import candidate

from crash_estimator.core.diagnosis import THRESHOLDS
from crash_estimator.core.diagnosis.selection import assumptions, candidate_fits, contact_promise, fitted_model
from crash_estimator.core.diagnosis.selection.fitted_model import Model


@pytest.mark.parametrize(("target", "takes_away", "left", "at_the_floor", "asked"), [
    ("spring", 0.96, 1.0, True, True),
    ("spring", 0.94, 1.0, True, False),  # that far from what leaves only noise it is no rival
    ("spring", 0.2, 1.9, False, True),  # a fit gone astray may explain it
    ("spring", 0.2, 2.1, False, False),  # a motion that is itself off is no guide
    ("foam", 0.96, 1.0, True, False),
])  # fmt: skip
def test_other_laws_are_fitted_along_the_motion_that_the_best_one_has_found(
    monkeypatch, target, takes_away, left, at_the_floor, asked
):
    """In each form, from each of its starts, and no longer than it may come near."""
    best, rival = candidate(900.0), candidate(800.0, ("hysteresis", target))
    best.fit.cost, rival.fit.cost, best.fit.trajectories = 1000.0, 5000.0 - takes_away * 4000.0, "its motion"
    best.addition.target, rival.addition.target = "spring", target
    starts = [SimpleNamespace(key=rival.addition.key, shapes=at) for at in (0.05, 0.2)]
    fits, hopeless = [], 1000.0 + THRESHOLDS.hopeless
    monkeypatch.setattr(candidate_fits, "start_along", lambda problem, motion: (problem, motion))
    monkeypatch.setattr(candidate_fits, "fit", lambda *given, hopeless: (*given, hopeless))
    monkeypatch.setattr(candidate_fits, "cost_of_noise", lambda records: 1000.0 / left)
    given = SimpleNamespace(fit=SimpleNamespace(cost=5000.0), records=())
    search = candidate_fits._Search(None, given, [], least=1000.0)
    search.screened = [SimpleNamespace(addition=one) for one in starts]
    search.found = {one.addition.key: one for one in (best, rival)}
    search.reached_the_floor = lambda: at_the_floor
    search._untrusting = lambda addition: f"problem {starts.index(addition)}"
    search._note = lambda addition, fitted: fits.append((starts.index(addition), fitted))
    search.along()
    wanted = [(k, (f"problem {k}", (f"problem {k}", "its motion"), hopeless)) for k in (0, 1)]
    assert fits == (wanted if asked else [])
    search.found = {}
    search.along()  # where none was fitted, there is no motion


@pytest.mark.parametrize(("cost", "refined"), [(1500.0, True), (2500.0, False)])
def test_a_model_that_leaves_more_than_is_asked_for_is_not_refined(monkeypatch, cost, refined):
    """Its curves are not let fold: that it leaves too much is known."""
    made, given = [], []
    problem = SimpleNamespace(layout=SimpleNamespace(links=[SimpleNamespace(curve="curve", name="spring")]))
    problem.noise_is_inflated = True
    found = SimpleNamespace(cost=cost, theta=None, point=None)
    monkeypatch.setattr(fitted_model, "make_problem", lambda *given: made.append(len(given)) or problem)
    monkeypatch.setattr(fitted_model, "fit", lambda *args, hopeless=np.inf: given.append(hopeless) or found)
    monkeypatch.setattr(fitted_model, "cost_of_nothing", lambda records: 1e6)
    monkeypatch.setattr(fitted_model, "mean_square_of_nothing", lambda records: 1e6)
    monkeypatch.setattr(fitted_model, "adapted_roughness", lambda curve, theta: None)
    monkeypatch.setattr(fitted_model, "analyse", lambda fit, sharply: SimpleNamespace(mean_square=2.0))
    model = fitted_model.fit_model(None, (), (), hopeless=2000.0)
    assert isinstance(model, Model) and model.fit is found
    assert len(made) == (2 if refined else 1) and given[0] == 2000.0


def test_whether_doubts_leave_noise_is_asked_no_further_than_twice_the_noise(monkeypatch):
    """Of a model that leaves noise with them its fit is wanted, and made to the end."""
    asked = []
    given = SimpleNamespace(fit="given", additions=())
    final = SimpleNamespace(fit="final", additions=("one",))
    path = SimpleNamespace(steps=[SimpleNamespace(before=given)], final=final, noise=False)
    records = [SimpleNamespace(in_doubt=False, _replace=lambda **more: None)]
    magnitudes = SimpleNamespace(records=records, _replace=lambda records: None)
    monkeypatch.setattr(assumptions, "as_given", lambda *args: (magnitudes, given))
    monkeypatch.setattr(assumptions, "cost_of_noise", lambda records: 100.0)
    monkeypatch.setattr(assumptions, "search_is_over", lambda: False)
    monkeypatch.setattr(assumptions, "_with_curves_as_fine_as_needed", lambda *args: path)
    monkeypatch.setattr(assumptions, "_leaves_noise", lambda model: False)
    monkeypatch.setattr(assumptions, "_in_doubt", lambda doubted, model, hopeless=np.inf: asked.append(hopeless))
    assert assumptions._as_exact_as_needed(None, records, {}, lambda begun: False) is path
    assert asked == [100.0 * THRESHOLDS.near_floor] * 2, "of the model as given, and of the final one"


def test_what_is_likely_is_fitted_once_whatever_contacts_are_asked_of_it(monkeypatch):
    """The best first candidate's other form, under the contacts as they are, for the three others that are asked of."""
    fits, seen = [], []
    form = SimpleNamespace(key=("stop", "spring"), variant="in_curve")
    best = candidate(900.0, ("stop", "spring"))
    best.addition.variant = ""
    first = SimpleNamespace(as_recorded=[best], doubted=[], before=SimpleNamespace(additions=()), best=None)
    final = SimpleNamespace(white=False, fit=SimpleNamespace(evidence=0.0, cost=1000.0))
    path = assumptions.SelectionPath("stated", [first], final, final.fit, (), 36)
    monkeypatch.setattr(contact_promise, "measure_magnitudes", lambda *given: None)
    monkeypatch.setattr(contact_promise, "make_problem", lambda *given: None)
    monkeypatch.setattr(contact_promise, "_in_other_forms", lambda addition: [form])
    monkeypatch.setattr(contact_promise, "fit", lambda problem, hopeless: fits.append(hopeless))
    for name in ("never_pulling", "elastic_when_spent", "all_when_spent"):
        monkeypatch.setattr(assumptions, name, lambda structure, name=name: name)

    def promised_by(other, path, likely):
        seen.append([addition.variant for (addition,), _ in likely])
        return -np.inf

    monkeypatch.setattr(assumptions, "promised_by", promised_by)
    monkeypatch.setattr(assumptions, "search_is_over", lambda: False)
    monkeypatch.setattr(assumptions, "_as_exact_as_needed", lambda *given: path)
    assert assumptions._selected("stated", (), {}) is path
    assert seen == [["", "in_curve"]] * 3
    assert fits == [1000.0 + THRESHOLDS.hopeless], "and not to the end, far above what was found"
