"""Effective masses: exact without noise, conserved without a barrier, right on NHTSA 10146, a first stage."""

from dataclasses import replace

import numpy as np
import pytest
from helpers_paths import DATA
from numpy.testing import assert_allclose, assert_array_equal

from crash_estimator.core.estimators.effective_mass import with_effective_masses
from crash_estimator.core.estimators.window import mean_of, widened
from crash_estimator.core.fold import run
from crash_estimator.core.methods import make_estimator
from crash_estimator.core.regression import Regression
from crash_estimator.core.structure import ModelError
from crash_estimator.model_file import load_model
from crash_replay.recording import Channel, Recording, Test

NHTSA = DATA / "nhtsa-10146"


def frontal(masses=(1400.0, 350.0), noise=0.0, seed=0, n=800, pre=100):
    """Two accelerations and the barrier force that balances them: F = -(M1 a1 + M2 a2), from exact formulas."""
    time_ns = np.arange(-pre, n, dtype=np.int64) * 100_000
    t = np.maximum(time_ns * 1e-9, 0.0)
    a = np.column_stack([-250.0 * np.sin(40.0 * t), -400.0 * np.sin(75.0 * t) - 90.0 * np.sin(200.0 * t)])
    random = np.random.default_rng(seed)
    force = -a @ masses + noise * 1500.0 * random.standard_normal(len(t)) * (time_ns >= 0)
    channels = tuple(Channel(name, "acceleration") for name in ("car_ax", "engine_ax")) + (
        Channel("barrier_fx", "force"),
    )
    return Recording(Test("balance", channels), time_ns, np.column_stack([a, force]))


def side(masses=(900.0, 80.0, 1600.0)):
    """Three accelerations whose momentum is conserved; the model's total is the true one, its shares are not."""
    recording = frontal()
    a = recording.values[:, :2] / 3.0
    third = -(a @ masses[:2]) / masses[2]
    channels = tuple(Channel(name, "acceleration") for name in ("mdb_ay", "door_ay", "car_ay"))
    return Recording(Test("collision", channels), recording.time_ns, np.column_stack([a, third]))


def final(recording, model, **settings):
    estimator = make_estimator(load_model(model), recording.test, "effective_mass", **settings)
    return estimator, run(estimator, recording.samples())


def test_an_equation_without_a_valid_sample_has_no_mean():
    """And dividing by nothing is not tried."""
    errors, known = np.zeros(2), np.array([2.0, 3.0])
    values = np.array([10.0, np.nan])
    one = Regression(errors, np.eye(2), values, np.ones(2, bool), errors, known, 1e-4, 0.01)
    with np.errstate(all="raise"):
        mean = mean_of(widened(widened(None, one), one), one)
    assert_array_equal(mean.measured, values)
    assert_array_equal(mean.gradient, [[1.0, 0.0], [0.0, 0.0]])
    assert_allclose(mean.noise, [1.0, 1.0])


def test_a_residual_is_what_the_masses_after_the_sample_leave():
    recording = frontal(noise=5.0, n=60)
    _, estimates = final(recording, "frontal_engine_cab", interval=0.002)
    last = estimates[-1]
    assert_allclose(last.residual, last.measured - last.predicted)
    assert_allclose(last.predicted, -last.parameters @ last.acceleration[: len(last.parameters)], rtol=1e-6)


@pytest.mark.parametrize("settings", [{}, {"interval": 0}, {"interval": 0.002, "forgetting": 0.9}])
def test_exact_from_exact_data(settings):
    _, estimates = final(frontal(), "frontal_engine_cab", **settings)
    assert_allclose(estimates[-1].parameters, [1400.0, 350.0], rtol=1e-4)  # the model's masses count a little


def test_the_total_is_conserved_at_every_sample_and_its_shares_are_found():
    estimator, estimates = final(side(), "side_mdb_door_car")
    assert estimator.description.parameters == ("mdb.mass", "door.mass", "car.mass")
    assert estimator.description.equations == ("momentum",)
    for estimate in estimates:
        assert_allclose(estimate.parameters.sum(), 2580.0, rtol=1e-12)
        assert_allclose(estimate.covariance.sum(), 0.0, atol=1e-9 * estimate.covariance.max())
    assert_allclose(estimates[-1].parameters, [900.0, 80.0, 1600.0], rtol=1e-4)


