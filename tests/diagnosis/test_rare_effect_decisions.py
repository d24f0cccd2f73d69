"""Which rare effects are asked and believed: the fits are made up."""

from types import SimpleNamespace

import numpy as np
import pytest
from helpers_made_up_steps import RARE

from crash_estimator.core.diagnosis.selection import rare_effects, selection_step
from crash_estimator.core.diagnosis.selection.candidate_fits import CandidateFit
from crash_estimator.core.diagnosis.selection.rare_effects import with_rare_ones
from crash_estimator.core.diagnosis.selection.selection_step import SelectionStep
from crash_estimator.core.effects import EFFECTS

IN_RARE_FORMS = {
    "rate_hardening",
    "viscous_damping",
    "quadratic_damping",
    "coulomb_friction",
    "unmodelled_body",
    "yielding",
}
RECORD = SimpleNamespace(below=np.inf, bins=1000, measured=np.zeros((1000, 1)))


def fitted(name: str, cost: float) -> CandidateFit:
    law = SimpleNamespace(acts_on="body" if name == "hung mass" else "element")
    addition = SimpleNamespace(key=(name, "spring"), target="spring", effect=law)
    return CandidateFit(addition, 1e6 - cost, SimpleNamespace(cost=cost))


def left(fit) -> SimpleNamespace:
    """Of 1000 samples: noise up to a mean square of 1.1."""
    return SimpleNamespace(white=fit.cost < 1.1e3, mean_square=fit.cost / 1e3)


@pytest.mark.parametrize(
    ("left_by_common", "left_by_rare", "asked", "leads"),
    [
        (1e4, 1e3, [False], "gas_cushion"),  # noise, as a common one does not leave
        (1e3, 900.0, [False], "gas_cushion"),  # both leave noise: they stand in one ranking
        (1e3, 1e3 + 50.0, [False], "friction"),
        (1e4, 9e3, [False, True], "friction"),  # less than the common one, but no noise: tried with care
        (1e4, 2e4, [False], "friction"),
        (1e4, 1.2e3, [False, True], "gas_cushion"),  # less than the noise again is left, of hundred times as much
        (1.9e3, 1.4e3, [False, True], "friction"),  # a common one comes as near
        (1.9e3, 1.2e3, [False, True], "gas_cushion"),  # or not quite: three quarters of what it leaves are explained
    ],
)
def test_a_rare_effect_comes_into_the_ranking_where_it_leaves_noise_or_next_to_nothing_else(
    monkeypatch, left_by_common, left_by_rare, asked, leads
):
    tried = []

    def begin(magnitudes, effects, model, least):
        assert set(effects) == RARE | IN_RARE_FORMS and least == left_by_common
        tried.append(False)
        return SimpleNamespace(ranking=lambda: [fitted("gas_cushion", cost=left_by_rare)])

    monkeypatch.setattr(rare_effects, "begin", begin)
    monkeypatch.setattr(rare_effects, "fit_harder", lambda search, model: tried.append(True))
    for module in (selection_step, rare_effects):
        monkeypatch.setattr(module, "analyse", left)
    fit = SimpleNamespace(cost=1e5)
    model = SimpleNamespace(white=False, fit=fit, residuals=left(fit), records=[RECORD])
    step = SelectionStep(model, [fitted("friction", cost=left_by_common)])
    magnitudes = SimpleNamespace(structure=SimpleNamespace(effects=()))
    found = with_rare_ones(magnitudes, EFFECTS, step)
    assert tried == asked and found.best.addition.key[0] == leads
    believed = leads == "gas_cushion" or left_by_rare < 1.1e3
    assert (found.candidates == step.candidates) != believed  # what is not believed is not told
    assert bool(found.doubted) == (not believed and left_by_rare < left_by_common), "but kept, where it leaves less"
    monkeypatch.setattr(rare_effects, "_leaves_noise_without", lambda *given: False)
    on_the_spring = [SimpleNamespace(target="spring")]  # what was found there leaves what the rare one would follow
    assert with_rare_ones(magnitudes, EFFECTS, step, on_the_spring) is step
    model.records[0] = SimpleNamespace(**vars(RECORD) | {"below": 240.0})  # in a band alone anything leaves noise
    assert with_rare_ones(magnitudes, EFFECTS, step) is step


