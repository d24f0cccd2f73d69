"""A fit that has gone astray must not pass for what a model leaves; and what is told is what is applied."""

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from crash_estimator.core.diagnosis.observation.record import observe
from crash_estimator.core.diagnosis.output_error.continuation import FROM_SIMULATION
from crash_estimator.core.diagnosis.parameterization.magnitudes import measure_magnitudes
from crash_estimator.core.diagnosis.report.diagnosis import diagnose
from crash_estimator.core.diagnosis.residuals.in_band import in_band
from crash_estimator.core.diagnosis.residuals.residuals import analyse, free_run
from crash_estimator.core.diagnosis.selection import pruning
from crash_estimator.core.diagnosis.selection.acceptance import better
from crash_estimator.core.diagnosis.selection.fitted_model import fit_model
from crash_estimator.core.diagnosis.selection.forward_selection import first_step, forward_selection
from crash_estimator.core.diagnosis.selection.pruning import up_to_the_least_error
from crash_estimator.core.diagnosis.selection.selection_step import (
    band_of_steps,
    in_recorded_noise,
    sized_models,
    weighed,
)
from crash_estimator.core.effects import EFFECTS
from crash_estimator.model_file import ModelFile
from crash_replay.synthetic.hidden.cases import draw_case

ROTATING_IMPACTOR = "impactor", "rotation", 70708, 2.0
ROTATING_DOOR = "side", "rotation", 70603, 2.0


def drawn(structure: str, effect: str, seed: int, noise: float):
    case = draw_case(structure, (effect,), seed)
    return ModelFile.model_validate(dict(case.specimen.model)).structure(), case.record(1.1, noise)[0]


@cache
def fitted(*case):
    """Magnitudes and the model as given."""
    structure, recording = drawn(*case)
    records = [observe(structure, recording)]
    magnitudes = measure_magnitudes(structure, records)
    return magnitudes, fit_model(magnitudes, records, ())


@cache
def searched():
    """Steps and the last model of a case that the vocabulary cannot explain."""
    magnitudes, given = fitted(*ROTATING_IMPACTOR)
    return forward_selection(magnitudes, EFFECTS, given, first_step(magnitudes, EFFECTS, given))


@pytest.mark.parametrize("from_on", [0, -50])
@pytest.mark.parametrize("without_bounds", [np.nan, np.inf])
def test_a_motion_without_bounds_leaves_much(without_bounds, from_on):
    """As no number it would be left out, and what is left of nothing is within any tolerance."""
    _, model = fitted(*ROTATING_DOOR)
    motion = model.fit.trajectories[0]
    x, v = motion.x.copy(), motion.v.copy()
    x[from_on:] = v[from_on:] = without_bounds
    left = analyse(model.fit._replace(trajectories=(motion._replace(x=x, v=v),)))
    assert np.isfinite(left.rms) and left.rms > 10.0 * model.residuals.rms
    assert left.mean_square > 100.0 * model.residuals.mean_square and not left.white


def test_what_a_model_leaves_as_given_is_what_its_own_simulation_leaves():
    """The fit's nuisances, offsets and noise of some hundredths of a g, are all that a free run lacks."""
    structure, recording = drawn("frontal", "coulomb_friction", 60003, 1.0)
    found = diagnose(structure, [recording])
    assert found.verdict == "effect_missing"
    assert found.free_run_rms.before == pytest.approx(found.residual_rms.before, rel=0.1)


def test_a_fit_is_no_better_than_the_motion_that_it_has_ended_in():
    """Evidence counts a motion's defect as mended: a motion that leaves more is no better one, whatever that says."""
    _, model = fitted(*ROTATING_IMPACTOR)
    claims = model.fit._replace(evidence=model.fit.evidence + 100.0)
    closer, further = (
        model.residuals._replace(mean_square=share * model.residuals.mean_square) for share in (0.9, 1.1)
    )
    assert better(model._replace(fit=claims, residuals=closer), model)
    assert not better(model._replace(fit=claims, residuals=further), model)
    assert not better(model._replace(residuals=closer), model)


def test_in_a_larger_noise_a_fit_does_not_end_further_from_what_was_measured_than_one_that_starts_closer():
    """From the measured motion the fit of this door goes astray; from the fit in the sensors' noise it does not. It
    leaves a fifth more, over all outputs alike, than that: in the larger noise they count otherwise."""
    magnitudes, model = fitted(*ROTATING_DOOR)
    before = weighed(magnitudes, EFFECTS, in_recorded_noise(magnitudes, EFFECTS, model)).before
    assert before.fit.problem.noise_is_inflated
    start = before.fit.problem.narrowed(model.fit.layout, model.fit.point)
    assert not better(before.refitted(start, FROM_SIMULATION), before)
    assert before.residuals.rms < 1.25 * free_run(model.fit).rms


def test_the_structure_with_what_was_added_holds_the_coefficients_that_are_told():
    """Also where the noise was taken larger, and later steps have moved what the first one found."""
    structure, recording = drawn(*ROTATING_IMPACTOR)
    found = diagnose(structure, [recording])
    assert found.verdict == "unexplained" and len(found.steps) == 2
    applied = found.structure.effects[len(structure.effects) :]
    told = [(step.effect, step.target, step.coefficient, step.shape) for step in found.steps]
    assert [(e.type, e.target, e.coefficient, dict(e.shape)) for e in applied] == told


def test_steps_after_the_least_error_are_not_told(monkeypatch):
    path, final = searched()
    assert not final.white and len(final.additions) == 2
    sizes = [in_band(one.fit, one.residuals, band_of_steps(path)).rms for one in sized_models(path, final)]
    assert sizes[0] > sizes[1] > sizes[2]
    assert up_to_the_least_error(path, final) == (path, final)
    for errors, kept in (((3.0, 4.0, 3.5), 0), ((3.0, 2.0, 2.0), 1), ((3.0, 2.0, 1.0), 2), ((3.0, 4.0, 1.0), 2)):
        told = iter(errors)
        monkeypatch.setattr(pruning, "in_band", lambda fit, residuals, cfc, told=told: SimpleNamespace(rms=next(told)))
        cut, last = up_to_the_least_error(path, final)
        assert last is [path[0].before, path[1].before, final][kept]
        assert cut == (path if kept == 2 else path[: kept + 1])


def test_an_effect_that_is_found_to_be_nothing_is_not_told():
    path, final = searched()
    best, *others = path[1].candidates
    term = best.fit.layout.term(best.addition)
    theta = np.where(np.arange(len(best.fit.theta)) == term.coefficient, 0.0, best.fit.theta)
    nothing = best._replace(fit=best.fit._replace(theta=theta))
    told = [path[0], path[1]._replace(candidates=[nothing, *others]), *path[2:]]
    cut, last = up_to_the_least_error(told, final)
    assert last is told[1].before and cut == told[:2]
