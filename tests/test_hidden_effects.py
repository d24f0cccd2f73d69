"""Simulated recordings with a hidden effect: the mechanics have what is said to be hidden, the model does not tell."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from ruamel.yaml import YAML
from scipy.constants import g as G
from scipy.interpolate import PchipInterpolator
from test_architecture import modules_after

from crash_estimator.core.diagnosis.diagnosis import diagnose
from crash_estimator.model_file import load_model
from crash_replay.bag import read_bag, write_bag
from crash_replay.recording import RecordingError
from crash_replay.synthesize_command import main
from crash_replay.synthetic.hidden.bundled import NAME, bundled_case
from crash_replay.synthetic.hidden.cases import EFFECTS, HiddenCase, draw_case, hideable
from crash_replay.synthetic.hidden.observable import ON_ELEMENTS, SHOWS, distance
from crash_replay.synthetic.hidden.specimen import STEP, peaks_of
from crash_replay.synthetic.hidden.structures import STRUCTURES
from crash_replay.synthetic.integrate import simulate

BAGS = Path(__file__).parents[1] / "bags"
SEED = 11


@cache
def drawn(structure: str, *effects: str, seed: int = SEED, size: float = 1.0) -> HiddenCase:
    return draw_case(structure, effects, seed, size)


@cache
def recorded(structure: str, *effects: str):
    """-> recording and truth at 1.1 of the nominal speed, and the truth file read back."""
    case = drawn(structure, *effects)
    recording, truth = case.record(1.1)
    return recording, truth, YAML(typ="safe", pure=True).load(case.truth_text(truth))


def model_of(case: HiddenCase) -> dict:
    return YAML(typ="safe", pure=True).load(case.model_text)


# --- what is hidden is in the mechanics


def static_force(element: dict, crush: np.ndarray, peak: np.ndarray) -> np.ndarray:
    """From the truth file's description alone."""
    gap = element.get("gap", 0.0)
    curve = PchipInterpolator(element["force"]["crush"], element["force"]["value"])
    x, top = crush - gap, np.maximum(peak - gap, 0.0)
    loading = np.where(x >= 0.0, curve(np.abs(x)), -curve(np.abs(x)) if element["tension"] else 0.0)
    if "unloading" not in element:
        return loading
    return np.where(x < top, np.maximum(curve(top) - element["unloading"] * (top - x), 0.0), loading)


PARALLEL = {
    "viscous_damping": lambda c, x, v: 0.0 * x,  # in the element's own damping
    "quadratic_damping": lambda c, x, v: c * v * np.abs(v),
    "coulomb_friction": lambda c, x, v, speed: c * np.tanh(v / speed),
    "cubic_stiffness": lambda c, x, v: c * x**3,
    "bottoming_out": lambda c, x, v, stop: c * np.maximum(x - stop, 0.0),
}


@pytest.mark.parametrize("structure", ["frontal", "side", "dummy", "impactor"])
@pytest.mark.parametrize("effect", ON_ELEMENTS)
def test_element_carries_what_the_truth_file_says_and_the_hidden_effect(structure, effect):
    _, truth, content = recorded(structure, effect)
    (hidden,) = content["hidden"]
    element, found = content["elements"][hidden["target"]], truth.elements[hidden["target"]]
    now = truth.time_ns > 0
    crush, rate, peak, force = (column[now] for column in (found.crush, found.rate, found.peak, found.force))
    static = static_force(element, crush, peak)
    carries = ~((static == 0.0) & ((crush < peak) | (crush < element.get("gap", 0.0))))
    expected = static.copy()
    if effect == "rate_hardening":
        expected *= 1.0 + (np.maximum(rate, 0.0) / hidden["coefficient"]) ** (1.0 / hidden["shape"]["exponent"])
    expected += element["damping"] * rate
    if effect in PARALLEL:
        expected += PARALLEL[effect](hidden["coefficient"], crush, rate, **hidden["shape"])
    assert_allclose(force, np.where(carries, expected, 0.0), rtol=1e-9, atol=1e-6)
    told = model_of(drawn(structure, effect))["elements"][hidden["target"]]
    more = {"viscous_damping": "damping", "clearance": "gap", "plastic_unloading": "unloading"}.get(effect)
    if more:
        assert_allclose(element[more] - (told.get(more, 0.0) if more == "damping" else 0.0), hidden["coefficient"])
        assert told.get(more) != element[more]


