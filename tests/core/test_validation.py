"""Correlation limits hold for white noise, planted correlations are found, the free run closes the loop."""

from types import SimpleNamespace

import numpy as np
import pytest
from helpers_estimation import oscillator, oscillator_recording
from numpy.testing import assert_allclose

from crash_estimator.core.characteristic import Characteristic, characteristics
from crash_estimator.core.compare_free_run import compare
from crash_estimator.core.errors import EquationError
from crash_estimator.core.fold import run
from crash_estimator.core.free_run import free_run
from crash_estimator.core.methods import make_estimator
from crash_estimator.core.structure import Coefficient, ModelError
from crash_estimator.core.validation import (
    LEVELS,
    autocorrelation,
    chi_square_quantile,
    cross_correlation,
    validate,
)
from crash_estimator.model_file import load_model
from crash_estimator.tables import larger_than_measured
from crash_estimator.validation_tables import comparison_table, correlation_table, covariance_table
from crash_replay.synthetic.recordings import SCENARIOS

BOTH = dict(
    stiffness=Coefficient(1.0e4, True, std=1.0e4, drift=0.0, shape="constant"),
    damping=Coefficient(0.0, True, std=100.0, drift=0.0, shape="constant"),
)


def estimated(structure, recording, method="kalman", **settings):
    estimator = make_estimator(structure, recording.test, method, **settings)
    return estimator.description, run(estimator, recording.samples())


def test_correlations_are_those_of_their_definition():
    random = np.random.default_rng(1)
    r, u = random.standard_normal(50), random.standard_normal(50)
    r, u = r - r.mean(), u - u.mean()
    auto, cross = autocorrelation(r, 5), cross_correlation(r, u, 5)
    assert list(auto.lags) == list(range(6)) and list(cross.lags) == list(range(-5, 6))
    assert auto.values.shape == auto.lags.shape and cross.values.shape == cross.lags.shape
    for lag, value in zip(auto.lags, auto.values):
        assert_allclose(value, np.sum(r[lag:] * r[: 50 - lag]) / np.sum(r * r), atol=1e-12)
    for lag, value in zip(cross.lags, cross.values):
        later, earlier = (r[lag:], u[: 50 - lag]) if lag >= 0 else (r[:lag], u[-lag:])
        assert_allclose(value, np.sum(later * earlier) / np.sqrt(np.sum(r * r) * np.sum(u * u)), atol=1e-12)


@pytest.mark.parametrize("level", LEVELS)
def test_white_noise_stays_within_its_limits_as_often_as_they_say(level):
    """300 series of 400: the share of lags within, of smooth inputs too, and of Q below its quantile."""
    random = np.random.default_rng(0)
    slow = np.sin(np.linspace(0.0, 7.0, 400))
    autos, crosses, qs = [], [], []
    for _ in range(300):
        r = random.standard_normal(400)
        auto = autocorrelation(r, 20)
        autos.append(auto.inside(level))
        crosses.append(abs(cross_correlation(r, slow, 0).values[0]) <= LEVELS[level] * np.sqrt(1.0 / 400))
        qs.append(400 * 402 * np.sum(auto.values[1:] ** 2 / (400 - auto.lags[1:])) <= chi_square_quantile(level, 20))
    assert_allclose([np.mean(autos), np.mean(crosses), np.mean(qs)], level, atol=0.03)


def test_the_chi_square_quantile():
    assert_allclose(
        [chi_square_quantile(0.95, d) for d in (3, 10, 20, 100)], [7.815, 18.307, 31.410, 124.342], rtol=0.01
    )
    assert_allclose([chi_square_quantile(0.99, d) for d in (10, 20)], [23.209, 37.566], rtol=0.01)
    assert_allclose([chi_square_quantile(0.90, d) for d in (10, 20)], [15.987, 28.412], rtol=0.01)


@pytest.mark.parametrize("seed", range(3))
def test_the_residual_of_the_true_model_is_white_and_that_of_a_poorer_one_goes_along_with_what_it_lacks(seed):
    recording = oscillator_recording(damping=300.0, noise=2.0, n=800, seed=seed, pre=400)
    whole = oscillator(**BOTH)
    description, estimates = estimated(whole, recording, noise_memory=0)
    good = validate(whole, description, estimates, what="innovation", start=0.005).equations[0]
    assert good.uncorrelated(0.99) and good.auto.inside(0.99) > 0.9
    poor = oscillator(Coefficient(2.0e4, True, std=1.0, drift=0.0))  # known so well that it cannot take up the damping
    description, estimates = estimated(poor, recording, noise_memory=0, offsets=False)
    bad = validate(poor, description, estimates, what="innovation", start=0.005).equations[0]
    assert not bad.uncorrelated(0.99)
    assert np.abs(bad.cross["spring.rate"].values).max() > 0.9 > np.abs(bad.cross["spring.crush"].values).max()


def test_the_covariance_is_that_of_the_errors_and_tables_show_it():
    recording, _ = SCENARIOS["frontal_engine_cab"](1)
    structure = load_model("frontal_engine_cab")
    description, estimates = estimated(structure, recording, "constrained_kalman")
    validation = validate(structure, description, estimates, end=0.1)
    errors = np.array([e.residual for e in estimates if 0 <= e.time_ns <= 100_000_000])
    assert_allclose(validation.covariance, np.cov(errors, rowvar=False))
    assert_allclose(np.diagonal(validation.correlation), 1.0)
    assert [e.error_variance for e in validation.errors] == pytest.approx(errors.var(axis=0))
    assert set(validation.equations[0].cross) == {
        f"{element}.{kind}" for element in ("cab_barrier", "cab_engine") for kind in ("crush", "rate")
    }
    for text in (correlation_table(validation), covariance_table(validation)):
        assert len({len(line) for line in text.splitlines() if not line.startswith("(")}) <= 2
        for name in ("cab", "engine", "barrier"):
            assert name in text


