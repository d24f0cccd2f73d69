"""Recursive Gauss-Newton: it is RLS without a noise model, its gradient is the derivative, its noise model is right."""

from dataclasses import replace

import numpy as np
import pytest
from helpers_estimation import oscillator, oscillator_recording
from numpy.testing import assert_allclose, assert_array_equal

from crash_estimator.core.estimators.gauss_newton import GaussNewton, Past
from crash_estimator.core.estimators.noise_model import LARGEST_ROOT, NoiseModel, stable
from crash_estimator.core.estimators.update import Theta
from crash_estimator.core.fold import run
from crash_estimator.core.methods import make_estimator
from crash_estimator.core.regression import Regression
from crash_estimator.core.structure import Coefficient, ModelError

BOTH = dict(
    stiffness=Coefficient(1.0e4, True, std=1.0e4, drift=0.0), damping=Coefficient(0.0, True, std=100.0, drift=0.0)
)


def coloured(recording, d, a, sd, seed=1):
    """The recording with D(B) e = A(B) eps added to its acceleration."""
    n = len(recording)
    eps, e = sd * np.random.default_rng(seed).standard_normal(n), np.zeros(n)
    for t in range(n):
        e[t] = eps[t] - sum(c * e[t - i - 1] for i, c in enumerate(d) if t > i)
        e[t] += sum(c * eps[t - i - 1] for i, c in enumerate(a) if t > i)
    values = recording.values.copy()
    values[:, 0] += e
    return type(recording)(recording.test, recording.time_ns, values)


def test_a_noise_model_that_is_given_is_used_from_the_first_sample_on():
    """No word that it is learnt from some sample on: it was there before."""
    test = oscillator_recording(n=2).test
    given = (NoiseModel(np.array([-0.9]), np.zeros(0), np.array([[1e-4]]), 25.0),)
    for start, begins in ((given, False), ((), True)):
        method = make_estimator(oscillator(**BOTH), test, "gauss_newton", p=1, q=0).method
        assert replace(method, start=start).init(1).learning.tolist() == [not begins]


@pytest.mark.parametrize("largest", [-1, 11, 1.5])
def test_a_bank_of_too_many_orders_is_refused(largest):
    with pytest.raises(ModelError, match=f"must be from 0 to 10, got {largest}"):
        make_estimator(oscillator(**BOTH), oscillator_recording().test, "gauss_newton_orders", largest=largest)


@pytest.mark.parametrize("settings", [{}, {"forgetting": 0.97}, {"memory": 0.02}])
def test_without_a_noise_model_it_is_rls_to_the_last_bit(settings):
    recording = oscillator_recording(noise=5.0)
    plain = run(
        make_estimator(oscillator(**BOTH), recording.test, "rls", compiled=False, **settings), recording.samples()
    )
    newton = run(
        make_estimator(oscillator(**BOTH), recording.test, "gauss_newton", p=0, q=0, **settings), recording.samples()
    )
    for a, b in zip(plain, newton):
        for field in ("parameters", "covariance", "innovation", "residual", "innovation_covariance"):
            assert_array_equal(getattr(a, field), getattr(b, field))


def method_and_data(p, q, equations=2, samples=40, seed=3):
    """A method, regressions and the past before each, all with arbitrary numbers."""
    random = np.random.default_rng(seed)
    two = np.zeros(2)
    settings = Theta(("k", "c"), two, two + 1.0, two - np.inf, two + np.inf, two + 1.0)
    regressions = [
        Regression(
            random.standard_normal(equations), random.standard_normal((equations, 2)),
            random.standard_normal(equations), np.ones(2, dtype=bool), two, np.ones(equations), 1e-3,
        )
        for _ in range(samples)
    ]  # fmt: skip
    return GaussNewton(settings, p=p, q=q), regressions


@pytest.mark.parametrize(("p", "q"), [(1, 2), (3, 0), (0, 2), ((2, 0), (1, 3))])
def test_the_gradient_is_the_derivative_of_the_prediction_error(p, q):
    """Psi against central differences of eps over the whole past, which is folded anew for each shifted theta."""
    method, regressions = method_and_data(p, q)
    n = 2 + sum(sum(order) for order in method.orders(2))
    theta = 0.3 * np.random.default_rng(4).standard_normal(n)

    def fold(theta):
        past, errors = (), None
        for regression in regressions:
            expected, filtered = method._predict(theta, past, regression)
            target = regression.measured - regression.known
            errors = target - regression.gradient @ theta[:2] - expected
            past = (Past(target, regression.gradient, errors, filtered), *past)[:3]
        return errors, filtered

    errors, filtered = fold(theta)
    step = 1e-6
    for k in range(n):
        shift = step * np.eye(n)[k]
        slope = (fold(theta + shift)[0] - fold(theta - shift)[0]) / (2.0 * step)
        assert_allclose(-filtered[:, k], slope, rtol=1e-6, atol=1e-8)


def test_it_finds_the_noise_model_and_leaves_a_white_error():
    recording = coloured(oscillator_recording(n=3000, damping=2.0), [-0.8], [0.5], sd=2.0)
    estimator = make_estimator(oscillator(**BOTH), recording.test, "gauss_newton", p=1, q=1, forgetting=1.0)
    state, innovations, extra = estimator.init(), [], None
    for sample in recording.samples():
        state, estimate = estimator.step(state, sample)
        innovations.append(estimate.innovation[0])
        extra = estimate.extra
    model = estimator.method.noise_models(state.method)[0]
    assert estimator.description.extra == ("block.ar1", "block.ma1")
    assert extra == (model.d[0], model.a[0])
    for found, true, variance in zip((*model.d, *model.a), (-0.8, 0.5), np.diag(model.covariance)):
        assert abs(found - true) < 3.0 * np.sqrt(variance)
        assert np.sqrt(variance) < 0.05
    settled = np.array(innovations[1000:])
    correlation = [np.corrcoef(settled[k:], settled[:-k])[0, 1] for k in range(1, 11)]
    assert np.abs(correlation).max() < 3.3 / np.sqrt(len(settled))
    assert_allclose(settled.std(), 2.0, rtol=0.05)


