"""Errors of the integrated motion in the covariance: against the joint covariance, and against simulation."""

from dataclasses import replace

import numpy as np
import pytest
from helpers_estimation import plain
from numpy.testing import assert_allclose, assert_array_equal

from crash_estimator.benchmarks.coverage import LIMIT, looks, model_for, recorded, rows, simulated
from crash_estimator.core.compiled.regressor_errors import known_of, pass_on
from crash_estimator.core.fold import run
from crash_estimator.core.methods import make_estimator
from crash_estimator.core.regressor_errors import Consequence, MotionErrors, none_yet
from crash_estimator.core.structure import Body, Coefficient, Element, Structure
from crash_estimator.model_file import load_model
from crash_replay.recording import Channel, Recording, Test

B, P, Q = 2, 3, 2
VARIANCES = np.array([0.3, 0.1]), np.array([2e-3, 5e-3]), np.array([0.04, 0.0])  # zero, density, velocity


def errors_at(time, gradient=None):
    return MotionErrors(np.zeros((Q, B, 3)) if gradient is None else gradient, *VARIANCES, time)


def step_of(dt):
    """F and the covariance of what the noise adds to (z, u, d) in dt, for a density of 1."""
    f = np.array([[1.0, 0.0, 0.0], [dt, 1.0, 0.0], [dt * dt / 2.0, dt, 1.0]])
    return f, np.array([[0.0, 0.0, 0.0], [0.0, dt, dt * dt / 2.0], [0.0, dt * dt / 2.0, dt**3 / 3.0]])


def test_the_motion_s_errors_grow_as_integration_makes_them():
    f, added = step_of(0.02)
    then, now = errors_at(0.05).covariance(), errors_at(0.07).covariance()
    for b in range(B):
        assert_allclose(now[b], f @ then[b] @ f.T + VARIANCES[1][b] * added, rtol=1e-12)
    start = errors_at(0.0).covariance()
    assert_array_equal(start[0], np.diag([VARIANCES[0][0], VARIANCES[2][0], 0.0]))


def test_the_compiled_form_knows_the_same_of_them():
    known, expected = np.empty((B, 7)), errors_at(0.05).covariance()
    plain(known_of)(*VARIANCES, 0.05, known)
    for k, (one, other) in enumerate([(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)]):
        assert_allclose(known[:, k], expected[:, one, other], rtol=1e-12)
    assert_array_equal(known[:, 6], VARIANCES[1])


def test_the_compiled_form_makes_the_same_of_theta():
    """With equations that are a body's own, and with parameters that are held or that an equation does not see."""
    rng, known, found = np.random.default_rng(3), np.empty((B, 7)), none_yet(P, B)._replace(time=0.05)
    plain(known_of)(*VARIANCES, 0.05, known)
    whole, shared = np.zeros((P, P)), np.zeros((3, B, P))
    for _ in range(6):
        gain, gradient = rng.standard_normal((P, Q)) * 0.3, rng.standard_normal((Q, P))
        gain[rng.integers(P)], gradient[rng.integers(Q), rng.integers(P)] = 0.0, 0.0
        h = rng.standard_normal((Q, B, 3))
        found = found.after(gain, gradient, errors_at(0.05, h))
        plain(pass_on)(whole, shared, gain, gradient, np.ascontiguousarray(h.transpose(2, 0, 1)), known)
        assert_allclose(whole, found.covariance, rtol=1e-9, atol=1e-12)
        assert_allclose(shared.transpose(2, 1, 0), found.shared, rtol=1e-9, atol=1e-12)


def test_what_they_make_of_theta_is_the_joint_covariance_of_both_for_any_gains():
    """theta's error and the motion's in one vector: [I - G Psi, G H; 0, F], the noise of the sample left out."""
    rng, n, dt = np.random.default_rng(1), 3 * B, 0.01
    found = none_yet(P, B)
    joint = np.zeros((P + n, P + n))
    for b in range(B):
        at = slice(P + 3 * b, P + 3 * b + 3)
        joint[at, at] = errors_at(0.0).covariance()[b]
    f, added = step_of(dt)
    for k in range(1, 12):
        move, walk = np.eye(P + n), np.zeros_like(joint)
        for b in range(B):
            at = slice(P + 3 * b, P + 3 * b + 3)
            move[at, at], walk[at, at] = f, VARIANCES[1][b] * added
        joint = move @ joint @ move.T + walk
        gain, gradient = rng.standard_normal((P, Q)) * 0.3, rng.standard_normal((Q, P))
        h = rng.standard_normal((Q, B, 3))
        h[:, :, 0] = 0.0  # no equation is a body's own here: the sample's noise is not in the motion
        whole = np.eye(P + n)
        whole[:P, :P] -= gain @ gradient
        whole[:P, P:] = gain @ h.reshape(Q, n)
        joint = whole @ joint @ whole.T
        found = found.after(gain, gradient, errors_at(k * dt, h))
        assert_allclose(found.covariance, joint[:P, :P], rtol=1e-9, atol=1e-12)
        assert_allclose(found.shared.reshape(P, n), joint[:P, P:], rtol=1e-9, atol=1e-12)