@pytest.mark.parametrize("structure", ["frontal", "dummy"])
@pytest.mark.parametrize("effect", ["added_mass", "constant_force", "timed_force", "changing_mass"])
def test_body_feels_the_hidden_effect(structure, effect):
    """M a - load on the free body, M the model's mass, is what the effect makes of it."""
    _, truth, content = recorded(structure, effect)
    (hidden,) = content["hidden"]
    body, now = truth.bodies[hidden["target"]], truth.time_ns >= 0
    mass = model_of(drawn(structure, effect))["bodies"][hidden["target"]]["mass"]
    acceleration, load = body.acceleration[now], body.load[now]
    missing, c = mass * acceleration - load, hidden["coefficient"]
    match effect:
        case "added_mass":
            assert_allclose(missing, -c * acceleration, atol=1e-6)
        case "constant_force":
            assert_allclose(missing, c, atol=1e-6)
        case "timed_force":
            pushed = np.abs(missing) > 1e-6
            assert_allclose(np.abs(missing).max(), abs(c), rtol=0.01)
            assert 0.007 < pushed.sum() / 10_000 < 0.026 and not pushed[:150].any()
        case "changing_mass":
            grown = -missing / np.where(np.abs(acceleration) > 1.0, acceleration, np.nan)
            assert np.nanmax(np.abs(grown[:150])) < 1e-6
            assert_allclose(grown[-50:][np.isfinite(grown[-50:])], c, rtol=1e-9)


@pytest.mark.parametrize("structure", ["frontal", "side", "dummy"])
@pytest.mark.parametrize("effect", ["channel_delay", "channel_gain", "channel_offset", "rotation"])
def test_sensor_errs_as_hidden(structure, effect):
    recording, truth, content = recorded(structure, effect)
    (hidden,) = content["hidden"]
    name = hidden["target"] if effect != "rotation" else f"{hidden['target']}_a{recording.test.channels[0].axis}"
    sensor = next(s for s in truth.scenario.sensors if s.channel.name == name)
    seen = recording.values[:, recording.test.channel_names.index(name)] - truth.channels[name].offset
    true, now = truth.channels[name].signal, truth.time_ns >= 0
    noise, c = sensor.noise, hidden["coefficient"]
    off = {
        "channel_gain": c * true, "channel_offset": np.where(now, c, 0.0),
        "channel_delay": np.interp(recording.time - c, recording.time, true) - true,
    }  # fmt: skip
    if effect == "rotation":
        difference = seen - true
        assert np.std(difference[~now]) < 1.1 * noise and np.std(difference[now]) > 1.3 * noise
        return
    left = (seen - true - off[effect])[now]
    # a jump of the force is a straight line between two samples only in this test
    assert np.median(np.abs(left)) < 0.75 * noise
    assert np.abs(np.mean(left)) < 5.0 * noise / np.sqrt(len(left))
    assert np.sum(off[effect] ** 2) > 50.0 * noise**2


def test_load_path_joins_two_bodies_that_the_model_does_not():
    _, truth, content = recorded("side", "load_path")
    (hidden,) = content["hidden"]
    found = truth.elements["load_path"]
    now = truth.time_ns >= 0
    assert_allclose(found.force[now], hidden["coefficient"] * found.crush[now], rtol=1e-12, atol=1e-6)
    pairs = [set(e["between"]) for e in model_of(drawn("side", "load_path"))["elements"].values()]
    assert set(hidden["target"].split("-")) not in pairs