@pytest.mark.parametrize("seed", range(3))
def test_the_noise_model_stays_stable_and_invertible(seed):
    """Also where the error is a random walk, and where it is differenced noise."""
    walk = coloured(oscillator_recording(n=600), [-1.0], [-1.0, 0.2], sd=5.0, seed=seed)
    estimator = make_estimator(oscillator(**BOTH), walk.test, "gauss_newton", p=2, q=2)
    for estimate in run(estimator, walk.samples()):
        for coefficients in (estimate.extra[:2], estimate.extra[2:]):
            if np.isfinite(coefficients).all():
                assert np.abs(np.roots([1.0, *coefficients])).max() <= LARGEST_ROOT * (1 + 1e-9)
        assert np.isfinite(estimate.parameters).all() and np.isfinite(estimate.predicted).all()


def test_roots_are_drawn_in_together():
    inside = np.array([-0.5, 0.06])
    assert stable(inside) is inside
    drawn = np.roots(np.concatenate([[1.0], stable(np.poly([2.0, 0.5, -0.4])[1:])]))
    assert_allclose(np.sort(drawn), np.sort(np.array([2.0, 0.5, -0.4]) * LARGEST_ROOT / 2.0))


def test_orders_that_make_no_sense_are_refused():
    test = oscillator_recording().test
    with pytest.raises(ModelError, match="order p of gauss_newton must be a whole number"):
        make_estimator(oscillator(), test, "gauss_newton", p=-1)
    with pytest.raises(ModelError, match="one order for each of 1 equations"):
        make_estimator(oscillator(), test, "gauss_newton", p=(1, 2)).init()


def short_record(start, seed):
    """The last K over its sigma after 80 samples with noise that is ARMA(1, 1)."""
    structure = oscillator(**BOTH)
    recording = coloured(oscillator_recording(n=80, pre=0), [-0.8], [0.3], sd=3.0, seed=seed)
    structure = replace(structure, bodies=(replace(structure.bodies[0], noise=3.0), structure.bodies[1]))
    settings = dict(p=1, q=1, forgetting=1.0, noise_memory=1e3, known_to=np.inf, start=start)
    estimator = make_estimator(structure, recording.test, "gauss_newton", **settings)
    state = estimator.init()
    for sample in recording.samples():
        state, estimate = estimator.step(state, sample)
    return (estimate.parameters[0] - 2.0e4) / estimate.std[0], tuple(estimator.method.noise_models(state.method))


def test_a_second_pass_with_the_noise_model_found_has_sigmas_that_hold():
    """The first takes its early samples for white and is too sure: of its 30 errors more than 5 % leave 1.96 sigma.

    Of 30 that are normal, fewer than 26 lie within in 2 % of the cases.
    """
    first, third = [], []
    for seed in range(30):
        error, start = short_record((), seed)
        first.append(abs(error))
        for _ in range(2):
            error, start = short_record(start, seed)
        third.append(abs(error))
    assert np.sum(np.array(third) < 1.96) >= max(26, np.sum(np.array(first) < 1.96) + 1)


def test_to_start_from_what_it_starts_from_anyway_changes_nothing():
    white = NoiseModel(np.zeros(1), np.zeros(1), np.eye(2), 9.0)
    (plain, _), (given, _) = short_record((), 1), short_record((white,), 1)
    assert plain == given


def test_noise_models_of_other_orders_are_refused():
    test, white = oscillator_recording().test, NoiseModel(np.zeros(2), np.zeros(1), np.eye(3), 9.0)
    with pytest.raises(ModelError, match="start of gauss_newton must be one noise model of orders p, q"):
        make_estimator(oscillator(), test, "gauss_newton", p=1, q=1, start=(white,)).init()
    with pytest.raises(ModelError, match="start of gauss_newton is a tuple of noise models"):
        make_estimator(oscillator(), test, "gauss_newton", start=1.0)


def test_the_orders_are_found_by_the_criterion():
    recording = coloured(oscillator_recording(n=800, damping=2.0), [-0.8], [], sd=2.0)
    estimator = make_estimator(oscillator(**BOTH), recording.test, "gauss_newton_orders", largest=1, forgetting=1.0)
    state = estimator.init()
    for sample in recording.samples():
        state, estimate = estimator.step(state, sample)
    assert estimator.description.extra == ("noise_model.p", "noise_model.q")
    assert estimate.extra == (1.0, 0.0)
    assert estimator.method.orders(state.method) == [(1, 0)]
    white = oscillator_recording(noise=2.0, n=500)
    estimator = make_estimator(oscillator(**BOTH), white.test, "gauss_newton_orders", largest=1, forgetting=1.0)
    assert run(estimator, white.samples())[-1].extra == (0.0, 0.0)
    with pytest.raises(ModelError, match="largest order of gauss_newton_orders"):
        make_estimator(oscillator(**BOTH), white.test, "gauss_newton_orders", largest=-1)


def test_a_bank_of_one_order_is_that_estimator():
    recording = oscillator_recording(noise=5.0)
    bank = make_estimator(oscillator(**BOTH), recording.test, "gauss_newton_orders", largest=0)
    alone = make_estimator(oscillator(**BOTH), recording.test, "gauss_newton", p=0, q=0)
    for a, b in zip(run(bank, recording.samples()), run(alone, recording.samples())):
        assert_array_equal(a.parameters, b.parameters)
        assert_array_equal(a.covariance, b.covariance)