def test_the_noise_of_a_sample_is_in_the_velocity_after_it():
    h = np.zeros((Q, B, 3))
    h[0, 1, 0] = 1.0
    gain = np.array([[2.0, 0.0], [0.0, 0.0], [0.0, 0.0]])
    after = none_yet(P, B).after(gain, np.zeros((Q, P)), errors_at(0.0, h))
    assert_allclose(after.shared[0, 1], [2.0 * VARIANCES[0][1], 2.0 * VARIANCES[1][1], 0.0], atol=1e-15)


def test_without_known_errors_only_the_walk_counts():
    start = Consequence(np.eye(P), np.zeros((P, 0, 3)), 0.0)
    gain, gradient = np.full((P, 1), 0.1), np.ones((1, P))
    lessen = np.eye(P) - gain @ gradient
    after = start.walked(np.ones(P)).after(gain, gradient, None)
    assert_allclose(after.covariance, 2.0 * lessen @ lessen.T, rtol=1e-12)


@pytest.mark.parametrize("method", ["rls", "mrls", "kalman", "constrained_kalman"])
def test_the_truth_lies_inside_with_integrated_crush(method):
    """20 seeds with 5 instants and 2 stiffnesses that go together: some 40 that do not, 95 % +- 7 % inside."""
    inside = [row.inside for row in rows(range(20), False, [method], ["frontal_engine_cab"])]
    assert np.mean(inside) > 0.85


@pytest.mark.parametrize("method", ["rls", "constrained_kalman"])
def test_a_wrong_initial_velocity_is_counted_where_the_model_says_how_wrong(method):
    """The stated velocity is wrong by 0.3 m/s of standard deviation, which 1 % of the stiffness does not show."""
    truth, structure = simulated("frontal_single", False, False), model_for("frontal_single", False)
    place = looks(structure, truth)[2]
    bodies = (replace(structure.bodies[0], velocity_std=0.3), *structure.bodies[1:])
    said = {0.0: structure, 0.3: replace(structure, bodies=bodies)}
    inside = {std: [] for std in said}
    for seed in range(30):
        recording = recorded(truth, 1.0, seed)
        speed = recording.test.initial_velocity["car"] + 0.3 * np.random.default_rng(seed).standard_normal()
        test = replace(recording.test, initial_velocity={"car": speed})
        for std, model in said.items():
            estimator = make_estimator(model, test, method)
            _, found = estimator.follow(estimator.init(), recording.time_ns, recording.values)
            value, sigma = (found[place.sample, estimator.columns[f]][place.parameter] for f in ("parameters", "std"))
            inside[std].append(abs(value - place.truth) < LIMIT * sigma)
    assert np.mean(inside[0.3]) > 0.8 > 0.6 > np.mean(inside[0.0])


@pytest.mark.parametrize("seed", [3, 4, 5])
@pytest.mark.parametrize("method", ["rls", "kalman", "constrained_kalman", "gauss_newton", "afmm"])
def test_what_is_integrated_before_contact_tells_little_of_a_stiffness_and_is_not_sure_of_it(method, seed):
    """Rib and spine rest until the door comes: their crush is error alone, in which no stiffness can be seen."""
    structure, truth = load_model("side_dummy"), simulated("side_dummy_unpadded", False, False)
    recording = recorded(truth, 2.0, seed)
    before = recording.time_ns < 10_000_000
    recording = Recording(recording.test, recording.time_ns[before], recording.values[before])
    estimator = make_estimator(structure, recording.test, method)
    state, stated = estimator.init(), None
    k = estimator.description.parameters.index("rib_spine.stiffness")
    for sample in recording.samples():
        state, estimate = estimator.step(state, sample)
        stated = stated or float(np.sqrt(estimate.covariance[k, k]))
    assert estimate.crush[1] != 0.0
    sigma = np.sqrt(estimate.covariance[k, k])
    assert sigma > 0.6 * stated
    assert abs(estimate.parameters[k] - 5.0e4) < sigma


