"""Effects that are looked for second: where they are named, and where they are not even tried."""

from dataclasses import replace

import pytest

from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.diagnosis.selection.rare_effects import common_effects
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.structure import EffectSpec
from crash_estimator.model_file import ModelFile
from crash_replay.synthetic.hidden.cases import draw_case

RARE = {"maxwell_element", "gas_cushion"}
SPEEDS = (0.75, 1.1)


def case(structure: str, *effects: str, seed: int = 3108):
    """The model without the effects, two recordings with them, and what was hidden."""
    drawn = draw_case(structure, effects, seed)
    recordings = [drawn.record(speed, 1.0)[0] for speed in SPEEDS]
    return ModelFile.model_validate(dict(drawn.specimen.model)).structure(), recordings, drawn.hidden


@pytest.mark.parametrize("effect", sorted(RARE))
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


@pytest.mark.parametrize("effect", ["viscous_damping", "cubic_stiffness"])
def test_a_common_effect_stays_named(effect):
    model, recordings, _ = case("impactor", effect)
    found = diagnose(model, recordings)
    assert [step.effect for step in found.steps] == [effect] and found.complete


def test_none_is_tried_where_nothing_is_missing():
    model, recordings, _ = case("impactor")
    found = diagnose(model, recordings)
    assert found.verdict == "adequate" and not RARE & {ranked.effect for ranked in found.ranking}


def test_what_the_model_has_is_common_in_all_its_forms():
    model, *_ = case("impactor", "viscous_damping")
    assert EFFECTS.keys() - common_effects(model, EFFECTS).keys() == RARE
    assert common_effects(model, EFFECTS)["rate_hardening"].variants == ("",)
    target = model.elements[0].name
    specs = EffectSpec("maxwell_element", target), EffectSpec("rate_hardening", target, variant="logarithmic")
    found = common_effects(replace(model, effects=specs), EFFECTS)
    assert EFFECTS.keys() - found.keys() == {"gas_cushion"}
    assert found["rate_hardening"].variants == ("", "logarithmic")
