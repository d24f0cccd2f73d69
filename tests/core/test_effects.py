"""The vocabulary of effects: each one's physics, what it may act on, and a user's own."""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.testing import assert_allclose, assert_array_equal

from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.base import ElementForce, ElementMotion
from crash_estimator.core.effects.targets import checked
from crash_estimator.core.effects.user import load_effects
from crash_estimator.core.structure import Coefficient, EffectSpec, ModelError
from crash_estimator.core.structure_parts import ALL, NOTHING, SPRINGS, Action
from crash_estimator.model_file import load_model

VOCABULARY = """viscous_damping quadratic_damping coulomb_friction hysteresis maxwell_element gas_cushion
rate_hardening added_stiffness cubic_stiffness clearance bottoming_out yielding plastic_unloading load_path added_mass
unmodelled_body constant_force guide_friction gravity initial_velocity channel_delay channel_gain channel_offset
force_offset""".split()
DAMPERS = ("viscous_damping", "quadratic_damping", "coulomb_friction")
FORCES = [effect for effect in EFFECTS.values() if isinstance(effect, ElementForce)]
SMALL = st.floats(-10.0, 10.0, allow_subnormal=False)


def motion(crush, rate) -> ElementMotion:
    crush = np.asarray(crush, float)
    time = 1e-4 * np.arange(len(crush))
    return ElementMotion(time, crush, np.asarray(rate, float), np.maximum.accumulate(crush), np.zeros_like(crush))


def middle(effect) -> dict[str, float]:
    return {name: shape.starts[0] for name, shape in effect.shapes.items()}


def test_the_vocabulary_is_that_of_the_design():
    assert list(EFFECTS) == VOCABULARY
    assert all(name == effect.name for name, effect in EFFECTS.items())


@pytest.mark.parametrize("effect", FORCES, ids=lambda effect: effect.name)
def test_what_a_force_is_said_to_hang_on_alone_is_all_that_it_hangs_on(effect):
    """As the diagnosis takes no derivative by the other; in every form, each with the middle of its shape constants."""
    crush, rate = np.linspace(0.01, 0.3, 20), np.linspace(-5.0, 5.0, 20)
    for form in effect.variants:
        force = partial(effect.force, **{name: shape.starts[0] for name, shape in effect.shapes_of(form).items()})
        given = force(motion(crush, rate))
        hangs_on_rate = not np.array_equal(force(motion(crush, rate + 0.5)), given)
        hangs_on_crush = not np.array_equal(force(motion(crush + 0.1, rate)), given)
        assert not (effect.of_crush_only and hangs_on_rate) and not (effect.of_rate_only and hangs_on_crush)
        assert hangs_on_rate or hangs_on_crush


@pytest.mark.parametrize("name", DAMPERS)
@settings(max_examples=50, deadline=None)
@given(rate=arrays(float, 20, elements=SMALL))
def test_a_damper_never_adds_energy(name, rate):
    effect = EFFECTS[name]
    assert effect.low == 0.0
    assert np.all(effect.force(motion(np.zeros(20), rate), **middle(effect)) * rate >= 0.0)


@pytest.mark.parametrize("effect", FORCES, ids=lambda effect: effect.name)
def test_one_instant_is_the_same_row_of_the_whole_record(effect):
    rng = np.random.default_rng(3)
    whole = motion(rng.normal(0.1, 0.1, 30), rng.normal(0.0, 5.0, 30))
    rows = [effect.force(ElementMotion(*(x[k : k + 1] for x in whole)), **middle(effect)) for k in range(30)]
    assert_array_equal(np.concatenate(rows), effect.force(whole, **middle(effect)))


def test_forces_have_the_sizes_of_their_equations():
    here = motion([0.2, 0.2], [3.0, -3.0])
    assert_allclose(EFFECTS["viscous_damping"].force(here), [3.0, -3.0])
    assert_allclose(EFFECTS["quadratic_damping"].force(here), [9.0, -9.0])
    assert_allclose(EFFECTS["quadratic_damping"].force(here, stroke=0.4), [36.0, -36.0])
    assert_allclose(EFFECTS["coulomb_friction"].force(here, speed=0.1), [1.0, -1.0])
    assert_allclose(EFFECTS["cubic_stiffness"].force(here), [8e-3, 8e-3])
    assert_allclose(EFFECTS["bottoming_out"].force(motion([0.1, 0.2], [1.0, 1.0]), stop=0.15), [0.0, 0.05], atol=1e-15)
    yields = EFFECTS["yielding"].force(motion([0.1, 0.2], [1.0, 1.0]), yield_crush=0.15)
    assert_allclose(yields, [0.0, -0.05], atol=1e-15)


