"""Laws found over their constant, where a jump at separation stops every other fit; and a mass as it was weighed."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from crash_estimator.core.diagnosis.observation.record import observe
from crash_estimator.core.diagnosis.output_error import profile_likelihood
from crash_estimator.core.diagnosis.output_error.continuation import FROM_MEASURED_MOTION, SMALL_STEPS
from crash_estimator.core.diagnosis.output_error.gauss_newton import fit, iterations_made
from crash_estimator.core.diagnosis.output_error.problem import make_problem
from crash_estimator.core.diagnosis.output_error.profile_likelihood import STEP, closer, profile
from crash_estimator.core.diagnosis.parameterization.magnitudes import measure_magnitudes
from crash_estimator.core.diagnosis.report.diagnosis import diagnose
from crash_estimator.core.diagnosis.selection import candidate_fits
from crash_estimator.core.diagnosis.selection.candidates import candidates
from crash_estimator.core.diagnosis.selection.fitted_model import fit_model
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.effect import Addition
from crash_estimator.core.effects.kinds.body_inertia import LEFT_OUT, WEIGHED
from crash_estimator.model_file import ModelFile
from crash_replay.synthetic.hidden.cases import draw_case


def drawn(structure: str, seed: int, noise: float):
    """-> what is hidden: a slope on which an element unloads; the model without it; two recordings."""
    case = draw_case(structure, ("plastic_unloading",), seed)
    model = ModelFile.model_validate(dict(case.specimen.model)).structure()
    return case.hidden[0], model, [case.record(speed, noise)[0] for speed in (0.75, 1.1)]


@pytest.mark.parametrize("least", [-3.0, -1.2, 0.0, 2.2, 3.8])
def test_the_look_at_a_profile_goes_on_from_its_start_as_long_as_the_cost_falls(monkeypatch, least):
    """The cost is a V over the logarithm, its point at the start, beyond it on either side, or below the limit."""
    lowest = np.log(0.1)
    layout = SimpleNamespace(
        start=np.ones(1),
        prior=SimpleNamespace(low=np.full(1, 0.1)),
        term=lambda addition: SimpleNamespace(coefficient=0),
    )
    problem = SimpleNamespace(layout=layout, starting_at=lambda start: start)
    tried = []

    def cost(start, *_, **more):
        tried.append(np.log(start[0]))
        return SimpleNamespace(cost=abs(tried[-1] - least))

    monkeypatch.setattr(profile_likelihood, "fit", cost)
    found = profile(problem, None, [1.0])
    assert abs(found.at - max(least, lowest)) <= STEP / 2.0
    assert found.fit.cost == pytest.approx(abs(found.at - least))
    assert min(tried) >= lowest and len(tried) == len(set(tried))


@pytest.mark.parametrize(("leads", "on", "looked_at", "schedule"), [
    ("hysteresis", "front", ["front"], SMALL_STEPS),  # as it follows what unloads on a slope of its own
    ("rate_hardening", "front", ["front"], FROM_MEASURED_MOTION),
    ("hysteresis", "belt", ["rear", "front"], FROM_MEASURED_MOTION),  # of which no slope is offered: the likeliest
])  # fmt: skip
def test_a_profile_is_looked_at_on_the_target_of_what_leads_with_care_where_that_remembers(
    monkeypatch, leads, on, looked_at, schedule
):
    asked = []
    monkeypatch.setattr(candidate_fits, "profile", lambda *given, **more: asked.append(given) or look_of(1e3, given[1]))
    search = search_with(leads, on)
    search.profile()
    assert [addition.target for addition in search.fitted] == looked_at, "as any other, before"
    assert [(addition.target, starts, how) for _, addition, starts, how in asked] == [
        (target, [1e6], schedule) for target in looked_at
    ]


@pytest.mark.parametrize("after", [0, 1, 2])
def test_no_profile_is_looked_at_once_noise_is_left(monkeypatch, after):
    """By the fit of the first slope as any other; by its profile; by the fit of the second."""
    asked, answers = [], iter([k >= after for k in range(4)])
    monkeypatch.setattr(candidate_fits, "profile", lambda *given, **more: asked.append(given) or look_of(1e3, given[1]))
    search = search_with("added_mass", "mdb")
    search.reached_the_floor = lambda: next(answers)
    search.profile()
    assert (len(search.fitted), len(asked)) == {0: (1, 0), 1: (1, 1), 2: (2, 1)}[after]


@pytest.mark.parametrize(("cost", "looked_closer_at"), [(530.0, False), (520.0, True), (20.0, True)])
def test_a_profile_is_looked_closer_at_where_it_takes_away_about_as_much_as_what_leads(
    monkeypatch, cost, looked_closer_at
):
    """The model leaves 1000 and what leads 500: of the 500 that are taken away 0.95 are 475."""
    closer_at = []
    monkeypatch.setattr(candidate_fits, "profile", lambda _, addition, *given, **more: look_of(cost, addition))
    monkeypatch.setattr(candidate_fits, "closer", closer_at.append)
    monkeypatch.setattr(candidate_fits._Search, "_note", lambda *given: None)
    search_with("hysteresis", "front").profile()
    assert bool(closer_at) == looked_closer_at


def look_of(cost: float, addition: Addition) -> SimpleNamespace:
    return SimpleNamespace(fit=SimpleNamespace(cost=cost), addition=addition)


def search_with(leads: str, on: str) -> candidate_fits._Search:
    """A model that leaves 1000, an effect that leads with 500, and slopes offered on two elements."""
    slopes = [Addition(EFFECTS["plastic_unloading"], target, coefficient=1e6) for target in ("rear", "front")]
    screened = [SimpleNamespace(addition=slope, gain=gain) for slope, gain in zip(slopes, (2.0, 1.0), strict=True)]
    search = candidate_fits._Search(None, SimpleNamespace(fit=SimpleNamespace(cost=1e3), white=False), screened)
    best = Addition(EFFECTS[leads], on)
    search.found[best.key] = candidate_fits.CandidateFit(best, 100.0, SimpleNamespace(cost=500.0))
    search.least = 500.0
    search._problem = lambda addition: None
    search.fitted = []
    search._fit = search.fitted.append
    search.reached_the_floor = lambda: False
    return search


@pytest.mark.parametrize(("seed", "noise"), [(420018, 0.5), (420001, 2.0)])
def test_where_a_jump_stops_every_other_fit_the_profile_arrives(seed, noise):
    """Side impacts whose barrier lets go of the door while its damper still pulls: the noise floor, and the slope."""
    hidden, structure, recordings = drawn("side", seed, noise)
    records = [observe(structure, recording) for recording in recordings]
    magnitudes = measure_magnitudes(structure, records)
    base = fit_model(magnitudes, records, ())
    offered = [a for a in candidates(magnitudes, EFFECTS) if a.key == (hidden.effect, hidden.target)]
    problem = make_problem(magnitudes, records, [offered[0]], base.roughness)
    samples = sum(record.bins * record.measured.shape[1] for record in records)
    usual = [fit(make_problem(magnitudes, records, [one], base.roughness)).cost for one in offered]
    assert min(usual) > 1.2 * samples, "the usual fit arrives: this test shows nothing"
    found = closer(profile(problem, offered[0], [one.coefficient for one in offered]))
    assert found.cost < 1.05 * samples
    (term,) = found.layout.terms
    assert found.theta[term.coefficient] == pytest.approx(hidden.coefficient, rel=0.02)


def test_a_mass_stands_as_it_was_weighed_where_a_law_does_as_well():
    """One body, its motion alone measured: with a slope known for its pad, a body half as heavy again does as well, and
    so does a pad that yields."""
    hidden, structure, recordings = drawn("impactor", 420012, 0.5)
    first, *rivals = diagnose(structure, recordings).ranking
    assert (first.effect, first.target) == (hidden.effect, hidden.target)
    as_good = {"added_mass on impactor", "yielding on padding"}  # a quarter of a nat apart
    assert {one.name for one in rivals[:2]} == set(first.confounded_with) == as_good


def test_a_mass_is_believed_like_any_effect_where_a_force_or_another_body_is_measured():
    hidden, structure, recordings = drawn("impactor", 420012, 0.5)
    records = [observe(structure, recording) for recording in recordings]
    magnitudes = measure_magnitudes(structure, records)
    offered = {a.effect.name: a for a in candidates(magnitudes, EFFECTS)}
    assert offered["added_mass"].effect.log_prior_odds_against(structure, 1.0) == WEIGHED
    assert offered["plastic_unloading"].effect.log_prior_odds_against(structure, 1.0) == 0.0
    impactor, face = structure.bodies
    measured = replace(structure, bodies=(impactor, replace(face, force="face_fx")))
    assert offered["added_mass"].effect.log_prior_odds_against(measured, 1.0) == 0.0
    two = replace(structure, bodies=(impactor, replace(impactor, name="other", acceleration=("other_ax",)), face))
    assert offered["added_mass"].effect.log_prior_odds_against(two, 1.0) == 0.0
    assert offered["added_mass"].effect.log_prior_odds_against(two, -1.0) == LEFT_OUT


@pytest.mark.parametrize(("seed", "noise", "most"), [(420001, 2.0, 1000), (430003, 0.5, 1000)])
def test_a_jump_is_found_by_its_profile_whatever_leads(seed, noise, most):
    """An added mass leads, and explains little; and hysteresis, while of another element a slope is likelier. Without
    the look the first is unexplained after 2500 iterations, the second told two other effects after 4000."""
    hidden, structure, recordings = drawn("side", seed, noise)
    before = iterations_made()
    told = diagnose(structure, recordings)
    (step,) = told.steps
    assert (told.verdict, told.complete) == ("effect_missing", True)
    assert (step.effect, step.target) == (hidden.effect, hidden.target)
    assert step.coefficient == pytest.approx(hidden.coefficient, rel=0.01)
    assert iterations_made() - before < most
