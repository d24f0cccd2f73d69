"""Effects that are looked for second: where they are named, and where they are not even tried."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.diagnosis.selection import rare_effects, selection_step
from crash_estimator.core.diagnosis.selection.candidate_fits import CandidateFit
from crash_estimator.core.diagnosis.selection.rare_effects import common_effects, found_as_common, with_rare_ones
from crash_estimator.core.diagnosis.selection.selection_step import SelectionStep
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.effect import Addition
from crash_estimator.core.structure import EffectSpec
from crash_estimator.model_file import ModelFile
from crash_replay.synthetic.hidden.cases import draw_case

THAT_REMEMBER = {"maxwell_element", "gas_cushion"}
RARE = THAT_REMEMBER | {"guide_friction", "force_offset"}
IN_RARE_FORMS = {"rate_hardening", "quadratic_damping"}
SPEEDS = (0.75, 1.1)


def case(structure: str, *effects: str, seed: int = 3108):
    """The model without the effects, two recordings with them, and what was hidden."""
    drawn = draw_case(structure, effects, seed)
    recordings = [drawn.record(speed, 1.0)[0] for speed in SPEEDS]
    return ModelFile.model_validate(dict(drawn.specimen.model)).structure(), recordings, drawn.hidden


@pytest.mark.parametrize("effect", sorted(THAT_REMEMBER))
@pytest.mark.parametrize("structure", ["impactor", "dummy"])
def test_a_rare_effect_is_named_or_a_rival_that_cannot_be_told_from_it(structure, effect):
    """Also where a common one leaves noise too, as rate hardening does in place of the cushions."""
    model, recordings, (hidden,) = case(structure, effect)
    found = diagnose(model, recordings)
    assert (found.verdict, found.complete) == ("effect_missing", True), found.text
    leader = found.ranking[0]
    told = f"{leader.effect} on {leader.target}", *leader.confounded_with
    assert f"{effect} on {hidden.target}" in told, found.text
    (ours,) = (ranked for ranked in found.ranking if (ranked.effect, ranked.target) == (effect, hidden.target))
    assert abs(ours.coefficient - hidden.coefficient) < 4.0 * ours.std


@pytest.mark.parametrize(
    ("structure", "common", "rare"),
    [("impactor", "unmodelled_body", "gas_cushion"), ("single", "constant_force", "gas_cushion")],
)
def test_a_rare_effect_is_named_beside_a_common_one(structure, common, rare):
    model, recordings, hidden = case(structure, common, rare)
    found = diagnose(model, recordings)
    assert (found.verdict, found.complete) == ("effect_missing", True), found.text
    assert {(step.effect, step.target) for step in found.steps} == {(one.effect, one.target) for one in hidden}


@pytest.mark.parametrize("effect", ["viscous_damping", "cubic_stiffness"])
def test_a_common_effect_stays_named(effect):
    model, recordings, _ = case("impactor", effect)
    found = diagnose(model, recordings)
    assert [step.effect for step in found.steps] == [effect] and found.complete


def test_none_is_tried_where_nothing_is_missing():
    model, recordings, _ = case("impactor")
    found = diagnose(model, recordings)
    assert found.verdict == "adequate" and not RARE & {ranked.effect for ranked in found.ranking}


def fitted(name: str, cost: float) -> CandidateFit:
    addition = SimpleNamespace(key=(name, "spring"))
    return CandidateFit(addition, 1e5 - cost, SimpleNamespace(cost=cost))


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
        (1.9e3, 1.2e3, [False, True], "friction"),  # a common one comes as near
    ],
)
def test_a_rare_effect_comes_into_the_ranking_where_it_leaves_noise_or_next_to_nothing_else(
    monkeypatch, left_by_common, left_by_rare, asked, leads
):
    tried = []

    def fit_candidates(magnitudes, effects, model, thorough=False, least=np.inf):
        assert set(effects) == RARE | IN_RARE_FORMS and least == left_by_common
        tried.append(thorough)
        return [fitted("gas_cushion", cost=left_by_rare)]

    monkeypatch.setattr(rare_effects, "fit_candidates", fit_candidates)
    for module in (selection_step, rare_effects):
        monkeypatch.setattr(module, "analyse", left)
    fit = SimpleNamespace(cost=1e5)
    model = SimpleNamespace(white=False, fit=fit, residuals=left(fit), records=[SimpleNamespace(below=np.inf)])
    step = SelectionStep(model, [fitted("friction", cost=left_by_common)])
    magnitudes = SimpleNamespace(structure=SimpleNamespace(effects=()))
    found = with_rare_ones(magnitudes, EFFECTS, step)
    assert tried == asked and found.best.addition.key[0] == leads
    assert (found is step) == (leads == "friction" and left_by_rare >= 1.1e3)  # what is not believed is not told
    model.records[0].below = 240.0  # in a band alone anything leaves noise
    assert with_rare_ones(magnitudes, EFFECTS, step) is step


def test_what_the_model_has_is_common_in_all_its_forms():
    model, *_ = case("impactor", "viscous_damping")
    assert EFFECTS.keys() - common_effects(model, EFFECTS).keys() == RARE
    assert common_effects(model, EFFECTS)["rate_hardening"].variants == ("",)
    target = model.elements[0].name
    specs = EffectSpec("maxwell_element", target), EffectSpec("rate_hardening", target, variant="logarithmic")
    found = common_effects(replace(model, effects=specs), EFFECTS)
    assert EFFECTS.keys() - found.keys() == RARE - {"maxwell_element"}
    assert found["rate_hardening"].variants == ("", "logarithmic")


def test_what_was_found_in_the_whole_band_is_common_in_a_part_of_it():
    model, *_ = case("impactor", "viscous_damping")
    target = model.elements[0].name
    rate = EFFECTS["rate_hardening"]
    logarithmic = Addition(rate, target, variant="logarithmic")
    effects = found_as_common(EFFECTS, [logarithmic, Addition(EFFECTS["viscous_damping"], target)])
    assert common_effects(model, effects)["rate_hardening"].variants == ("logarithmic",)
    assert set(effects["rate_hardening"].variants) == set(rate.variants)
    cushion = Addition(EFFECTS["gas_cushion"], target, variant="isothermal")
    assert "gas_cushion" in common_effects(model, found_as_common(EFFECTS, [cushion]))
    assert "gas_cushion" not in common_effects(model, EFFECTS)