def test_hysteresis_that_stands_still_is_as_it_was_and_follows_what_was_before():
    z, by_before, by_crush, _ = EFFECTS["hysteresis"].memory(np.zeros(3), np.full(3, 0.01), 0.3, 0.02, 2.0)
    assert_array_equal(z, 0.3)
    assert_array_equal(by_before, 1.0)
    assert_allclose(by_crush[1:], (1.0 - 0.3**2) / 0.02)


def test_the_rate_of_cowper_and_symonds_doubles_the_force():
    hardening = EFFECTS["rate_hardening"]
    c = hardening.unstated(40.0, exponent=5.0)
    assert 1.0 + c * hardening.factor(np.array([40.0]), exponent=5.0)[0] == pytest.approx(2.0)
    assert hardening.stated(c, exponent=5.0) == pytest.approx(40.0)
    assert_allclose(hardening.factor(np.array([-5.0, 0.0]), exponent=5.0), 0.0)


@pytest.mark.parametrize(("exponent", "doubted"), [(0.7, True), (0.8, False), (9.9, False), (10.0, True)])
def test_a_rate_law_whose_exponent_is_driven_to_its_limit_is_another_law_s(exponent, doubted):
    hardening = EFFECTS["rate_hardening"]
    assert hardening.is_doubt(None, None, 0.1, {"exponent": exponent}, None) == doubted
    assert not hardening.is_doubt(None, None, 0.1, {"reference_rate": 10.0}, None)


@pytest.mark.parametrize(("largest", "doubted"), [(1900.0, False), (2100.0, True)])
def test_what_yields_and_stays_bent_is_called_so_where_it_yields_at_half_of_its_own_largest_force(largest, doubted):
    yielding, shapes = EFFECTS["yielding"], {"yield_crush": 0.02}
    fitted = SimpleNamespace(largest_force={"spring": largest}.__getitem__)
    for variant, said in (("plastic", doubted), ("", False), ("in_curve", False)):
        addition = SimpleNamespace(target="spring", variant=variant)
        assert yielding.is_doubt(None, addition, 5.0e4, shapes, fitted) == said


@pytest.mark.parametrize(("loading", "doubted"), [(1.5e5, True), (1.3e5, False), (None, False)])
def test_no_element_unloads_on_a_line_less_steep_than_it_loads_on(loading, doubted):
    """It would give back more than it took; of a curve, which may have bent, that is not known."""
    fitted = SimpleNamespace(constant_stiffness={"pad": loading}.__getitem__)
    assert EFFECTS["plastic_unloading"].is_doubt(None, SimpleNamespace(target="pad"), 1.4e5, {}, fitted) == doubted


def test_the_logarithmic_rate_doubles_the_force_too_and_counts_from_its_reference_on():
    hardening = EFFECTS["rate_hardening"]
    c = hardening.unstated(40.0, reference_rate=0.5)
    rates = np.array([-5.0, 0.0, 0.3, 0.5, 40.0, 3200.0])
    assert_allclose(1.0 + c * hardening.factor(rates, reference_rate=0.5), [1.0, 1.0, 1.0, 1.0, 2.0, 3.0])
    assert hardening.stated(c, reference_rate=0.5) == pytest.approx(40.0)
    assert hardening.stated(1e-9, reference_rate=0.5) == np.inf == hardening.stated(0.0, reference_rate=0.5)
    with pytest.raises(ModelError, match="40 m/s, the rate that doubles the force, must be above .* 40 m/s, at which"):
        hardening.unstated(40.0, reference_rate=40.0)


def test_the_limits_are_physical():
    """Damping and a spring beside never negative; a delay within 1 ms, gains and stated speeds within 10 %, offsets
    5 g; a body may be heavier than stated, or lighter, and a stated spring stiffer, or softer; it may fall or rise."""
    stated = {"added_mass", "added_stiffness", "constant_force", "initial_velocity"}
    signed = stated | {"channel_gain", "channel_offset", "force_offset", "gravity"}
    assert {name for name, effect in EFFECTS.items() if effect.low < 0.0} == signed
    assert EFFECTS["channel_delay"].high == pytest.approx(1e-3)
    assert (EFFECTS["channel_gain"].low, EFFECTS["channel_gain"].high) == pytest.approx((-0.1, 0.1))
    assert (EFFECTS["initial_velocity"].low, EFFECTS["initial_velocity"].high) == pytest.approx((-0.1, 0.1))
    assert EFFECTS["channel_offset"].high == pytest.approx(5.0 * 9.80665)


def test_targets_are_elements_bodies_channels_and_pairs():
    structure = load_model("side_dummy")
    kinds = {name: effect.acts_on for name, effect in EFFECTS.items()}
    assert (kinds["clearance"], kinds["added_mass"], kinds["channel_gain"]) == ("element", "body", "channel")
    assert "rib_spine" in EFFECTS["clearance"].possible_targets(structure, None)
    assert "door_upper" not in EFFECTS["added_mass"].possible_targets(structure, None)
    assert "rib-pelvis" in EFFECTS["load_path"].possible_targets(structure, None)


