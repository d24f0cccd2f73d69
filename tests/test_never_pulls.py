"""Contacts whose damper does not pull either: taken the wrong way, they would look like an effect that is missing."""

import copy
from dataclasses import replace

import pytest

from crash_estimator.core.diagnosis.diagnosis import diagnose
from crash_estimator.core.diagnosis.model import fit_model
from crash_estimator.core.diagnosis.records import make_record
from crash_estimator.core.diagnosis.scales import make_scales
from crash_estimator.model_file import ModelFile
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


@pytest.mark.parametrize("law, said", [(Carrier, False), (NeverPulls, True)])
def test_a_right_model_is_adequate_either_way(law, said):
    structure, recordings, _ = case(law)
    found = diagnose(structure, recordings)
    assert found.verdict == "adequate" and ("never pull" in found.text) == said


@pytest.mark.parametrize("law", [Carrier, NeverPulls])
def test_what_is_missing_is_found_alone_either_way(law):
    structure, recordings, (hidden,) = case(law, ("constant_force",), 60300)
    found = diagnose(structure, recordings)
    (step,) = found.steps
    assert found.verdict == "effect_missing" and (step.effect, step.target) == (hidden.effect, hidden.target)
    assert abs(step.coefficient - hidden.coefficient) < 3.0 * step.std


def test_the_two_ways_differ_by_far_more_than_noise():
    structure, recordings, _ = case(NeverPulls)
    records = [make_record(structure, recording) for recording in recordings]
    pulling, pushing = (
        fit_model(structure, records, make_scales(structure, records, 36, pulls=pulls), ()) for pulls in (True, False)
    )
    assert pushing.left.whiteness.white and pushing.fit.evidence > pulling.fit.evidence + 100.0
