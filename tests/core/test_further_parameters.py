"""Higher powers of crush and rate (equation 4.1), an estimated unloading slope, damping after stiffness (7.3)."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from helpers_estimation import oscillator, oscillator_recording
from numpy.testing import assert_allclose, assert_array_equal

from crash_estimator.core.estimate import ParameterStatus
from crash_estimator.core.estimators.damping_later import DampingLater, LaterState
from crash_estimator.core.estimators.update import Update
from crash_estimator.core.fold import run
from crash_estimator.core.methods import make_estimator
from crash_estimator.core.regression import Further, Regression
from crash_estimator.core.structure import Coefficient, Structure, Term
from crash_estimator.model_file import load_model
from crash_replay.recording import Recording, RecordingError


def constant(initial, std, **more):
    return Coefficient(initial, True, std=std, drift=0.0, **more)


def with_element(structure: Structure, **changes) -> Structure:
    return replace(structure, elements=(replace(structure.elements[0], **changes),))


def recording_of(force, noise=0.0, seed=0, n=400, pre=50):
    """The oscillator's channels with the motion X = 0.05 sin(w t) and the force that a law gives at it."""
    recording = oscillator_recording(n=n, pre=pre)
    t = np.maximum(recording.time, 0.0)
    travel, speed = 0.05 * np.sin(60.0 * t), 3.0 * np.cos(60.0 * t)
    a = np.where(recording.time_ns < 0, 0.0, -force(travel, speed) / 10.0)
    a += noise * np.random.default_rng(seed).standard_normal(len(t))
    return Recording(recording.test, recording.time_ns, np.column_stack([a, travel, speed]))


POWERS = (
    Term("crush", 2, constant(0.0, 1e6)),
    Term("crush", 3, constant(0.0, 1e8)),
    Term("rate", 2, constant(0.0, 100.0)),
)


@pytest.mark.parametrize(("method", "settings"), [("rls", {}), ("kalman", {"noise_memory": 0})])
def test_every_power_is_found_without_noise(method, settings):
    structure = with_element(oscillator(constant(1e4, 1e5), constant(0.0, 100.0)), terms=POWERS)
    recording = recording_of(lambda x, v: 2e4 * x + 3e5 * x * abs(x) + 4e6 * x**3 + 30.0 * v + 5.0 * v * abs(v))
    estimator = make_estimator(structure, recording.test, method, **settings)
    last = run(estimator, recording.samples())[-1]
    assert estimator.description.parameters[2:] == ("spring.stiffness2", "spring.stiffness3", "spring.damping2")
    assert estimator.description.parameter_units[2:] == ("N/m^2", "N/m^3", "N*(s/m)^2")
    assert_allclose(last.parameters, [2e4, 30.0, 3e5, 4e6, 5.0], rtol=1e-4)
    assert_allclose(last.residual, 0.0, atol=1e-3)


def test_a_known_power_is_known():
    structure = with_element(oscillator(constant(1e4, 1e5)), terms=(Term("crush", 3, Coefficient(4e6)),))
    recording = recording_of(lambda x, v: 2e4 * x + 4e6 * x**3)
    last = run(make_estimator(structure, recording.test, "rls"), recording.samples())[-1]
    assert_allclose(last.parameters, [2e4, 0.0, 4e6], rtol=1e-6)
    assert last.status[2] == ParameterStatus.KNOWN


def plastic(x, v, stiffness=2e4, slope=9e4):
    """Loading on K X up to the peak, then down the line and up again on it; X is a sine, its peak 0.05 m."""
    peak = np.maximum.accumulate(np.maximum(x, 0.0))
    return np.where(x < peak, np.maximum(stiffness * peak - slope * (peak - x), 0.0), stiffness * x)


@pytest.mark.parametrize("method", ["rls", "constrained_kalman"])
def test_an_unloading_slope_is_estimated(method):
    """Within three sigma, and 2 %; it is not touched before the unloading begins."""
    structure = with_element(
        oscillator(constant(1e4, 1e4, min=0.0)), tension=False, unloading_slope=constant(4e4, 4e4, min=0.0)
    )
    recording = recording_of(plastic, noise=1.0, pre=1000)  # so many that the zero offset's error does not count
    estimator = make_estimator(structure, recording.test, method, **({"forgetting": 1.0} if method == "rls" else {}))
    estimates = run(estimator, recording.samples())
    assert estimator.description.parameters == ("spring.stiffness", "spring.damping", "spring.unloading")
    loading = [e for e in estimates if 0 < e.time_ns * 1e-9 < 0.026]
    assert_array_equal([e.parameters[2] for e in loading], 4e4)
    last = estimates[-1]
    assert_allclose(last.parameters[[0, 2]], [2e4, 9e4], rtol=0.02)
    assert (np.abs(last.parameters[[0, 2]] - [2e4, 9e4]) < 3.0 * last.std[[0, 2]]).all()
    kinds = [event.kind for e in estimates for event in e.events if event.kind in ("loading", "unloading", "apart")]
    assert kinds[:3] == ["loading", "unloading", "apart"]


