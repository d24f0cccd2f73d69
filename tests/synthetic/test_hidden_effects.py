"""Simulated recordings with a hidden effect: the mechanics have what is said to be hidden, the model does not tell."""

from itertools import cycle

import numpy as np
import pytest
from helpers_synthetic import drawn, model_of, recorded
from numpy.testing import assert_allclose
from scipy.constants import g as G
from scipy.interpolate import PchipInterpolator

from crash_replay.synthetic.hidden.observable import ON_ELEMENTS
from crash_replay.synthetic.hidden.specimen import STEP
from crash_replay.synthetic.hidden.structures import STRUCTURES
from crash_replay.synthetic.integrate import simulate


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
    "yielding": lambda c, x, v, yield_crush: -c * np.maximum(x - yield_crush, 0.0),
}


STRUCTURE_OF = dict(zip(ON_ELEMENTS, cycle(("impactor", "dummy", "frontal", "side"))))
"""Each effect in one structure, each structure with three of them."""


@pytest.mark.parametrize(("effect", "structure"), STRUCTURE_OF.items())
def test_element_carries_what_the_truth_file_says_and_the_hidden_effect(effect, structure):
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
    if effect == "hysteresis":  # its memory is a state of the simulation: it stays within its yield force, and yields
        remembered = np.abs(force - expected)[carries]
        assert 0.9 < remembered.max() / hidden["coefficient"] < 1.0 + 1e-9
        return
    if effect == "maxwell_element":  # as its equation has it, by the trapezoidal rule
        relaxes, z = hidden["shape"]["relaxation_time"], np.zeros_like(crush)
        h = np.diff(truth.time_ns[now][:2])[0] * 1e-9
        for t in range(len(z)):
            before, rate_before = (z[t - 1], rate[t - 1]) if t else (0.0, rate[0])
            flow = 0.5 * h * (rate[t] + rate_before) - 0.5 * h / relaxes * before
            pressed = crush[t] > 0.0 or element["tension"]
            z[t] = (before + flow) / (1.0 + 0.5 * h / relaxes) if pressed else before
        expected += hidden["coefficient"] * z
        assert_allclose(force[carries], expected[carries], atol=2e-3 * np.abs(force).max())
        return
    if effect == "gas_cushion":  # between what it would be without a hole, and nothing, by what one step overshoots
        tight = (1.0 - np.maximum(crush, 0.0) / hidden["shape"]["length"]) ** -1.4 - 1.0
        pressed = (force - expected)[carries] / hidden["coefficient"]
        assert pressed.min() > -2e-3 * pressed.max() and (pressed <= tight[carries] * (1.0 + 1e-9) + 1e-9).all()
        assert 0.02 < pressed.max() < 0.98 * tight.max()
        return
    if effect in PARALLEL:
        expected += PARALLEL[effect](hidden["coefficient"], crush, rate, **hidden["shape"])
    assert_allclose(force, np.where(carries, expected, 0.0), rtol=1e-9, atol=1e-6)
    told = model_of(drawn(structure, effect))["elements"][hidden["target"]]
    more = {"viscous_damping": "damping", "clearance": "gap", "plastic_unloading": "unloading"}.get(effect)
    if more:
        assert_allclose(element[more] - (told.get(more, 0.0) if more == "damping" else 0.0), hidden["coefficient"])
        assert told.get(more) != element[more]


@pytest.mark.parametrize(
    ("structure", "effect"),
    [("dummy", "added_mass"), ("frontal", "constant_force"), ("dummy", "timed_force"), ("frontal", "changing_mass")],
)
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


AT = {("dummy", effect): "rib_ay" for effect in ("channel_delay", "channel_gain", "channel_offset")}
"""Where a driven channel would be drawn, of which it takes 90 simulations to know whether its error shows: they err
alike wherever they are, and that it must show is asked of the cases."""


@pytest.mark.parametrize("structure", ["frontal", "dummy"])
@pytest.mark.parametrize("effect", ["channel_delay", "channel_gain", "channel_offset", "rotation"])
def test_sensor_errs_as_hidden(structure, effect):
    recording, truth, content = recorded(structure, effect, at=AT.get((structure, effect), ""))
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
