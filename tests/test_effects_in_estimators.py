"""Effects of a model file in the recursive estimators: known on the left side, unknown as one parameter more."""

import json
from functools import cache

import numpy as np
import pytest
from helpers_estimation import oscillator, oscillator_recording
from numpy.testing import assert_allclose
from ruamel.yaml import YAML
from scipy.constants import g as G

from crash_estimator.cli import estimate, report, simulate
from crash_estimator.cli.diagnose import _entry
from crash_estimator.core.compiled.estimator import CompiledEstimator
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.applied import applied
from crash_estimator.core.effects.base import ElementForce
from crash_estimator.core.effects.change import add_effect, remove_effect
from crash_estimator.core.effects.channels import Corrected
from crash_estimator.core.estimate import Estimate, ParameterStatus
from crash_estimator.core.fold import run
from crash_estimator.core.free_run import free_run
from crash_estimator.core.methods import make_estimator
from crash_estimator.core.structure import Coefficient, ModelError
from crash_estimator.model_file import ModelFile, load_model
from crash_replay.bag import write_bag
from crash_replay.recording import Recording
from crash_replay.synthetic.hidden.cases import draw_case

SEED, RATE, NOISE = 3, 2000.0, 0.5  # Hz, g: one draw of each, taken as it came
SENSOR = {"m/s^2": NOISE * G, "N": 3000.0}
"""Standard deviation of what the generator adds; the force's is that of its barrier."""

STRUCTURE = {"load_path": "dummy"}
"""Where each effect is hidden, if not in `frontal`: there all of its bodies are joined."""

TOLD = {"viscous_damping": "dummy", "quadratic_damping": "dummy", "coulomb_friction": "dummy", "load_path": "dummy"} | {
    effect: "frontal" for effect in ("added_mass", "unmodelled_body", "constant_force", "channel_gain", "channel_offset")
}
"""What an estimator tells from a stiffness that may change at every sample, and where. Left out is what follows the crush as
such a stiffness does (rate_hardening, cubic_stiffness, bottoming_out, plastic_unloading): it takes a part of them, and
their sigma, which takes its changes for random, is too small. The search of `diagnose` is for those."""

METHODS = ("rls", "mrls", "kalman", "constrained_kalman", "gauss_newton", "gauss_newton_orders", "afmm")

ARRAYS = [name for name in Estimate._fields if name not in ("number", "time_ns", "events", "extra", "extra_std")]


@cache
def hidden(effect: str, structure: str):
    """-> the model without the effect, what was hidden, the recording, and who the effect concerns besides its target."""
    case = draw_case(structure, [effect], SEED)
    recording, _ = case.record(1.0, NOISE, RATE)
    model = ModelFile.model_validate(dict(case.specimen.model)).structure()
    more = {}
    if effect == "unmodelled_body":
        more = {"host": case.specimen.host, "touches": case.specimen.stop[0] if case.specimen.stop else None}
    return model, case.hidden[0], recording, more


def with_it(effect: str, structure: str, coefficient: float | None):
    model, what, recording, more = hidden(effect, structure)
    return add_effect(model, effect, what.target, EFFECTS, recording.test, coefficient, what.shape, **more)


def place_of(effect: str, structure: str) -> str:
    return STRUCTURE.get(effect, structure)


def free_run_misfit(structure, recording: Recording) -> np.ndarray:
    """(q,) RMS of the free run's error in standard deviations of the sensors."""
    estimator = make_estimator(structure, recording.test, "constrained_kalman")
    at_work = applied(structure, recording.test)
    simulated = free_run(at_work, estimator.description, run(estimator, recording.samples()))
    sensor = np.array([SENSOR[unit] for unit in structure.equation_units])
    return np.sqrt(np.nanmean((simulated.predicted - simulated.measured) ** 2, axis=0)) / sensor


