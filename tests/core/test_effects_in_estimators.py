"""Effects of a model file in the recursive estimators: known on the left side, unknown as one parameter more."""

from dataclasses import fields, replace
from functools import cache

import numpy as np
import pytest
from helpers_effects import SEED, SENSOR, hidden, last_of, parameter_of, place_of, with_it
from helpers_estimation import oscillator, oscillator_recording
from numpy.testing import assert_allclose

from crash_estimator.core.compiled.estimator import CompiledEstimator
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.applied import applied
from crash_estimator.core.effects.change import add_effect, remove_effect
from crash_estimator.core.effects.channels import Corrected
from crash_estimator.core.estimate import Estimate, ParameterStatus
from crash_estimator.core.fold import run
from crash_estimator.core.free_run import free_run
from crash_estimator.core.methods import make_estimator
from crash_estimator.core.structure import Body, Coefficient, EffectSpec, ModelError
from crash_replay.recording import Recording
from crash_replay.synthetic.hidden.vocabulary import VOCABULARY

IN_DUMMY = ("viscous_damping", "quadratic_damping", "coulomb_friction", "load_path")
IN_FRONTAL = ("added_mass", "unmodelled_body", "constant_force", "channel_gain", "channel_offset")
TOLD = dict.fromkeys(IN_DUMMY, "dummy") | dict.fromkeys(IN_FRONTAL, "frontal")
"""What an estimator tells from a stiffness that may change at every sample, and where. Left out is what follows the
crush as such a stiffness does (rate_hardening, cubic_stiffness, bottoming_out, plastic_unloading): it takes a part of
them, and their sigma, which takes its changes for random, is too small. The search of `diagnose` is for those."""


METHODS = ("rls", "mrls", "kalman", "constrained_kalman", "gauss_newton", "gauss_newton_orders", "afmm")
SETTINGS = {"gauss_newton_orders": {"largest": 1}}
"""Of methods: a bank of four says what one of nine does."""


ARRAYS = [one.name for one in fields(Estimate) if one.type is np.ndarray]


def free_run_misfit(structure, recording: Recording) -> np.ndarray:
    """(q,) RMS of the free run's error in standard deviations of the sensors."""
    estimator = make_estimator(structure, recording.test, "constrained_kalman")
    at_work = applied(structure, recording.test)
    simulated = free_run(at_work, estimator.description, run(estimator, recording.samples()))
    sensor = np.array([SENSOR[unit] for unit in structure.equation_units])
    return np.sqrt(np.nanmean((simulated.predicted - simulated.measured) ** 2, axis=0)) / sensor


@pytest.mark.parametrize("effect", VOCABULARY)
def test_with_the_known_effect_the_free_run_s_error_falls(effect):
    place = place_of(effect)
    model, what, recording, _ = hidden(effect, place)
    before, after = (free_run_misfit(m, recording) for m in (model, with_it(effect, place, what.coefficient)))
    worst = np.argmax(before)
    assert after[worst] < 0.6 * before[worst], (before, after)
    # to the noise in frontal only: where two curves share one balance, as of the dummy's elements or of a car and what
    # is mounted in it, a stiffness that follows the samples may put their force into either: the free run misses both
    # hysteresis is hidden by two dry sliders too, which are not quite the law that the estimators know
    if place == "frontal" and effect != "hysteresis":
        assert np.sqrt(np.mean(after**2)) < 1.5, (before, after)


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
    # 4 of its prior's sigmas; 15 would be pulled back by one of its own
    "cubic_stiffness": (lambda x, v: x**3, 1.0e6, {}),
    "bottoming_out": (lambda x, v: np.maximum(x - 0.03, 0.0), 3.0e4, {"stop": 0.03}),
}
"""Force per unit over crush and rate, as the equations say; a size beside a spring of 20 kN/m; shape constants."""


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


