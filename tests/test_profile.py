"""Laws found over their constant, where a jump at separation stops every other fit; and a mass as it was weighed."""

from dataclasses import replace

import pytest

from crash_estimator.core.diagnosis.candidates import candidates
from crash_estimator.core.diagnosis.diagnosis import diagnose
from crash_estimator.core.diagnosis.fit import fit
from crash_estimator.core.diagnosis.layout import make_layout
from crash_estimator.core.diagnosis.model import fit_model
from crash_estimator.core.diagnosis.prior_odds import WEIGHED, against_a_mass
from crash_estimator.core.diagnosis.profile import closer, profile
from crash_estimator.core.diagnosis.records import make_record
from crash_estimator.core.diagnosis.scales import make_scales
from crash_estimator.core.effects import EFFECTS
from crash_estimator.model_file import ModelFile
from crash_replay.synthetic.hidden.cases import draw_case

CELLS = 36


def drawn(structure: str, seed: int, noise: float):
    """-> what is hidden: a slope on which an element unloads; the model without it; two recordings."""
    case = draw_case(structure, ("plastic_unloading",), seed)
    model = ModelFile.model_validate(dict(case.specimen.model)).structure()
    return case.hidden[0], model, [case.record(speed, noise)[0] for speed in (0.75, 1.1)]


@pytest.mark.parametrize(("seed", "noise"), [(420018, 0.5), (420001, 2.0)])
def test_where_a_jump_stops_every_other_fit_the_profile_arrives(seed, noise):
    """Side impacts whose barrier lets go of the door while its damper still pulls: the noise floor, and the slope."""
    hidden, structure, recordings = drawn("side", seed, noise)
    records = [make_record(structure, recording) for recording in recordings]
    scales = make_scales(structure, records, CELLS)
    base = fit_model(structure, records, scales, ())
    offered = [a for a in candidates(structure, scales, EFFECTS) if a.key == (hidden.effect, hidden.target)]
    layout = make_layout(structure, records, scales, [offered[0]], base.roughness)
    samples = sum(record.bins * record.measured.shape[1] for record in records)
    usual = [fit(make_layout(structure, records, scales, [one], base.roughness), records).cost for one in offered]
    assert min(usual) > 1.2 * samples, "the usual fit arrives: this test shows nothing"
    found = closer(profile(layout, records, offered[0], [one.coefficient for one in offered]), records)
    assert found.cost < 1.05 * samples
    (place,) = found.layout.places
    assert found.theta[place.coefficient] == pytest.approx(hidden.coefficient, rel=0.02)


def test_a_mass_stands_as_it_was_weighed_where_a_law_does_as_well():
    """One body, its motion alone measured: with a slope known for its pad, a body half as heavy again does as well."""
    hidden, structure, recordings = drawn("impactor", 420012, 0.5)
    first, second, *_ = diagnose(structure, recordings).ranking
    assert (first.effect, first.target) == (hidden.effect, hidden.target)
    assert (second.effect, second.target) == ("added_mass", "impactor")
    assert first.confounded_with == ("added_mass on impactor",)


def test_a_mass_is_believed_like_any_effect_where_a_force_or_another_body_is_measured():
    hidden, structure, recordings = drawn("impactor", 420012, 0.5)
    records = [make_record(structure, recording) for recording in recordings]
    scales = make_scales(structure, records, CELLS)
    offered = {a.effect.name: a for a in candidates(structure, scales, EFFECTS)}
    assert against_a_mass(structure, offered["added_mass"]) == WEIGHED
    assert against_a_mass(structure, offered["plastic_unloading"]) == 0.0
    impactor, face = structure.bodies
    measured = replace(structure, bodies=(impactor, replace(face, force="face_fx")))
    assert against_a_mass(measured, offered["added_mass"]) == 0.0
    two = replace(structure, bodies=(impactor, replace(impactor, name="other", acceleration=("other_ax",)), face))
    assert against_a_mass(two, offered["added_mass"]) == 0.0
