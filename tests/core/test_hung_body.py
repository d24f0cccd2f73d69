"""A mass that hangs on a body: how it swings, and what estimators and free runs make of it."""

import numpy as np
import pytest
from helpers_effects import last_of
from helpers_hung import CAR, DAMPING, ENGINE, FREQUENCY, crash, hung_model
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.applied import applied
from crash_estimator.core.effects.change import add_effect
from crash_estimator.core.fold import run
from crash_estimator.core.free_run import free_run
from crash_estimator.core.hung_body import hung
from crash_estimator.core.methods import make_estimator
from crash_estimator.core.structure import ModelError

SHAPE = {"frequency": FREQUENCY, "damping": DAMPING}


def with_engine(mass: float | None):
    return add_effect(hung_model(), "unmodelled_body", "car", EFFECTS, coefficient=mass, shape=SHAPE, variant="hung")


@pytest.mark.parametrize("damping", [0.0, 0.05, 1.0, 2.5])
def test_it_swings_as_its_equation_says(damping):
    rng = np.random.default_rng(4)
    time = np.concatenate([[0.0], np.cumsum(rng.uniform(1e-4, 2e-3, 300))])
    carrier, w = 200.0 * np.sin(90.0 * time) * np.exp(-8.0 * time), 2.0 * np.pi * 15.0

    def slope(t, state):
        return state[1], -np.interp(t, time, carrier) - w * w * state[0] - 2.0 * damping * w * state[1]

    u, v = solve_ivp(slope, (0.0, time[-1]), (0.01, -0.3), "LSODA", time, rtol=1e-9, atol=1e-12, max_step=1e-4).y
    found, end = hung(np.diff(time, prepend=0.0), carrier, (0.01, -0.3), 15.0, damping)
    assert_allclose(found, -w * w * u - 2.0 * damping * w * v, atol=1e-4)
    assert_allclose(end, (u[-1], v[-1]), atol=1e-6)


def test_sample_by_sample_it_is_where_the_whole_record_says():
    recording = crash(12.0, 1)
    estimator = make_estimator(applied(with_engine(ENGINE), recording.test), recording.test, "mrls")
    after = recording.time >= 0.0
    time, a = recording.time[after], np.array([one.acceleration for one in run(estimator, recording.samples())])[after]
    assert_allclose(a[:, 2], hung(np.diff(time, prepend=0.0), a[:, 0], (0.0, 0.0), **SHAPE)[0], rtol=1e-9, atol=1e-6)


def test_known_it_makes_the_free_run_s_error_fall():
    recording, errors = crash(12.0, 2), []
    for structure in (hung_model(), with_engine(ENGINE)):
        estimator = make_estimator(structure, recording.test, "constrained_kalman")
        estimates = run(estimator, recording.samples())
        simulated = free_run(applied(structure, recording.test), estimator.description, estimates)
        errors.append(np.sqrt(np.nanmean((simulated.predicted - simulated.measured) ** 2, axis=0)))
    assert (errors[1] < 0.3 * errors[0]).all(), errors


def test_its_mass_is_estimated():
    value, std, _ = last_of(with_engine(None), crash(12.0, 3))["car.unmodelled_body"]
    assert 0.0 < std < 0.2 * ENGINE and abs(value - ENGINE) < 3.0 * std, (value, std)


def test_a_part_of_its_carrier_s_mass_is_taken_from_that():
    spec = {"coefficient": 50.0, "shape": SHAPE, "variant": "hung", "taken_from": "car"}
    structure = add_effect(hung_model(), "unmodelled_body", "car", EFFECTS, **spec)
    assert applied(structure, crash(12.0, 1).test).bodies[0].mass == CAR - 50.0


def test_no_estimator_takes_a_frequency_for_granted():
    structure = add_effect(hung_model(), "unmodelled_body", "car", EFFECTS, variant="hung")
    with pytest.raises(ModelError, match="unmodelled_body on car needs its frequency, in Hz, which no estimator can"):
        make_estimator(structure, crash(12.0, 1).test, "mrls")


@pytest.mark.parametrize(
    "target, variant, said",
    [
        ("car", "", "effect unmodelled_body on car needs `form: hung`, or a channel"),
        ("car_ax", "hung", "cannot act on 'car_ax'; it needs a channel or a free body: did you mean 'car'"),
        ("barrier", "hung", "cannot act on 'barrier'; it needs a channel or a free body: "),
    ],
)
def test_what_it_cannot_hang_on_is_said(target, variant, said):
    with pytest.raises(ModelError, match=said):
        add_effect(hung_model(), "unmodelled_body", target, EFFECTS, crash(12.0, 1).test, 50.0, {}, variant=variant)
