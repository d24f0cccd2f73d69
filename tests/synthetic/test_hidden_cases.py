"""The cases that hide an effect: their seeds, sizes and sensors, only what can be told, and the bundled one."""

from dataclasses import replace

import numpy as np
import pytest
from helpers_modules import modules_after
from helpers_paths import BAGS
from helpers_synthetic import SEED, drawn, model_of
from numpy.testing import assert_allclose, assert_array_equal
from scipy.constants import g as G

from crash_estimator.core.diagnosis.report.diagnosis import diagnose
from crash_estimator.model_file import load_model
from crash_replay.bag import read_bag, write_bag
from crash_replay.recording import RecordingError
from crash_replay.synthetic.hidden.bundled import NAME, bundled_case
from crash_replay.synthetic.hidden.cases import EFFECTS, draw_case, hideable
from crash_replay.synthetic.hidden.curves import straight
from crash_replay.synthetic.hidden.observable import SHOWS, distance, shows
from crash_replay.synthetic.hidden.specimen import peaks_of
from crash_replay.synthetic.hidden.structures import STRUCTURES

# --- seeds, sensors and sizes


def test_same_seed_is_the_same_case_at_every_speed_noise_and_rate():
    case, again = drawn("dummy", "coulomb_friction"), draw_case("dummy", ["coulomb_friction"], SEED)
    assert case.hidden == again.hidden and case.model_text == again.model_text
    assert_array_equal(case.record(1.1)[0].values, again.record(1.1)[0].values)
    other = drawn("dummy", "coulomb_friction", seed=SEED + 1)
    assert other.model_text != case.model_text
    slow = case.record(0.75, noise=2.0, rate=1000.0)[0]
    assert_allclose(np.diff(slow.time_ns), 1e6)
    faster, slower = case.record(1.1)[1].bodies, case.record(0.75)[1].bodies
    assert faster["door_upper"].velocity.max() > 1.3 * slower["door_upper"].velocity.max()


@pytest.mark.parametrize("noise", [0.5, 10.0])
def test_accelerometers_have_the_noise_that_was_asked_for_in_steps_of_30_mg(noise):
    recording, truth = drawn("side").record(1.0, noise)
    quiet = recording.values[recording.time_ns < 0]
    assert_allclose(np.std(quiet, axis=0), noise * G, rtol=0.15)
    steps = recording.values / (0.03 * G)
    assert_allclose(steps, np.rint(steps), atol=1e-6)


def test_size_scales_the_effect_and_nothing_else():
    whole, eighth = drawn("side", "viscous_damping"), drawn("side", "viscous_damping", size=0.125)
    assert_allclose(eighth.hidden[0].coefficient, whole.hidden[0].coefficient / 8.0)
    assert eighth.hidden[0].target == whole.hidden[0].target and eighth.model_text == whole.model_text


def test_two_effects_are_hidden_at_once_on_two_targets():
    case = drawn("frontal", "viscous_damping", "channel_gain")  # nothing is driven there: soon drawn
    assert [h.effect for h in case.hidden] == ["viscous_damping", "channel_gain"]
    assert len({h.target for h in case.hidden}) == 2


def test_a_case_with_nothing_hidden_is_what_its_model_says():
    case = drawn("frontal")
    told, truth = model_of(case), case.record()[1]
    assert case.hidden == ()
    for body in truth.scenario.system.bodies:
        assert told["bodies"][body.name].get("mass") == body.mass
    for element in truth.scenario.system.elements:
        law, entry = element.spring, told["elements"][element.name]
        assert (law.damping, law.unloading, law.gap) == (entry.get("damping", 0.0), entry.get("unloading"), 0.0)
        assert law.parallel == () and law.hardening is None


# --- only what can be told is asked


