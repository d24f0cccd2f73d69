"""A fit that has gone astray must not pass for what a model leaves; and what is told is what is applied."""

from functools import cache

import numpy as np
import pytest

from crash_estimator.core.diagnosis.assess import free_run
from crash_estimator.core.diagnosis.diagnosis import diagnose
from crash_estimator.core.diagnosis.helpful import helpful
from crash_estimator.core.diagnosis.model import fit_model
from crash_estimator.core.diagnosis.records import make_record
from crash_estimator.core.diagnosis.rounds import better, fitted_on, one_round
from crash_estimator.core.diagnosis.scales import make_scales
from crash_estimator.core.diagnosis.search import search
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
    """Records, scales and the model as given."""
    structure, recording = drawn(*case)
    records = [make_record(structure, recording)]
    scales = make_scales(structure, records, 36)
    return records, scales, fit_model(structure, records, scales, ())


@cache
def searched():
    """Rounds and the last model of a case that the vocabulary cannot explain."""
    records, scales, _ = fitted(*ROTATING_IMPACTOR)
    return search(records, scales, EFFECTS)


def test_what_a_model_leaves_as_given_is_what_its_own_simulation_leaves():
    """The fit's nuisances, offsets and noise of some hundredths of a g, are all that a free run lacks."""
    structure, recording = drawn("frontal", "coulomb_friction", 60003, 1.0)
    found = diagnose(structure, [recording])
    assert found.verdict == "effect_missing"
    assert found.free_run_rms.before == pytest.approx(found.residual_rms.before, rel=0.1)


def test_a_fit_is_no_better_than_the_motion_that_it_has_ended_in():
    """Evidence counts a motion's defect as mended: a motion that leaves more is no better one, whatever that says."""
    _, _, model = fitted(*ROTATING_IMPACTOR)
    claims = model.fit._replace(evidence=model.fit.evidence + 100.0)
    closer, further = (model.left._replace(cost=share * model.left.cost) for share in (0.9, 1.1))
    assert better(model._replace(fit=claims, left=closer), model)
    assert not better(model._replace(fit=claims, left=further), model)
    assert not better(model._replace(left=closer), model)


def test_in_a_larger_noise_a_fit_does_not_end_further_from_what_was_measured_than_one_that_starts_closer():
    """From the measured motion the fit of this door goes astray; from the fit in the sensors' noise it does not."""
    records, scales, model = fitted(*ROTATING_DOOR)
    before = one_round(records, scales, EFFECTS, model).before
    assert before.records[0].mix is not None
    assert not better(fitted_on(before, model.fit), before)
    assert before.left.rms < 1.1 * free_run(model.fit, records).rms


def test_the_structure_with_what_was_added_holds_the_coefficients_that_are_told():
    """Also where the noise was taken larger, and later steps have moved what the first one found."""
    structure, recording = drawn(*ROTATING_IMPACTOR)
    found = diagnose(structure, [recording])
    assert found.verdict == "unexplained" and len(found.steps) == 2
    applied = found.structure.effects[len(structure.effects) :]
    told = [(step.effect, step.target, step.coefficient, step.shape) for step in found.steps]
    assert [(e.type, e.target, e.coefficient, dict(e.shape)) for e in applied] == told


def test_steps_after_the_least_error_are_not_told():
    rounds, final = searched()
    assert not final.left.whiteness.white and len(final.additions) == 2
    models = [round_.before for round_ in rounds[:2]] + [final]
    assert models[0].left.rms > models[1].left.rms > models[2].left.rms
    assert helpful(rounds, final, 0) == (rounds, final)

    def with_errors(*errors):
        made = [model._replace(left=model.left._replace(rms=rms)) for model, rms in zip(models, errors)]
        again = [round_._replace(before=model) for round_, model in zip(rounds, made)]
        return [*again, *(round_._replace(before=made[2]) for round_ in rounds[2:])], made

    for errors, kept in (((3.0, 4.0, 3.5), 0), ((3.0, 2.0, 2.0), 1), ((3.0, 2.0, 1.0), 2), ((3.0, 4.0, 1.0), 2)):
        told, made = with_errors(*errors)
        cut, last = helpful(told, made[2], 0)
        assert last is made[kept]
        assert cut == (told if kept == 2 else told[: kept + 1])


def test_an_effect_that_is_found_to_be_nothing_is_not_told():
    rounds, final = searched()
    best, *others = rounds[1].tried
    place = next(p for p in best.fit.layout.places if p.addition.key == best.addition.key)
    theta = np.where(np.arange(len(best.fit.theta)) == place.coefficient, 0.0, best.fit.theta)
    nothing = best._replace(fit=best.fit._replace(theta=theta))
    told = [rounds[0], rounds[1]._replace(tried=[nothing, *others]), *rounds[2:]]
    cut, last = helpful(told, final, 0)
    assert last is told[1].before and cut == told[:2]