def test_unmodelled_body_has_a_channel_that_the_model_does_not_use():
    case = drawn("frontal", "unmodelled_body")
    recording, truth, content = recorded("frontal", "unmodelled_body")
    (hidden,) = content["hidden"]
    assert hidden["target"] in recording.test.channel_names and hidden["target"] not in case.model_text
    body = truth.bodies[hidden["target"].removesuffix("_ax")]
    assert_allclose(hidden["coefficient"] * body.acceleration, body.load, atol=1e-6)


@pytest.mark.parametrize("structure", STRUCTURES)
def test_steps_of_the_integration_are_fine_enough(structure):
    """Half of them change no acceleration by a tenth of what the rounding to 0.03 g does, friction at work."""
    scenario = drawn(structure, "coulomb_friction").specimen.scenario
    time = np.arange(0.0, scenario.duration, 1e-3)
    once, twice = (simulate(scenario.system, time, step).acceleration for step in (STEP, STEP / 2.0))
    assert_allclose(once, twice, rtol=0.0, atol=0.1 * 0.03 / 12**0.5 * G)


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
    case = drawn("dummy", "viscous_damping", "channel_gain")
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
        "frontal": {"load_path"}, "single": {"load_path", "added_mass"}, "side": set(), "dummy": set(),
        "impactor": {"load_path", "added_mass", "constant_force", "channel_delay", "channel_gain", "channel_offset"},
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
    case = drawn("dummy", "channel_delay")
    plain = replace(case, specimen=case.specimen.with_sensor(case.hidden[0].target, delay=0.0)).specimen
    assert distance(plain, case.specimen) > SHOWS
    assert distance(plain, plain) == 0.0


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


# --- files and the command


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


def synthesize(monkeypatch, *arguments: str) -> int:
    """The command's exit status."""
    monkeypatch.setattr("sys.argv", ["synthesize", *arguments])
    try:
        main()
    except SystemExit as ended:
        return ended.code
    return 0


def test_command_hides_an_effect_and_writes_model_and_truth_beside(tmp_path, monkeypatch, capsys):
    bag = tmp_path / "mine.mcap"
    settings = ["--hide", "viscous_damping:door_car", "--hide", "channel_gain", "--seed", "4", "--rate", "1000"]
    assert synthesize(monkeypatch, "side", *settings, "--size", "0.5", "--to", str(bag)) == 0
    assert "model in mine.model.yaml" in capsys.readouterr().out
    case = draw_case("side", ["viscous_damping", "channel_gain"], 4, 0.5, {"viscous_damping": "door_car"})
    assert_array_equal(read_bag(bag).values, case.record(rate=1000.0)[0].values)
    load_model(tmp_path / "mine.model.yaml")
    hidden = YAML(typ="safe", pure=True).load((tmp_path / "mine.truth.yaml").read_text())["hidden"]
    assert [(h["effect"], h["target"]) for h in hidden][0] == ("viscous_damping", "door_car")


@pytest.mark.parametrize(
    ("arguments", "status", "complaint"),
    [
        (["side", "--hide", "rust"], 2, "argument --hide: expected none or one of viscous_damping"),
        (["side"], 2, "--hide goes with one of frontal, single, side, dummy, impactor"),
        (["frontal_single", "--hide", "none"], 2, "--hide goes with one of frontal"),
        (["single", "--hide", "added_mass:car"], 1, "added_mass on car cannot be told in structure single: it has no target"),
        (["dummy", "--hide", "clearance:nose"], 1, "error: clearance on nose cannot be told in structure dummy: it can be on "),
    ],
)
def test_command_says_what_it_cannot_hide(arguments, status, complaint, tmp_path, monkeypatch, capsys):
    assert synthesize(monkeypatch, *arguments, "--to", str(tmp_path / "x.mcap")) == status
    assert complaint in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