def last_of(structure, recording: Recording, method: str = "constrained_kalman", **settings):
    """-> name -> (value, std, status) after the last sample."""
    estimator = make_estimator(structure, recording.test, method, **settings)
    last = run(estimator, recording.samples())[-1]
    return {n: found for n, *found in zip(estimator.description.parameters, last.parameters, last.std, last.status)}


def parameter_of(effect: str, target: str) -> str:
    """A load path and an unloading line are parts of an element already; the others bring a parameter of their own."""
    return target + {"load_path": ".stiffness", "plastic_unloading": ".unloading"}.get(effect, f".{effect}")


@pytest.mark.parametrize("effect", EFFECTS)
def test_with_the_known_effect_the_free_run_s_error_falls_to_the_noise(effect):
    place = place_of(effect, "frontal")
    model, what, recording, _ = hidden(effect, place)
    before, after = (free_run_misfit(m, recording) for m in (model, with_it(effect, place, what.coefficient)))
    worst = np.argmax(before)
    assert after[worst] < 0.6 * before[worst], (before, after)
    if place == "frontal":  # the dummy's curves are followed too coarsely by a free run to come down to the noise
        assert after.max() < 1.5, (before, after)


@pytest.mark.parametrize("effect", TOLD)
def test_an_unknown_coefficient_is_estimated_within_its_own_sigmas(effect):
    _, what, recording, _ = hidden(effect, TOLD[effect])
    value, std, status = last_of(with_it(effect, TOLD[effect], None), recording)[parameter_of(effect, what.target)]
    assert status != ParameterStatus.KNOWN
    assert 0.0 < std < 0.5 * abs(what.coefficient)
    assert abs(value - what.coefficient) < 3.0 * std, (value, what.coefficient, std)


PUSHES = {
    "viscous_damping": (lambda x, v: v, 40.0, {}),
    "quadratic_damping": (lambda x, v: v * abs(v), 30.0, {}),
    "coulomb_friction": (lambda x, v: np.tanh(v / 0.2), 150.0, {"speed": 0.2}),
    "cubic_stiffness": (lambda x, v: x**3, 4.0e6, {}),
    "bottoming_out": (lambda x, v: np.maximum(x - 0.03, 0.0), 3.0e4, {"stop": 0.03}),
}
"""Force per unit over crush and rate as in the effects' equations, a size beside a spring of 20 kN/m, shape constants."""


def pushed(force, noise: float) -> Recording:
    """The vibration with one force more on the body: its motion is recorded, so any force goes with it."""
    plain = oscillator_recording(damping=0.0, noise=noise)
    values = plain.values.copy()
    after = plain.time_ns >= 0
    values[after, 0] -= force(values[after, 1], values[after, 2]) / 10.0
    return Recording(plain.test, plain.time_ns, values)


SPRING = Coefficient(1.0e4, estimated=True, shape="constant")  # one free in crush would take its share


@pytest.mark.parametrize("effect", PUSHES)
@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_beside_a_constant_spring_every_force_is_recovered(effect, noise):
    law, size, shape = PUSHES[effect]
    recording = pushed(lambda x, v: size * law(x, v), noise)
    found = last_of(add_effect(oscillator(SPRING), effect, "spring", shape=shape), recording)
    for name, truth in ((f"spring.{effect}", size), ("spring.stiffness", 2.0e4)):
        value, std, _ = found[name]
        # without noise: up to the prior, and to the zero offset of 50 samples
        assert abs(value - truth) < (3.0 * std if noise else 1e-4 * truth), (name, value, truth, std)


def test_rate_hardening_is_recovered_as_c_of_one_plus_c_h():
    # F = K X (1 + V / D) while V > 0, exponent 1
    recording = pushed(lambda x, v: 2.0e4 * x * np.maximum(v, 0.0) / 20.0, noise=1.0)
    model = add_effect(oscillator(SPRING), "rate_hardening", "spring", shape={"exponent": 1.0})
    value, std, _ = last_of(model, recording)["spring.rate_hardening"]
    assert std < 0.3 / 20.0
    assert abs(value - 1.0 / 20.0) < 3.0 * std