@pytest.mark.parametrize("structure", STRUCTURES)
def test_every_effect_but_those_left_out_can_be_hidden_and_shows(structure):
    left_out = {
        "frontal": {"load_path"}, "single": {"load_path", "added_mass"}, "side": {"force_offset"},
        "dummy": {"initial_velocity", "force_offset"},
        "impactor": {"load_path", "added_mass", "constant_force", "guide_friction", "initial_velocity", "channel_delay",
                     "channel_gain", "channel_offset", "force_offset"},
    }[structure]  # fmt: skip
    assert set(EFFECTS) - set(hideable(structure)) == left_out


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize(
    ("structure", "effect"), [("side", "bottoming_out"), ("dummy", "clearance"), ("frontal", "cubic_stiffness")]
)
def test_what_needs_crush_gets_it_and_hides_in_no_free_curve(structure, effect, seed):
    case = drawn(structure, effect, seed=seed)
    (hidden,) = case.hidden
    stiffness = model_of(case)["elements"][hidden.target]["stiffness"]
    assert not isinstance(stiffness, dict) or stiffness["shape"] == "constant"
    reached = peaks_of(case.specimen).crush[hidden.target]
    assert reached > {"bottoming_out": hidden.shape.get("stop"), "clearance": hidden.coefficient}.get(effect, 0.01)


def test_an_effect_too_small_to_show_is_drawn_again():
    """The distance is that of what both sensors record, in standard deviations of 1 g."""
    case = drawn("dummy", "channel_delay", at="rib_ay")  # no driven one, which takes 90 simulations
    plain = replace(case, specimen=case.specimen.with_sensor(case.hidden[0].target, delay=0.0)).specimen
    assert distance(plain, case.specimen) > SHOWS
    assert distance(plain, plain) == 0.0


def test_a_driven_channel_is_wrong_only_where_what_it_drives_shows_it():
    """Most moves the channel itself, but a model is driven by it: the others are what it predicts. What a free curve
    between them takes in does not show, either: told what the curves are, it does."""
    bare = draw_case("dummy", (), 3).specimen
    beside_the_car = [e.name for e in bare.scenario.system.elements if "car" in e.between]
    known = {name: entry | {"stiffness": 1e5} for name, entry in bare.model["elements"].items()}
    free = {name: entry for name, entry in bare.model["elements"].items() if name in beside_the_car}
    bare = replace(bare, model={**bare.model, "elements": known | free})  # no other curve, nor what it could take in
    loose = bare
    for name in beside_the_car:
        loose = loose.with_law(name, curve=straight(1.0), damping=0.0)
    assert all(bare.told(name) == "curve" for name in beside_the_car)
    told = replace(bare, model={**bare.model, "elements": known})
    for specimen, channel, seen in (
        (loose, "car_ay", False), (bare, "car_ay", False), (told, "car_ay", True), (bare, "door_lower_ay", True),
    ):  # fmt: skip
        wrong = specimen.with_sensor(channel, distortion=lambda time, signal: 1.2 * signal)
        assert distance(specimen, wrong) > SHOWS
        assert shows(specimen, "channel_gain", channel, wrong) == seen


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (("bus", ["viscous_damping"]), "there is no structure 'bus': give one of frontal, single, side"),
        (("side", ["rust"]), "there is no effect 'rust' to hide: give one of viscous_damping"),
        (("single", ["load_path"]), "load_path cannot be told in structure single: it has no target there"),
    ],
)
def test_what_cannot_be_hidden_is_refused_in_a_line(arguments, complaint):
    with pytest.raises(RecordingError, match=complaint):
        draw_case(*arguments)


def test_the_simulator_shares_nothing_with_the_estimator():
    loaded = modules_after("import crash_replay.synthetic.hidden.cases, crash_replay.synthesize_command")
    assert "crash_replay.synthetic.hidden.laws" in loaded
    assert not any(name.startswith("crash_estimator") for name in loaded)


def test_bundled_recording_is_made_anew_bit_for_bit_and_names_its_effect(tmp_path):
    case = bundled_case()
    recording, truth = case.record()
    kept = BAGS / f"{NAME}.mcap"
    assert write_bag(recording, tmp_path / kept.name).read_bytes() == kept.read_bytes(), "run `make bags`, and say why"
    assert kept.stat().st_size < 300_000
    assert (BAGS / f"{NAME}.truth.yaml").read_text() == case.truth_text(truth)
    assert (BAGS / f"{NAME}.model.yaml").read_text() == case.model_text
    found = diagnose(load_model(BAGS / f"{NAME}.model.yaml"), [read_bag(kept)])
    assert found.verdict == "effect_missing"
    assert (found.ranking[0].effect, found.ranking[0].target) == ("coulomb_friction", "rib_spine")
    assert found.ranking[0].confounded_with == ()