@pytest.mark.parametrize("stated", [1.4e4, 2.6e4])
def test_by_how_much_a_stated_stiffness_is_off_is_estimated(stated):
    model = add_effect(oscillator(Coefficient(stated)), "added_stiffness", "spring")
    value, std, status = last_of(model, oscillator_recording(damping=0.0, noise=1.0))["spring.added_stiffness"]
    assert status != ParameterStatus.KNOWN and std < 300.0
    assert abs(value - (2.0e4 - stated)) < 3.0 * std


def test_rate_hardening_is_recovered_as_c_of_one_plus_c_h():
    # F = K X (1 + V / D) while V > 0, exponent 1
    recording = pushed(lambda x, v: 2.0e4 * x * np.maximum(v, 0.0) / 20.0, noise=1.0)
    model = add_effect(oscillator(SPRING), "rate_hardening", "spring", shape={"exponent": 1.0})
    value, std, _ = last_of(model, recording)["spring.rate_hardening"]
    assert std < 0.3 / 20.0
    assert abs(value - 1.0 / 20.0) < 3.0 * std


@cache
def median_innovation(method: str, friction: str, seed: int = SEED):
    """-> of the pelvis's equation, m/s^2, with the estimator and its last estimate; friction: none, known or unknown.

    The median: where contact ends, a method that forgets may miss a single sample by any amount.
    """
    structure, what, recording, _ = hidden("coulomb_friction", "dummy", seed)
    if friction != "none":
        coefficient = what.coefficient if friction == "known" else None
        structure = with_it("coulomb_friction", "dummy", coefficient, seed)
    estimator = make_estimator(structure, recording.test, method, **SETTINGS.get(method, {}))
    estimates = run(estimator, recording.samples())
    row = estimator.description.equations.index("pelvis")  # what the friction on door_pelvis pushes
    innovation = [abs(e.innovation[row]) for e in estimates if e.time_ns > 0]
    return float(np.median(innovation)), estimator.description, estimates[-1]


@pytest.mark.parametrize("method", METHODS)
def test_every_method_honours_an_effect_known_or_not(method):
    _, what, _, _ = hidden("coulomb_friction", "dummy")
    without, _, _ = median_innovation(method, "none")
    known, description, last = median_innovation(method, "known")
    index = description.parameters.index(parameter_of("coulomb_friction", what.target))
    assert_allclose(last.parameters[index], what.coefficient, rtol=1e-12)  # afmm's is a mean of equal values
    assert last.std[index] < 1e-9 * what.coefficient and last.status[index] == ParameterStatus.KNOWN
    if "gauss_newton" not in method:  # for one of those see below
        assert known < 0.9 * without
    unknown, description, last = median_innovation(method, "unknown")
    assert description.parameter_units[index] == "N"
    assert last.status[index] != ParameterStatus.KNOWN and last.std[index] > 0.0
    assert np.isfinite(last.parameters).all()
    if "kalman" in method:  # one that forgets within 5 ms, or lets all jump, cannot hold on to a constant
        assert unknown < 0.1 * without


def test_a_known_friction_helps_one_with_a_noise_model_too():
    """The mean of four draws: the noise model takes up much of what a friction leaves, in one of them nearly all. A
    bank of such estimators says what one of them does."""
    ratios = []
    for seed in range(SEED, SEED + 4):
        known, without = (median_innovation("gauss_newton", friction, seed)[0] for friction in ("known", "none"))
        ratios.append(known / without)
    assert np.exp(np.mean(np.log(ratios))) < 0.9, ratios


