"""Effects that are looked for second: where they are named, and where they are not even tried."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from helpers_made_up_steps import RARE
from scipy.integrate import solve_ivp

from crash_estimator.benchmarks.effects_judge import drawn as drawn_case
from crash_estimator.benchmarks.effects_plan import case_of
from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.diagnosis.selection import pair_search
from crash_estimator.core.diagnosis.selection.candidate_fits import CandidateFit
from crash_estimator.core.diagnosis.selection.rare_effects import (
    common_effects,
    found_as_common,
    is_rare,
)
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.effect import Addition
from crash_estimator.core.structure import EffectSpec
from crash_estimator.model_file import ModelFile
from crash_replay.recording import Channel, Recording, Test
from crash_replay.synthetic.hidden.cases import draw_case

SPEEDS = (0.75, 1.1)


def case(structure: str, *effects: str, seed: int = 3108):
    """The model without the effects, two recordings with them, and what was hidden."""
    drawn = draw_case(structure, effects, seed)
    recordings = [drawn.record(speed, 1.0)[0] for speed in SPEEDS]
    return ModelFile.model_validate(dict(drawn.specimen.model)).structure(), recordings, drawn.hidden


@pytest.mark.parametrize(("structure", "effect"), [("impactor", "gas_cushion"), ("dummy", "maxwell_element")])
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


def test_a_spring_that_relaxes_within_two_milliseconds_is_no_damper():
    """Its time was not looked for below 3 ms: a damper with a gap was told."""
    drawn = draw_case("impactor", ("maxwell_element",), 3218)
    found = diagnose(
        ModelFile.model_validate(dict(drawn.specimen.model)).structure(), [drawn.record(v, 0.5)[0] for v in SPEEDS]
    )
    (step,), (hidden,) = found.steps, drawn.hidden
    assert (found.verdict, step.effect) == ("effect_missing", "maxwell_element"), found.text
    assert hidden.shape["relaxation_time"] < 2e-3 and abs(step.coefficient - hidden.coefficient) < 4.0 * step.std


@pytest.mark.parametrize(
    ("name", "effect", "other"),
    [
        ("single/plastic_unloading/1/2g/10000Hz/1.1/14000888", "plastic_unloading", "hysteresis"),
        ("side/channel_delay/1/2g/10000Hz/1.1/14000701", "channel_delay", "clearance"),
    ],
)
def test_what_no_screening_sees_is_among_the_rivals(name, effect, other):
    """The other one alone was told, though both leave noise: a screening takes a coefficient for small."""
    _, structure, recordings = drawn_case(case_of(name))
    leader = diagnose(structure, recordings).ranking[0]
    assert {effect, other} <= {leader.effect, *(rival.split(" on ")[0] for rival in leader.confounded_with)}


def test_a_rare_effect_is_named_beside_a_common_one():
    model, recordings, hidden = case("impactor", "unmodelled_body", "gas_cushion")
    found = diagnose(model, recordings)
    assert (found.verdict, found.complete) == ("effect_missing", True), found.text
    assert {(step.effect, step.target) for step in found.steps} == {(one.effect, one.target) for one in hidden}


def named(name: str) -> list[tuple[str, str]]:
    """What is named of a simulated case that was looked at."""
    _, structure, recordings = drawn_case(case_of(name))
    found = diagnose(structure, recordings)
    return [(step.effect, step.target) for step in found.steps] if found.verdict == "effect_missing" else []


@pytest.mark.parametrize(
    ("name", "element"),
    [
        ("side/maxwell_element/1/1g/10000Hz/0.75,1.1/17000480", "mdb_door"),
        ("frontal/maxwell_element/1/2g/10000Hz/0.75,1.1/17000679", "engine_barrier"),
    ],
)
def test_a_rare_effect_is_named_where_the_best_common_one_leaves_four_times_as_much(name, element):
    """Rate hardening leaves 1.4 and 1.5 of the noise, what relaxes 1.04 and, with contacts as they are, noise."""
    assert named(name) == [("maxwell_element", element)]


def test_a_rare_effect_that_leaves_less_than_all_common_ones_leads_to_a_pair():
    pair = named("frontal/channel_gain+maxwell_element/1/1g/10000Hz/0.75,1.1/17000330")
    assert pair == [("maxwell_element", "engine_barrier"), ("channel_gain", "engine_ax")]


@pytest.mark.parametrize(("first", "common_only"), [("maxwell_element", True), ("cubic_stiffness", False)])
def test_beside_a_rare_effect_none_is_looked_for_that_is_rare_and_has_a_shape_to_bend(monkeypatch, first, common_only):
    asked = []
    leads = CandidateFit(Addition(EFFECTS[first], "mount"), 1e3, SimpleNamespace(cost=0.0))
    magnitudes = SimpleNamespace(structure=SimpleNamespace(effects=()))
    monkeypatch.setattr(pair_search, "_leading", lambda model, candidates: candidates)
    monkeypatch.setattr(pair_search, "analyse", lambda fit: SimpleNamespace(mean_square=2.0))
    monkeypatch.setattr(pair_search, "as_fitted", lambda model, first: model)
    monkeypatch.setattr(pair_search, "fit_candidates", lambda m, effects, *given, least: asked.append(effects) or [])
    assert pair_search.two_at_once(magnitudes, EFFECTS, SimpleNamespace(records=()), [leads], [], None) is None
    (effects,) = asked
    straight = {"force_offset": EFFECTS["force_offset"]}
    assert effects == (common_effects(magnitudes.structure, EFFECTS) | straight if common_only else EFFECTS)


@pytest.mark.parametrize("effect", ["viscous_damping", "cubic_stiffness"])
def test_a_common_effect_stays_named(effect):
    model, recordings, _ = case("impactor", effect)
    found = diagnose(model, recordings)
    assert [step.effect for step in found.steps] == [effect] and found.complete


def test_none_is_tried_where_nothing_is_missing():
    model, recordings, _ = case("impactor")
    found = diagnose(model, recordings)
    assert found.verdict == "adequate" and not RARE & {ranked.effect for ranked in found.ranking}


def test_of_an_effect_in_several_forms_those_that_are_not_looked_for_first_are_rare():
    damper, gas, gap = (EFFECTS[name] for name in ("viscous_damping", "gas_cushion", "clearance"))
    rest = damper.without(damper.common())
    assert (rest.variants, rest.rare) == (("uneven", "hunt_crossley", "power"), True) and is_rare(
        Addition(rest, "mount", variant="uneven")
    )
    assert gas.without(gas.common()) is gas and gap.without(gap.common()) is None
    assert damper.without(damper) is None, "where the model has one, all its forms are common"


@pytest.mark.parametrize("rebound", [0.0, 4.0])
def test_a_damper_with_valves_is_told_as_one(rebound):
    """One that hardly pulls was told as a gas, whose coefficient meant nothing; one that pulls four times as hard as it
    pushes, as those of wheels do, as one that does both alike."""
    sled = ModelFile.model_validate(
        {
            "name": "sled",
            "bodies": {"sled": {"mass": MASS, "acceleration": "sled_ax"}, "wall": {"fixed": True, "force": "wall_fx"}},
            "elements": {"buffer": {"between": ["sled", "wall"], "stiffness": SPRING}},
        }
    ).structure()
    found = diagnose(sled, [with_valves(speed, rebound) for speed in (2.0, 3.0)])
    (step,) = found.steps
    assert (found.verdict, found.complete) == ("effect_missing", True), found.text
    assert (step.effect, step.target, step.form) == ("viscous_damping", "buffer", "uneven"), found.text
    assert abs(step.coefficient / DAMPER - 1.0) < 0.02 and abs(step.shape["rebound"] - rebound) < 0.05


MASS, DAMPER = 95.0, 300.0  # kg, N s/m
SPRING = {"estimate": True, "initial": 2e4, "shape": "constant"}


def with_valves(speed: float, rebound: float) -> Recording:
    """A sled that swings on a spring of 30 N/mm, beside it a damper that pulls by so many times of what it pushes."""

    def force(state):
        return 3e4 * state[0] + DAMPER * np.where(state[1] > 0.0, 1.0, rebound) * state[1]

    time = np.arange(3000) / 1e4
    exactly = dict(t_eval=time, rtol=1e-8, max_step=1e-3)
    way = solve_ivp(lambda t, x: (x[1], -force(x) / MASS), (0.0, 0.3), (0.0, speed), **exactly)
    noise = np.random.default_rng(7).standard_normal((3300, 2)) * (0.3, 30.0)
    values = np.vstack([np.zeros((300, 2)), np.column_stack([-force(way.y) / MASS, force(way.y)])]) + noise
    channels = Channel("sled_ax", "acceleration", "sled", "x"), Channel("wall_fx", "force", "wall", "x")
    test = Test(f"sled_{speed:g}", channels, initial_velocity={"sled": speed})
    return Recording(test, (np.arange(-300, 3000) * 100_000).astype(np.int64), values)


def test_what_the_model_has_is_common_in_all_its_forms():
    model, *_ = case("impactor", "viscous_damping")
    assert EFFECTS.keys() - common_effects(model, EFFECTS).keys() == RARE
    assert common_effects(model, EFFECTS)["rate_hardening"].variants == ("",)
    target = model.elements[0].name
    specs = EffectSpec("maxwell_element", target), EffectSpec("rate_hardening", target, variant="logarithmic")
    found = common_effects(replace(model, effects=specs), EFFECTS)
    assert EFFECTS.keys() - found.keys() == RARE - {"maxwell_element"}
    assert found["rate_hardening"].variants == ("", "logarithmic", "uneven", "uneven_logarithmic")


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