def median_innovation(structure, recording: Recording, method: str):
    """-> of the pelvis's equation, m/s^2, with the estimator and its last estimate.

    The median: where contact ends, a method that forgets may miss a single sample by any amount.
    """
    estimator = make_estimator(structure, recording.test, method)
    estimates = run(estimator, recording.samples())
    row = estimator.description.equations.index("pelvis")  # what the friction on door_pelvis pushes
    innovation = [abs(e.innovation[row]) for e in estimates if e.time_ns > 0]
    return float(np.median(innovation)), estimator.description, estimates[-1]


@pytest.mark.parametrize("method", METHODS)
def test_every_method_honours_an_effect_known_or_not(method):
    model, what, recording, _ = hidden("coulomb_friction", "dummy")
    without, _, _ = median_innovation(model, recording, method)
    known, description, last = median_innovation(with_it("coulomb_friction", "dummy", what.coefficient), recording, method)
    index = description.parameters.index(parameter_of("coulomb_friction", what.target))
    assert_allclose(last.parameters[index], what.coefficient, rtol=1e-12)  # afmm's is a mean of equal values
    assert last.std[index] < 1e-9 * what.coefficient and last.status[index] == ParameterStatus.KNOWN
    assert known < 0.9 * without
    unknown, description, last = median_innovation(with_it("coulomb_friction", "dummy", None), recording, method)
    assert description.parameter_units[index] == "N"
    assert last.status[index] != ParameterStatus.KNOWN and last.std[index] > 0.0
    assert np.isfinite(last.parameters).all()
    if "kalman" in method:  # one that forgets within 5 ms, or lets all jump, cannot hold on to a constant
        assert unknown < 0.1 * without


@pytest.mark.parametrize("method", METHODS)
def test_a_known_coefficient_of_zero_changes_nothing(method):
    model, what, recording, _ = hidden("quadratic_damping", "dummy")
    recording = Recording(recording.test, recording.time_ns[:160], recording.values[:160])
    bare, idle = (
        run(make_estimator(m, recording.test, method, compiled=False), recording.samples())
        for m in (model, with_it("quadratic_damping", "dummy", 0.0))
    )
    p = len(bare[0].parameters)
    for found, expected in (
        ([e.parameters[:p] for e in idle], [e.parameters for e in bare]),
        ([e.innovation for e in idle], [e.innovation for e in bare]),
    ):
        # one column of zeros more: sums are rounded in another order
        assert_allclose(found, expected, rtol=0.0, atol=1e-9 * np.nanmax(np.abs(expected)))


def test_a_damper_from_an_effect_is_the_model_s_own_damper():
    recording = oscillator_recording(noise=0.3)
    known = add_effect(oscillator(), "viscous_damping", "spring", coefficient=50.0)
    own = oscillator(damping=Coefficient(50.0))
    for method in ("rls", "constrained_kalman", "gauss_newton"):
        found, expected = (run(make_estimator(m, recording.test, method), recording.samples()) for m in (known, own))
        assert_allclose([e.innovation for e in found], [e.innovation for e in expected], rtol=0.0, atol=1e-8)
        assert_allclose([e.force for e in found], [e.force for e in expected], rtol=0.0, atol=1e-7)


KNOWN_PARTS = {
    "load_path": ("rib-pelvis", 7.0e4),
    "plastic_unloading": ("door_pelvis", 4.0e5),
    "added_mass": ("pelvis", 5.0),
    "channel_gain": ("rib_ay", 0.05),
    "channel_offset": ("door_upper_ay", 10.0),
}
"""Known effects that leave a model of springs and dampers: the compiled recursion follows it."""