def test_damping_is_held_until_the_stiffness_is_known_and_then_found():
    structure = oscillator(constant(1e4, 1e4), constant(0.0, 200.0))
    recording = oscillator_recording(stiffness=2e4, damping=60.0, noise=2.0, n=900, pre=0)  # no zero is removed
    settings = dict(memory=0.02)
    together = run(make_estimator(structure, recording.test, "rls", **settings), recording.samples())
    later = run(make_estimator(structure, recording.test, "rls", damping_after=0.01, **settings), recording.samples())
    released = [(k, e) for k, estimate in enumerate(later) for e in estimate.events if e.kind == "released"]
    assert len(released) == 1 and released[0][1].target == "spring.damping"
    k = released[0][0]
    assert_array_equal([e.parameters[1] for e in later[:k]], 0.0)
    assert later[k - 1].std[0] / later[k - 1].parameters[0] < 0.01
    assert_allclose(later[-1].parameters, [2e4, 60.0], rtol=0.05)
    assert (np.abs(later[-1].parameters - together[-1].parameters) < together[-1].std).all()


def test_the_keys_of_a_model_file(tmp_path):
    text = """\
name: powers
bodies:
  block: {mass: 10, acceleration: block_ax}
  wall: {fixed: true}
elements:
  spring:
    between: [block, wall]
    stiffness: {estimate: true}
    unloading: {estimate: true, initial: 4.0e4, min: 0}
    crush_terms: {3: {estimate: true, initial: 0.0}}
    rate_terms: {2: 5.0}
"""
    path = tmp_path / "model.yaml"
    path.write_text(text)
    structure = load_model(path)
    assert [p.name for p in structure.parameters] == [
        "spring.stiffness", "spring.damping", "spring.stiffness3", "spring.damping2", "spring.unloading",
    ]  # fmt: skip
    assert not structure.first_order and structure.elements[0].terms[1].coefficient.value == 5.0
    path.write_text(text.replace("{3:", "{1:"))
    with pytest.raises(RecordingError, match="powers from 2 to 9"):
        load_model(path)
    path.write_text(text.replace("initial: 4.0e4, ", ""))
    with pytest.raises(RecordingError, match="`estimate: true` with an `initial` value above 0"):
        load_model(path)


def test_a_secant_has_its_higher_powers_of_the_largest_crush():
    """F = K x + K3 x^3 has the secant K + K3 x^2."""
    further = SimpleNamespace(of_crush=np.array([False, True]), element=np.array([0, 0]), power=np.array([1, 3]))
    found = Further.secant(further, np.array([1e5]), np.array([1e5, 4e6]), np.array([0.2]))
    assert_allclose(found, 1e5 + 4e6 * 0.2**2)


@pytest.mark.parametrize("waits", [True, False])
def test_a_sample_that_tells_only_of_a_damping_that_waits_changes_nothing(waits):
    settings = SimpleNamespace(names=("e.stiffness", "e.damping"))
    given = []
    update = Update(np.array([2.0, 3.0]), np.eye(2), np.eye(1), np.zeros(2, bool))
    method = SimpleNamespace(
        settings=settings, update=lambda inner, reduced: given.append(reduced) or ("after", update)
    )
    std = np.array([1.0, 1.0])
    state = LaterState("before", np.array([False, waits]), np.array([2.0, 1.0]), std)
    for psi, tells in (([0.0, 4.0], not waits), ([5.0, 4.0], True)):
        regression = Regression(*np.zeros((1, 1)), np.array([psi]), np.array([7.0]), np.ones(2, bool), *np.ones((3, 1)))
        after, _ = DampingLater(method, 0.1).update(state, regression)
        assert after.inner == ("after" if tells else "before")
    assert given[-1].gradient.tolist() == [[5.0, 0.0 if waits else 4.0]]
