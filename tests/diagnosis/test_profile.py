"""Laws found over their constant, where a jump at separation stops every other fit; and a mass as it was weighed."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from crash_estimator.core.diagnosis.observation.record import observe
from crash_estimator.core.diagnosis.output_error import profile_likelihood
from crash_estimator.core.diagnosis.output_error.gauss_newton import fit
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


@pytest.mark.parametrize("least", [0.0, 2.2, 3.8])
def test_the_look_at_a_profile_goes_on_beyond_the_largest_start_as_long_as_the_cost_falls(monkeypatch, least):
    """The cost is a V over the logarithm, its point at or beyond that of the one start."""
    layout = SimpleNamespace(
        start=np.ones(1),
        prior=SimpleNamespace(low=np.full(1, 0.1)),
        term=lambda addition: SimpleNamespace(coefficient=0),
    )
    problem = SimpleNamespace(layout=layout, starting_at=lambda start: start)
    monkeypatch.setattr(
        profile_likelihood, "fit", lambda start, **more: SimpleNamespace(cost=abs(np.log(start[0]) - least))
    )
    found = profile(problem, None, [1.0])
    assert abs(found.at - least) <= STEP / 2.0
    assert found.fit.cost == pytest.approx(abs(found.at - least))


@pytest.mark.parametrize(("leads", "on", "looked_at"), [
    ("hysteresis", "front", True),
    ("hysteresis", "rear", False),
    ("rate_hardening", "front", False),
])  # fmt: skip
def test_a_profile_is_looked_at_where_a_force_that_remembers_leads_on_the_same_element(
    monkeypatch, leads, on, looked_at
):
    """What unloads on a slope of its own is followed by such a force first; elsewhere the look takes 240 iterations."""
    asked = []

    def look(problem, addition, starts):
        asked.append(starts)
        return SimpleNamespace(fit=SimpleNamespace(cost=1e3), addition=addition)

    slope = Addition(EFFECTS["plastic_unloading"], "front", coefficient=1e6)
    screened = [SimpleNamespace(addition=slope, gain=1.0)]
    model = SimpleNamespace(fit=SimpleNamespace(cost=1e3), white=False)
    search = candidate_fits._Search(None, model, screened)
    best = Addition(EFFECTS[leads], on)
    search.found[best.key] = candidate_fits.CandidateFit(best, 100.0, SimpleNamespace(cost=500.0))
    search.least = 500.0
    monkeypatch.setattr(candidate_fits._Search, "_problem", lambda self, addition: None)
    monkeypatch.setattr(candidate_fits, "profile", look)
    search.profile()
    assert asked == ([[1e6]] if looked_at else [])


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