@pytest.mark.parametrize("method", ["rls", "mrls", "kalman", "constrained_kalman"])
def test_both_forms_agree_wherever_there_is_a_compiled_one(method):
    model, _, recording, _ = hidden("load_path", "dummy")
    for effect, (target, coefficient) in KNOWN_PARTS.items():
        model = add_effect(model, effect, target, EFFECTS, recording.test, coefficient)
    # as many samples remembered as at 10 kHz, and gentle rewinds: where the covariance grows by 1e7, or a large cr multiplies
    # rounding by itself at each pass, the two would part by that alone
    settings = {"rls": {"memory": 0.025}, "mrls": {"memory": 0.025, "cr": 1.5}}.get(method, {})
    readable, compiled = (make_estimator(model, recording.test, method, compiled=c, **settings) for c in (False, True))
    assert isinstance(compiled, Corrected) and isinstance(compiled.estimator, CompiledEstimator)
    assert not isinstance(readable.estimator, CompiledEstimator)
    expected, found = (run(e, recording.samples()) for e in (readable, compiled))
    for field in ARRAYS:
        a, b = (np.array([getattr(e, field) for e in es], dtype=float) for es in (expected, found))
        assert_allclose(b, a, rtol=0.0, atol=1e-8 * (np.nanmax(np.abs(a)) or 1.0), err_msg=field)


@pytest.mark.parametrize("effect", ["coulomb_friction", "clearance", "rate_hardening", "constant_force", "unmodelled_body"])
def test_where_there_is_no_compiled_form_the_readable_one_is_taken(effect):
    _, what, recording, _ = hidden(effect, "frontal")
    estimator = make_estimator(with_it(effect, "frontal", what.coefficient), recording.test, "constrained_kalman")
    assert not isinstance(estimator, CompiledEstimator)


def test_a_late_channel_is_brought_back_in_time():
    # an estimate is of the instant five samples before its own
    recording = oscillator_recording(noise=0.0)  # the zero offset is exact, of however many samples
    late = 5 * 100_000  # ns: five samples
    model = add_effect(oscillator(damping=Coefficient(50.0)), "channel_delay", "block_ax", coefficient=late * 1e-9)
    shifted = recording.values.copy()
    shifted[5:, 0], shifted[:5, 0] = recording.values[:-5, 0], recording.values[0, 0]
    delayed = Recording(recording.test, recording.time_ns, shifted)
    found = run(make_estimator(model, delayed.test, "constrained_kalman"), delayed.samples())
    on_time = remove_effect(model, "channel_delay", "block_ax")
    plain = run(make_estimator(on_time, recording.test, "constrained_kalman"), recording.samples())
    assert_allclose([e.measured for e in found[60:]], [e.measured for e in plain[55:-5]], rtol=0.0, atol=1e-9)
    assert_allclose([e.crush for e in found[60:]], [e.crush for e in plain[55:-5]], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("effect", EFFECTS)
def test_added_and_removed_it_is_the_model_as_before(effect):
    place = place_of(effect, "frontal")
    model, what, recording, more = hidden(effect, place)
    first = add_effect(model, "constant_force", model.bodies[0].name) if effect != "constant_force" else model
    there = add_effect(first, effect, what.target, EFFECTS, recording.test, what.coefficient, what.shape, **more)
    assert there.effects[-1].type == effect and there != first
    assert remove_effect(there, effect, what.target) == first
    assert first.effects == there.effects[:-1]
    with pytest.raises(ModelError, match=f"effect {effect} acts on {what.target} already"):
        add_effect(there, effect, what.target, EFFECTS, recording.test)


@pytest.mark.parametrize(
    "change, line",
    [
        (lambda m: add_effect(m, "coulomb_frction", "spring"), "no effect 'coulomb_frction'; did you mean 'coulomb_friction'"),
        (lambda m: add_effect(m, "coulomb_friction", "sprng"), "cannot act on 'sprng'; .*did you mean 'spring'"),
        (lambda m: add_effect(m, "added_mass", "wall"), "needs a free body: there are block"),
        (lambda m: add_effect(m, "channel_gain", "nothing_like_it"), "needs a channel: there are block_ax"),
        (lambda m: add_effect(m, "coulomb_friction", "spring", shape={"sped": 1.0}), "no shape constant 'sped'; it has speed"),
        (lambda m: add_effect(m, "coulomb_friction", "spring", coefficient=-1.0), "must be not below 0 N, got -1"),
        (lambda m: remove_effect(m, "added_mass", "block"), "no effect added_mass on block to remove; its effects: none"),
    ],
)
def test_a_mistake_is_one_line_that_says_what_there_is(change, line):
    with pytest.raises(ModelError, match=line) as error:
        change(oscillator())
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "effect, target, wants",
    [("clearance", "spring", "coefficient, in m"), ("channel_delay", "block_ax", "coefficient, in s"), ("bottoming_out", "spring", "stop, in m")],
)
@pytest.mark.parametrize("method", ["rls", "constrained_kalman", "afmm"])
def test_what_no_equation_is_linear_in_must_be_given(method, effect, target, wants):
    model, test = add_effect(oscillator(), effect, target), oscillator_recording(n=10).test
    with pytest.raises(ModelError, match=f"{effect} on {target} needs its {wants}.*diagnose --apply"):
        make_estimator(model, test, method)