def oscillating(seed=0, noise=20.0):
    """A mass on a spring and a damper, 20 samples at rest before the impact; its crush is integrated from noise too."""
    rng, dt, at_rest = np.random.default_rng(seed), 1e-3, 20
    t = np.arange(-at_rest, 100) * dt
    values = np.where(t < 0.0, 0.0, -300.0 * np.sin(30.0 * t)) + rng.normal(0.0, noise, len(t))
    test = Test("one", (Channel("a", "acceleration", "car"),), initial_velocity={"car": 10.0})
    return Recording(test, np.round(t * 1e9).astype(np.int64), values[:, None])


def spring_estimator(recording, method, **settings):
    """Of K and C, from 800 N/m and 1 N s/m."""
    law = [Coefficient(value, estimated=True, std=0.5 * value) for value in (800.0, 1.0)]
    bodies = (Body("car", 1.0, ("a",), noise=20.0), Body("wall", fixed=True))
    structure = Structure("one", bodies, (Element("spring", ("car", "wall"), *law),))
    return make_estimator(structure, recording.test, method, **settings)


def test_the_printed_recursion_takes_the_integrated_motion_as_true():
    """5.3 on the crush and rate as they were integrated, from the first sample on; ours knows that they err."""
    recording, settings = oscillating(), {"preset": "thesis", "forgetting": 0.95}
    estimates = run(spring_estimator(recording, "rls", **settings), recording.samples())
    found = [e for e in estimates if e.time_ns > 0]
    theta, gamma, big_lambda = np.array([800.0, 1.0]), 1.0, 20.0**2
    r = np.diag([1.0 / 400.0**2, 1.0 / 0.5**2])
    for e in found:
        psi, gamma = -np.array([e.crush[0], e.rate[0]]), 1.0 / (0.95 / gamma + 1.0)
        error = e.measured[0] - psi @ theta
        big_lambda += gamma * (error**2 - big_lambda)
        r = r + gamma * (np.outer(psi, psi) / big_lambda - r)
        theta = theta + gamma * np.linalg.solve(r, psi) * error / big_lambda
        assert_allclose(e.parameters, theta, rtol=1e-9)
    ours = run(spring_estimator(recording, "rls", regressor_errors=True, **settings), recording.samples())
    assert (np.diagonal(ours[-1].covariance) > 1.001 * np.diagonal(found[-1].covariance)).all()


@pytest.mark.parametrize("more", [{}, {"damping_after": 0.5}])
@pytest.mark.parametrize("method", ["rls", "mrls", "kalman", "constrained_kalman", "gauss_newton", "afmm"])
def test_the_setting_says_whether_anything_is_added_to_the_sigma(method, more):
    recording, told = oscillating(), {}
    for counted in (False, True):
        estimator = spring_estimator(recording, method, compiled=False, regressor_errors=counted, **more)
        state = estimator.init()
        for sample in recording.samples():
            state, _ = estimator.step(state, sample)
        told[counted] = np.diagonal(state.update.stated) / np.diagonal(state.update.covariance)
    assert (told[False] == 1.0).all() and (told[True] > 0.0).all() and (np.abs(told[True] - 1.0) > 1e-6).any()


@pytest.mark.parametrize("method", ["rls", "mrls", "kalman", "constrained_kalman", "gauss_newton", "afmm"])
def test_a_recursion_as_printed_states_what_it_knows_itself(method):
    """Nothing is added of the integrated motion, whose errors the thesis does not have."""
    recording = oscillating()
    estimator = spring_estimator(recording, method, preset="thesis")
    state = estimator.init()
    for sample in recording.samples():
        state, _ = estimator.step(state, sample)
    assert_array_equal(state.update.stated, state.update.covariance)


def test_where_no_noise_is_known_the_printed_mrls_takes_one_unit():
    """As if that had been stated: for the limit of its mean error as well."""
    recording = oscillating(noise=2.5)
    recording = Recording(recording.test, recording.time_ns[20:], recording.values[20:])  # no rest to know it from
    bodies = {noise: Body("car", 1.0, ("a",), noise=noise) for noise in (None, 1.0)}
    law = [Coefficient(value, estimated=True, std=0.5 * value) for value in (800.0, 1.0)]
    found = {}
    for noise, body in bodies.items():
        structure = Structure("one", (body, Body("wall", fixed=True)), (Element("spring", ("car", "wall"), *law),))
        estimator = make_estimator(structure, recording.test, "mrls", preset="thesis", m=4, rewinds=3)
        found[noise] = run(estimator, recording.samples())
    rewound = np.mean([any(event.kind == "rewound" for event in e.events) for e in found[1.0]])
    assert 0.1 < rewound < 0.9, "else the limit decides nothing"
    for one, other in zip(found[None], found[1.0], strict=True):
        assert_array_equal(one.parameters, other.parameters)