CLOSE = [(1.66, 1.01, False), (1.66, 1.1, False), (1.66, 1.3, True), (2.1, 1.6, False), (1.02, 0.99, True)]


@pytest.mark.parametrize(("common", "rare", "near"), CLOSE)
def test_a_common_effect_comes_near_a_rare_one_unless_it_leaves_four_times_as_much(monkeypatch, common, rare, near):
    """In units of the noise: of a damper with a valve a usual one leaves 1.66, and its own form 1.01."""
    for module in (selection_step, rare_effects):
        monkeypatch.setattr(module, "analyse", left)
    model = SimpleNamespace(records=[RECORD], residuals=left(SimpleNamespace(cost=1e5)))
    steps = [SelectionStep(model, [fitted("an effect", cost=1e3 * leaves)]) for leaves in (common, rare)]
    assert rare_effects._comes_near(*steps) == near


@pytest.mark.parametrize(
    ("name", "leaves", "believed"), [("hung mass", 5e3, True), ("hung mass", 2e4, False), ("gas_cushion", 5e3, False)]
)
def test_practically_nothing_of_a_misfit_far_from_the_noise_is_enough_where_no_two_common_laws_add_up_to_it(
    monkeypatch, name, leaves, believed
):
    """Five times the noise of a thousand times: a cushion may be a damper with friction, a hung mass is no two laws."""
    for module in (selection_step, rare_effects):
        monkeypatch.setattr(module, "analyse", left)
    model = SimpleNamespace(records=[RECORD], residuals=left(SimpleNamespace(cost=1e6)))
    assert rare_effects._leaves_next_to_nothing(SelectionStep(model, [fitted(name, cost=leaves)])) == believed


@pytest.mark.parametrize(("gain", "asked"), [(11.0, False), (30.0, True)])
def test_where_noise_is_left_as_given_rare_ones_are_asked_only_where_a_common_one_stands_out(monkeypatch, gain, asked):
    tried = []
    nothing = SimpleNamespace(ranking=list)
    monkeypatch.setattr(rare_effects, "begin", lambda *given: tried.append(given) or nothing)
    for module in (selection_step, rare_effects):
        monkeypatch.setattr(module, "analyse", left)
    model = SimpleNamespace(white=True, fit=SimpleNamespace(cost=1e3), records=[SimpleNamespace(below=np.inf)])
    step = SelectionStep(model, [fitted("friction", cost=1e6 - gain)])
    found = with_rare_ones(SimpleNamespace(structure=SimpleNamespace(effects=())), EFFECTS, step)
    assert found.candidates == step.candidates and bool(tried) == asked


@pytest.mark.parametrize(
    ("target", "beside", "alone", "stays"),
    [("mount", False, False, True), ("spring", False, True, False), ("spring", True, False, False),
     ("spring", True, True, True)],
)  # fmt: skip
def test_beside_a_rare_effect_nothing_else_is_taken_on_the_same_element_but_what_stands_for_it(
    monkeypatch, target, beside, alone, stays
):
    """A cushion that was sealed was told with a cubic spring beside it; a spring behind a damper, whose first fit had
    gone astray, as a damper with hysteresis, though beside that damper it left only noise."""
    other = SimpleNamespace(target=target)
    problem = SimpleNamespace(narrowed=lambda *given: None)
    monkeypatch.setattr(rare_effects, "as_found", lambda one: one.addition)
    monkeypatch.setattr(rare_effects, "make_problem", lambda magnitudes, records, additions, roughness: problem)
    monkeypatch.setattr(rare_effects, "fit", lambda *given: "alone")
    monkeypatch.setattr(rare_effects, "analyse", lambda fit: SimpleNamespace(white=alone if fit == "alone" else beside))
    candidate = fitted("maxwell_element", 1.0)._replace(fit=SimpleNamespace(layout=None, point=None))
    step = SelectionStep(SimpleNamespace(additions=(other,), records=(), roughness={}), [candidate])
    assert bool(rare_effects.elsewhere_than(None, [other], step).candidates) == stays