def test_too_few_samples_are_said_to_be_too_few():
    recording = oscillator_recording(n=12)
    description, estimates = estimated(oscillator(**BOTH), recording)
    equation = validate(oscillator(**BOTH), description, estimates).equations[0]
    assert equation.auto is None and not equation.uncorrelated(0.95)


def test_a_free_run_of_the_true_model_is_the_measurement():
    """Noise-free single mass on a barrier: the force-crush curve, the unloading and the damping are read off."""
    recording, truth = SCENARIOS["frontal_single"](0, ideal=True)
    structure = load_model("frontal_single")
    description, estimates = estimated(structure, recording, "constrained_kalman")
    (law,) = characteristics(structure, description, estimates)
    car = truth.bodies["car"]
    assert_allclose(law.unloading, 2.0e7, rtol=0.25)  # the line is short, 20 mm of 650
    simulated = free_run(structure, description, estimates, end=0.11)
    true_velocity = car.velocity[recording.time_ns >= 0][: len(simulated.time)]
    assert np.abs(simulated.velocity[:, 0] - true_velocity).max() < 0.3  # of 13.3 m/s
    for row in compare(structure, description, simulated):
        assert row.rating.overall > 0.94, row


def test_a_free_run_keeps_the_energy_of_an_elastic_element():
    """With constant K and no damping: velocity and displacement as in the exact solution, RK4's error only."""
    from crash_estimator.core.structure import Body, Element, Structure
    from crash_replay.recording import Channel, Recording, Test

    time_ns = np.arange(-20, 1500, dtype=np.int64) * 100_000
    t = np.maximum(time_ns * 1e-9, 0.0)
    w = np.sqrt(4.0e5 / 1000.0)
    a = np.where(time_ns < 0, 0.0, -10.0 * w * np.sin(w * t))
    test = Test("bounce", (Channel("car_ax", "acceleration"),), initial_velocity={"car": 10.0})
    structure = Structure(
        "bounce",
        (Body("car", 1000.0, ("car_ax",)), Body("wall", fixed=True)),
        (Element("spring", ("car", "wall"), Coefficient(1.0e5, True, drift=0.0, shape="constant")),),
    )
    description, estimates = estimated(structure, Recording(test, time_ns, a[:, None]))
    simulated = free_run(structure, description, estimates)
    assert_allclose(simulated.velocity[:, 0], 10.0 * np.cos(w * simulated.time), atol=0.01)
    given = (Characteristic("spring", np.array([-1.0, 0.0, 1.0]), np.array([-4e5, 0.0, 4e5]), None, 0.0, True),)
    exact = free_run(structure, description, estimates, given)
    assert_allclose(exact.velocity[:, 0], 10.0 * np.cos(w * exact.time), atol=1e-6)
    assert_allclose(exact.displacement[:, 0], 10.0 / w * np.sin(w * exact.time), atol=1e-7)


def test_a_characteristic_loads_unloads_and_separates():
    law = Characteristic("e", np.array([0.0, 0.1, 0.2]), np.array([0.0, 100.0, 150.0]), 5000.0, 0.0, False)
    assert law.spring(0.15, 0.15) == 125.0
    assert_allclose(law.spring(0.19, 0.2), 100.0)  # 150 - 5000 * 0.01
    assert law.spring(0.1, 0.2) == 0.0 and not law.carries(0.1, 0.2)
    assert law.spring(-0.01, 0.2) == 0.0


def test_a_free_run_without_samples_is_refused():
    recording = oscillator_recording(n=40)
    description, estimates = estimated(oscillator(**BOTH), recording)
    with pytest.raises(ModelError, match="at least two samples"):
        free_run(oscillator(**BOTH), description, estimates, end=-1.0)


def test_the_table_of_a_comparison():
    recording, _ = SCENARIOS["frontal_single"](0)
    structure = load_model("frontal_single")
    description, estimates = estimated(structure, recording, "constrained_kalman")
    text = comparison_table(compare(structure, description, free_run(structure, description, estimates, end=0.1)))
    assert "car velocity" in text and "excellent" in text


def test_the_correlation_of_equations_is_their_covariance_in_units_of_their_scatter():
    description = SimpleNamespace(equations=("a",), equation_units=("m/s^2",), elements=())
    structure = SimpleNamespace(force_to_equation=np.zeros((1, 0)))
    values = 3.0 * np.random.default_rng(2).standard_normal(50)
    estimates = [
        SimpleNamespace(time_ns=k, residual=np.array([v]), measured=np.array([v]), predicted=np.zeros(1))
        for k, v in enumerate(values)
    ]
    found = validate(structure, description, estimates)
    assert_allclose(found.covariance, [[np.var(values, ddof=1)]])
    assert_allclose(found.correlation, [[1.0]])


@pytest.mark.parametrize("variance, said", [(0.9, ""), (1.1, "car: the error is larger than what was measured")])
def test_an_error_larger_than_what_was_measured_is_said(variance, said):
    row = EquationError("car", "N", 100, 5.0, 1.0, 5.0, 1.0, 0.0, variance, variance**0.5)
    found = larger_than_measured([row._replace(equation="engine", error_variance=0.1), row])
    assert found.startswith(said) and bool(found) == bool(said) and "engine" not in found
