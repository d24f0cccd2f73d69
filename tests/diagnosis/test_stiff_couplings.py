"""A stiff element between two bodies: the measured motion hardly tells how stiff it is, and the model file does."""

import pytest
import yaml

from crash_estimator.benchmarks.effects_judge import drawn as drawn_case
from crash_estimator.benchmarks.effects_plan import case_of as first_case
from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.diagnosis.observation.record import observe
from crash_estimator.core.diagnosis.output_error.gauss_newton import fit
from crash_estimator.core.diagnosis.output_error.problem import make_problem
from crash_estimator.core.diagnosis.parameterization.magnitudes import measure_magnitudes
from crash_estimator.core.diagnosis.selection.fitted_model import fit_given, fit_model
from crash_estimator.model_file import ModelFile
from crash_replay.second_generator.cases import case_of, drawn

CASE = "cab/nothing/1g/masses/61000016"
"""An engine on a mount of 0.6 MN/m, which is all that is stated of it; nothing is hidden."""


@pytest.fixture(scope="module")
def given():
    it = drawn(case_of(CASE))
    structure = ModelFile.model_validate(yaml.safe_load(it.model_text)).structure()
    records = [observe(structure, recording) for recording in it.recordings]
    return measure_magnitudes(structure, records), records


def test_a_model_whose_mount_was_found_too_soft_is_fitted_again_from_what_is_stated(given):
    usual, as_given = fit_model(*given, ()), fit_given(*given, ())
    (mount,) = usual.fit.layout.stated
    assert usual.residuals.mean_square > 10.0, "the usual fit arrives: this test shows nothing"
    assert usual.fit.theta[mount] < 0.5 * as_given.fit.theta[mount]
    assert as_given.residuals.mean_square < 1.3
    assert fit(usual.fit.problem.starting_as_stated()).cost < 1.01 * as_given.fit.cost


def test_a_candidate_starts_from_the_mount_that_was_found_without_it(given):
    magnitudes, records = given
    found = fit_given(magnitudes, records, ())
    problem = make_problem(magnitudes, records, (), found.roughness)
    (mount,) = problem.layout.stated
    from_there = problem.starting_as_found(found.fit.layout, found.fit.theta)
    assert from_there.layout.start[mount] == found.fit.theta[mount] and from_there.layout.trusted == (mount,)
    assert fit(from_there).cost == pytest.approx(found.fit.cost, rel=0.01)
    assert fit(problem).cost > 10.0 * found.fit.cost
    other = from_there.layout.start.copy()
    other[mount] *= 2.0
    assert from_there.starting_at(other).layout.trusted == (mount,)


YIELDS = "frontal/yielding/1/1g/10000Hz/0.75,1.1/17000960"
"""A mount that yields between a cab and an engine: without that the springs of both come out far from what they are."""


def test_a_mount_that_yields_is_told_as_such():
    _, structure, recordings = drawn_case(first_case(YIELDS))
    found = diagnose(structure, recordings)
    named = found.steps if found.verdict == "effect_missing" else ()
    assert [step.effect for step in named] == ["yielding"], found.text
