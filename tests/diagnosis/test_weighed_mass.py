"""A mass stands as it was weighed, unless a force or another body is measured."""

from dataclasses import replace

from crash_estimator.core.diagnosis.observation.record import observe
from crash_estimator.core.diagnosis.parameterization.magnitudes import measure_magnitudes
from crash_estimator.core.diagnosis.report.diagnosis import diagnose
from crash_estimator.core.diagnosis.selection.candidates import candidates
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.kinds.body_inertia import LEFT_OUT, WEIGHED
from crash_estimator.model_file import ModelFile
from crash_replay.synthetic.hidden.cases import draw_case


def drawn(structure: str, seed: int, noise: float):
    """-> what is hidden: a slope on which an element unloads; the model without it; two recordings."""
    case = draw_case(structure, ("plastic_unloading",), seed)
    model = ModelFile.model_validate(dict(case.specimen.model)).structure()
    return case.hidden[0], model, [case.record(speed, noise)[0] for speed in (0.75, 1.1)]


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