@pytest.mark.parametrize("method", METHODS)
def test_a_known_coefficient_of_zero_changes_nothing(method):
    model, what, recording, _ = hidden("quadratic_damping", "dummy")
    recording = Recording(recording.test, recording.time_ns[:160], recording.values[:160])
    settings = SETTINGS.get(method, {})
    bare, idle = (
        run(make_estimator(m, recording.test, method, compiled=False, **settings), recording.samples())
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
    recording = oscillator_recording(noise=0.3, n=100)
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
    # as many samples remembered as at 10 kHz, and gentle rewinds: where the covariance grows by 1e7, or a large cr
    # multiplies rounding by itself at each pass, the two would part by that alone
    settings = {"rls": {"memory": 0.025}, "mrls": {"memory": 0.025, "cr": 1.5}}.get(method, {})
    readable, compiled = (make_estimator(model, recording.test, method, compiled=c, **settings) for c in (False, True))
    assert isinstance(compiled, Corrected) and isinstance(compiled.estimator, CompiledEstimator)
    assert not isinstance(readable.estimator, CompiledEstimator)
    expected, found = (run(e, recording.samples()) for e in (readable, compiled))
    for e in expected:  # what is held at a bound is so in every part of the covariance
        scale = np.where(e.std > 0.0, e.std, 1.0)
        assert np.linalg.eigvalsh(e.covariance / np.outer(scale, scale)).min() > -1e-6, e.time_ns
    for field in ARRAYS:
        a, b = (np.array([getattr(e, field) for e in es], dtype=float) for es in (expected, found))
        assert_allclose(b, a, rtol=0.0, atol=1e-8 * (np.nanmax(np.abs(a)) or 1.0), err_msg=field)


@pytest.mark.parametrize("effect", ["coulomb_friction", "clearance", "rate_hardening", "constant_force"])
def test_where_there_is_no_compiled_form_the_readable_one_is_taken(effect):
    _, what, recording, _ = hidden(effect, "frontal")
    estimator = make_estimator(with_it(effect, "frontal", what.coefficient), recording.test, "constrained_kalman")
    assert not isinstance(estimator, CompiledEstimator)


def test_a_measured_force_s_zero_is_looked_for_as_far_as_accelerations_of_all_free_bodies_would_be():
    block, _ = oscillator().bodies
    bodies = (block, replace(block, name="load", mass=5.0, acceleration=("load_ax",)))
    structure = replace(oscillator(), bodies=(*bodies, Body("wall", fixed=True, force="wall_fx")))
    offset = EFFECTS["channel_offset"]
    for channel in ("block_ax", "wall_fx"):
        structure = offset.put_to_work(structure, None, EffectSpec("channel_offset", channel))
    of_block, of_wall = structure.actions
    assert (of_block.unit, of_wall.unit) == (offset.unit, "N")
    assert of_wall.scale == pytest.approx((10.0 + 5.0) * of_block.scale)


def test_a_zero_that_drifts_is_taken_out():
    recording = oscillator_recording(noise=0.0)
    after = np.maximum(recording.time_ns, 0) * 1e-9
    values = recording.values.copy()
    values[:, 0] += 3.0 * after / 0.1
    channel = recording.test.channels[0].name
    model = replace(oscillator(), effects=(EffectSpec("channel_offset", channel, 3.0, variant="drift"),))
    drifted = Recording(recording.test, recording.time_ns, values)
    found = run(make_estimator(model, drifted.test, "rls"), drifted.samples())
    plain = run(make_estimator(oscillator(), recording.test, "rls"), recording.samples())
    assert_allclose([e.measured for e in found], [e.measured for e in plain], rtol=0.0, atol=1e-9)


def test_a_drift_cannot_be_followed_and_other_effects_have_no_such_form():
    recording = oscillator_recording(noise=0.0)
    channel = recording.test.channels[0].name
    for spec, said in (
        (EffectSpec("channel_offset", channel, variant="drift"), "coefficient, in m/s"),
        (EffectSpec("channel_gain", channel, 0.05, variant="drift"), "channel_gain has no form 'drift'; leave it out"),
        (EffectSpec("channel_offset", channel, 3.0, variant="ramp"), "has no form 'ramp'; it has drift"),
    ):
        with pytest.raises(ModelError, match=said):
            make_estimator(replace(oscillator(), effects=(spec,)), recording.test, "rls")


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