def friction(**shape: float) -> EffectSpec:
    return EffectSpec("coulomb_friction", "door_rib", shape=shape)


MISTAKES = {
    "no such effect": (EffectSpec("coulomb", "door_rib"), "no effect 'coulomb'; did you mean 'coulomb_friction'"),
    "no such element": (EffectSpec("clearance", "door_rip"), "cannot act on 'door_rip'; .*did you mean 'door_rib'"),
    "a driven body": (EffectSpec("added_mass", "car"), "cannot act on 'car'; it needs a free body"),
    "another shape": (friction(sped=1.0), "no shape constant 'sped'; it has speed"),
    "a shape below 0": (friction(speed=-1.0), "speed must be above 0, got -1"),
    "a negative damper": (EffectSpec("viscous_damping", "door_rib", -5.0), "must be not below 0 N.s/m, got -5"),
    "a late channel": (EffectSpec("channel_delay", "rib_ay", 0.002), "must be from 0 to 0.001 s, got 0.002"),
    "no such host": (EffectSpec("unmodelled_body", "nose_ay", host="ribs"), "must be a body, got 'ribs'; .* 'rib'"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_in_a_model_s_effect_is_one_clear_line(mistake):
    spec, expected = MISTAKES[mistake]
    with pytest.raises(ModelError, match=expected) as found:
        checked(load_model("side_dummy"), spec, EFFECTS)
    assert "\n" not in str(found.value) and "side_dummy" in str(found.value)


OWN = '''
"""Fluid drag: F = c V^3."""
from crash_estimator.core.effects.base import ElementForce

EFFECT = ElementForce("cubic_damping", "N*s^3/m^3", force=lambda motion: motion.rate**3)
'''


def test_a_user_s_effect_is_a_file(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(OWN)
    found = load_effects(path)
    assert list(found) == ["cubic_damping"]
    assert_allclose(found["cubic_damping"].force(motion([0.0], [2.0])), [8.0])


BAD_FILES = {
    "nothing": ("x = 1", "defines no effect"),
    "a taken name": (OWN.replace("cubic_damping", "viscous_damping"), "'viscous_damping' is an effect of"),
    "an error": ("1 / 0", "ZeroDivisionError"),
    "not Python": ("def (", "SyntaxError"),
    "a misspelt name": (
        OWN.replace("motion.rate**3", "motion.rat"),
        "force of 'cubic_damping' fails .* no attribute 'rat'",
    ),
    "one sum for all instants": (
        OWN.replace("motion.rate**3", "motion.rate[:7]"),
        "one number for each of the 64 instants",
    ),
    "a root of what may be negative": (OWN.replace("rate**3", "rate**0.5"), "must be finite .* it is nan"),
}


@pytest.mark.parametrize("kind", BAD_FILES)
def test_a_user_s_file_with_a_fault_is_one_clear_line(kind, tmp_path):
    text, expected = BAD_FILES[kind]
    path = tmp_path / "mine.py"
    path.write_text(text)
    with pytest.raises(ModelError, match=f"mine.py.*{expected}"):
        load_effects(path)


GAPS = """
from crash_estimator.core.effects.base import ElementForce, Shape

def force(motion, gap):
    if not 0.0 < gap < 0.5:
        raise ValueError(f"a gap of {gap} m")
    return (motion.crush > gap).astype(float)

EFFECT = ElementForce("gap", "N", {"gap": Shape("m", SHAPE)}, force=force)
"""


@pytest.mark.parametrize(
    ("shape", "fails"),
    [
        ("0.2, 0.9, (0.5,), of_crush=True", False),  # half of the crush that it is tried out on
        ("0.2, 0.9, (0.3,)", False),  # m
        ("0.2, 0.9, (0.9,)", True),
        ("1.0, 9.0, (5.0,), of_crush=True", True),  # five times it
    ],
)
def test_a_shape_constant_is_tried_out_as_what_it_is_a_share_of(tmp_path, shape, fails):
    path = tmp_path / "mine.py"
    path.write_text(GAPS.replace("SHAPE", shape))
    if fails:
        with pytest.raises(ModelError, match="fails on a motion it was tried on: ValueError: a gap of"):
            load_effects(path)
    else:
        assert "gap" in load_effects(path)


def test_an_action_is_no_function_of_the_crush_unless_it_says_so():
    """What still acts where a spring is spent may be its other springs: a memory, a factor, a damper is none."""
    action = Action("spring.hysteresis", "N", "memory", 0, Coefficient(1.0), 1.0)
    assert [action.outlasts(SimpleNamespace(acts_when_spent=what)) for what in (NOTHING, SPRINGS, ALL)] == [0, 0, 1]
    elastic = replace(action, kind="element", of_crush_only=True)
    assert [elastic.outlasts(SimpleNamespace(acts_when_spent=what)) for what in (NOTHING, SPRINGS, ALL)] == [0, 1, 1]
