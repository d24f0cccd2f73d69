"""Contacts whose damper does not pull either: taken the wrong way, they would look like an effect that is missing."""

import copy
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import yaml

from crash_estimator.cli.work.diagnose import apply
from crash_estimator.core.diagnosis.observation.record import observe
from crash_estimator.core.diagnosis.parameterization.magnitudes import measure_magnitudes
from crash_estimator.core.diagnosis.report.diagnosis import diagnose
from crash_estimator.core.diagnosis.selection.contacts import never_pulling
from crash_estimator.core.diagnosis.selection.fitted_model import fit_model
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.fold import run
from crash_estimator.core.methods import make_estimator
from crash_estimator.model_file import ModelFile, load_model
from crash_replay.second_generator import cases as second_generator
from crash_replay.synthetic.hidden.cases import draw_case
from crash_replay.synthetic.hidden.laws import Carrier

DAMPING = 8000.0
"""N s/m: while the car leaves the barrier at some m/s, more than its spring still pushes."""


DURATION = 0.16
"""s: long enough to see it leave."""


class NeverPulls(Carrier):
    """A contact proper: whatever its spring and damper add up to, it only pushes."""

    def __call__(self, crush, rate, peak):
        return max(super().__call__(crush, rate, peak), 0.0)


@cache
def case(law: type[Carrier], effects=(), seed: int = 60304):
    """Structure and recordings of a car on a barrier, between them a strong damper that the model knows."""
    drawn = draw_case("single", effects, seed)
    model = copy.deepcopy(dict(drawn.specimen.model))
    model["elements"]["car_barrier"]["damping"] = DAMPING
    elements = [
        replace(e, spring=law(**(vars(e.spring) | {"damping": DAMPING}))) if e.name == "car_barrier" else e
        for e in drawn.specimen.scenario.system.elements
    ]
    specimen = drawn.specimen.with_parts(elements=elements)
    changed = replace(drawn, specimen=replace(specimen, scenario=replace(specimen.scenario, duration=DURATION)))
    structure = ModelFile.model_validate(model).structure()
    return structure, [changed.record(speed, 0.5)[0] for speed in (0.75, 1.1)], drawn.hidden


@cache
def diagnosed(law: type[Carrier]):
    """Of a model that lacks nothing."""
    structure, recordings, _ = case(law)
    return diagnose(structure, recordings)


@pytest.mark.parametrize("law, said", [(Carrier, False), (NeverPulls, True)])
def test_a_right_model_is_adequate_either_way(law, said):
    found = diagnosed(law)
    assert found.verdict == "adequate" and ("never pull" in found.text) == said


@pytest.mark.parametrize("law", [Carrier, NeverPulls])
def test_what_is_missing_is_found_alone_either_way(law):
    structure, recordings, (hidden,) = case(law, ("constant_force",), 60300)
    found = diagnose(structure, recordings)
    (step,) = found.steps
    assert found.verdict == "effect_missing" and (step.effect, step.target) == (hidden.effect, hidden.target)
    assert abs(step.coefficient - hidden.coefficient) < 3.0 * step.std


def test_a_rare_form_is_named_under_a_contact_that_the_model_states_otherwise():
    """A damper that grows with the crush, of a contact that never pulls: with one that may, it leaves three times the
    noise, and what leaves less than the common candidates was not asked under other contacts."""
    case = second_generator.drawn(second_generator.case_of("wall/damper.deepening/1g/clean/36000038"))
    structure = ModelFile.model_validate(yaml.safe_load(case.model_text)).structure()
    found = diagnose(structure, case.recordings)
    (step,) = found.steps
    assert (found.verdict, step.effect, step.target) == ("effect_missing", "viscous_damping", "car_barrier")
    assert step.form == "hunt_crossley" and "never pull" in found.text


def test_the_two_ways_differ_by_far_more_than_noise():
    structure, recordings, _ = case(NeverPulls)
    records = [observe(structure, recording) for recording in recordings]
    pulling, pushing = (
        fit_model(measure_magnitudes(assumed, records), records, ())
        for assumed in (structure, never_pulling(structure))
    )
    assert pushing.residuals.band_test.white and pushing.fit.evidence > pulling.fit.evidence + 100.0


def test_what_was_found_can_be_written_and_read_and_is_then_right_as_given(tmp_path):
    """`--apply` writes `damper_pulls: false`; with it the model is adequate as it stands, and says no more of it."""
    structure, recordings, _ = case(NeverPulls)
    found = diagnosed(NeverPulls)
    assert not found.structure.elements[0].damper_pulls
    drawn = draw_case("single", (), 60304)
    model, applied = tmp_path / "given.yaml", tmp_path / "applied.yaml"
    text = yaml.safe_load(drawn.model_text)
    text["elements"]["car_barrier"]["damping"] = DAMPING
    model.write_text(yaml.safe_dump(text))
    apply(found, structure.effects, EFFECTS, str(model), str(applied))
    written = load_model(applied, EFFECTS)
    assert not written.elements[0].damper_pulls
    again = diagnose(written, recordings)
    assert again.verdict == "adequate" and "never pull" not in again.text


def test_an_estimator_lets_go_where_the_damper_would_pull():
    structure, recordings, _ = case(NeverPulls)
    for model, pulls in ((structure, True), (never_pulling(structure), False)):
        estimator = make_estimator(model, recordings[1].test, "constrained_kalman")
        force = np.array([estimate.force[0] for estimate in run(estimator, recordings[1].samples())])
        assert (force.min() < -0.01 * force.max()) == pulls


def test_a_damper_that_never_pulls_is_of_an_element_that_carries_compression_only():
    drawn = draw_case("single", (), 60304)
    text = yaml.safe_load(drawn.model_text)
    text["elements"]["car_barrier"] |= {"tension": "both", "damper_pulls": False}
    with pytest.raises(ValueError, match="goes with `tension: none`"):
        ModelFile.model_validate(text)