def test_ones_own_effect_is_estimated_like_ours():
    recording = oscillator_recording(damping=0.0, noise=0.3)
    own = {"cubic_damping": ElementForce("cubic_damping", "N*s^3/m^3", force=lambda motion: motion.rate**3)}
    effects = EFFECTS | own
    model = add_effect(oscillator(), "cubic_damping", "spring", effects)
    found = last_of(model, recording, effects=effects)
    value, std, _ = found["spring.cubic_damping"]
    assert abs(value) < 3.0 * std  # there is none of it in the recording
    with pytest.raises(ModelError, match="there is no effect 'cubic_damping'"):
        make_estimator(model, recording.test, "rls")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("effects")


def command(monkeypatch, module, *arguments) -> int:
    monkeypatch.setattr("sys.argv", [module.__name__, *map(str, arguments)])
    with pytest.raises(SystemExit) as exit_:
        module.main()
    return exit_.value.code


@pytest.mark.parametrize("effect", EFFECTS)
def test_what_a_diagnosis_writes_is_estimated(monkeypatch, capsys, folder, effect):
    place = place_of(effect, "frontal")
    _, what, recording, _ = hidden(effect, place)
    spec = with_it(effect, place, what.coefficient).effects[-1]
    content = dict(draw_case(place, [effect], SEED).specimen.model)
    content = {**content, "effects": [_entry(spec, EFFECTS[effect], list(content["bodies"]))]}
    model, bag = folder / f"{effect}.yaml", folder / f"{effect}.mcap"
    with model.open("w") as file:
        YAML(typ="safe").dump(content, file)
    (read,) = load_model(model).effects
    assert (read.type, read.target, read.host, read.touches) == (spec.type, spec.target, spec.host, spec.touches)
    assert_allclose(read.coefficient, spec.coefficient, rtol=1e-5)  # six digits are written
    write_bag(recording, bag)
    assert command(monkeypatch, estimate, bag, "--model", model) == 0
    assert what.target.split("-")[0] in capsys.readouterr().out or effect.startswith("channel")


def test_simulate_and_report_honour_the_effect(monkeypatch, capsys, folder):
    model, bag = folder / "viscous_damping.yaml", folder / "viscous_damping.mcap"
    bare = folder / "bare.yaml"
    content = YAML(typ="safe").load(model.read_text())
    with bare.open("w") as file:
        YAML(typ="safe").dump({k: v for k, v in content.items() if k != "effects"}, file)
    assert command(monkeypatch, simulate, bag, "--model", bare, "--json", folder / "bare.json") == 0
    assert command(monkeypatch, simulate, bag, "--model", model, "--json", folder / "with.json") == 0
    errors = [
        json.loads((folder / f"{name}.json").read_text())["comparisons"]["engine"]["rms"] for name in ("bare", "with")
    ]
    assert errors[1] < 0.5 * errors[0]
    assert command(monkeypatch, report, bag, "--model", model, "--to", folder / "page") == 0
    assert "viscous_damping" in (folder / "page" / "report.md").read_text()