def test_every_sample_is_least_squares_so_far():
    recording = frontal(noise=5.0)
    _, estimates = final(recording, "frontal_engine_cab", interval=0)
    values = recording.values - recording.values[recording.time_ns < 0].mean(axis=0)
    for k in (200, 500, 899):
        rows = (recording.time_ns > 0) & (np.arange(len(recording)) <= k)
        expected = np.linalg.lstsq(-values[rows, :2], values[rows, 2], rcond=None)[0]
        assert_allclose(estimates[k].parameters, expected, rtol=1e-4)


def test_true_masses_lie_within_the_stated_intervals():
    errors = []
    for seed in range(60):
        _, estimates = final(frontal(noise=5.0, seed=seed, n=500), "frontal_engine_cab")
        errors.extend((estimates[-1].parameters - [1400.0, 350.0]) / estimates[-1].std)
    assert 0.92 <= np.mean(np.abs(errors) < 2.31) <= 0.98  # 10 intervals, 2 masses: Student's t with 8 degrees


@pytest.mark.skipif(not NHTSA.exists(), reason="the NHTSA recording is not here")
@pytest.mark.parametrize("interval", [0.003, 0.005, 0.008])
def test_the_car_of_nhtsa_10146_weighs_1719_kg(interval):
    from crash_replay.readers import read_source

    _, estimates = final(read_source(NHTSA), "frontal_engine_cab", interval=interval)
    assert_allclose(estimates[-1].parameters.sum(), 1719.0, rtol=0.03)
    assert 300.0 < estimates[-1].parameters[1] < 500.0


def test_as_a_first_stage_the_stiffness_is_that_of_the_true_masses():
    """Element forces scale with the masses; the model's are 10 % too light."""
    recording, model = frontal(), load_model("frontal_engine_cab")
    light = replace(model, bodies=tuple(replace(b, mass=b.mass and 0.9 * b.mass) for b in model.bodies))
    estimator = make_estimator(light, recording.test, "effective_mass")
    last = run(estimator, recording.samples())[-1]
    mended = with_effective_masses(light, dict(zip(estimator.description.parameters, last.parameters)))
    assert_allclose([b.mass for b in mended.bodies if b.mass], [1400.0, 350.0], rtol=1e-4)
    with pytest.raises(ModelError, match="effective mass of cab came out as -3 kg"):
        with_effective_masses(light, {"cab.mass": -3.0})


def test_models_without_a_closed_balance_are_refused():
    test = frontal().test
    with pytest.raises(ModelError, match="body door_upper is driven by an unknown force"):
        make_estimator(load_model("side_dummy"), test, "effective_mass")
    with pytest.raises(ModelError, match="needs a fixed body with a measured `force`"):
        make_estimator(load_model("impactor_single"), test, "effective_mass")


def test_it_conforms():
    """Inputs unchanged, split run = whole run, NaN-safe."""
    recording = frontal(noise=5.0)
    recording.values[300:310, 1] = np.nan
    copy = recording.values.copy()
    estimator, whole = final(recording, "frontal_engine_cab")
    assert_array_equal(recording.values, copy)
    assert all(np.isfinite(e.parameters).all() and np.isfinite(e.covariance).all() for e in whole)
    assert np.isnan(whole[305].residual).all()
    samples, state = list(recording.samples()), estimator.init()
    for sample in samples[:333]:
        state, _ = estimator.step(state, sample)
    for sample, expected in zip(samples[333:], whole[333:]):
        state, estimate = estimator.step(state, sample)
        assert_array_equal(estimate.parameters, expected.parameters)
        assert_array_equal(estimate.covariance, estimate.covariance.T)


@pytest.mark.parametrize(("interval", "updates"), [(0.002, 40), (0.008, 10), (0.0, 800)])
def test_the_masses_are_told_once_an_interval(interval, updates):
    """Of 80 ms after the impact."""
    _, estimates = final(frontal(noise=5.0), "frontal_engine_cab", interval=interval)
    masses = np.array([estimate.parameters for estimate in estimates])
    assert np.count_nonzero((np.diff(masses, axis=0) != 0.0).any(axis=1)) == pytest.approx(updates, abs=1)
