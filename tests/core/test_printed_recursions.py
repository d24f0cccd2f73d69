"""`preset=thesis` against each recursion transcribed from the thesis, which shares no code with the project.

Two bodies on a barrier (figure 5.2), the crush and rate of every element measured, so that Psi is what is written here.
Samples are 1 ms apart; the first one only starts the clock. 1e-9 of a value is rounding: a step solves a 4 x 4 system
whose columns are scaled differently by 1e3 at most.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from crash_estimator.cli.common import parse_settings
from crash_estimator.core.fold import run
from crash_estimator.core.methods import METHODS, make_estimator
from crash_estimator.core.structure import Body, Coefficient, Element, ModelError, Structure
from crash_estimator.nodes.estimator_parameters import settings_in, table_for
from crash_replay.recording import Channel, Recording, Test

N, DT = 120, 1e-3
M1, M2, K3, C3 = 3.0, 1.0, 1000.0, 1.0
START = np.array([800.0, 1.0, 1500.0, 1.0])  # K1 C1 K2 C2
STD, SCALE = (
    START * 0.5,
    np.array([2700.0, 90.0, 1500.0, 30.0]),
)  # mass (30 rad/s)^2, mass 30 rad/s, or the start where it is more
NOISE = np.array([20.0, 40.0, 80.0])  # m/s^2, m/s^2, N


def problem(seed=0, tail=0.0):
    """-> structure, recording, Psi (n, 3, 4), y (n, 3) without what is known; K1 halves, K2 trebles half way."""
    rng, t = np.random.default_rng(seed), np.arange(N) * DT
    x = np.stack([0.5 * np.sin(20.0 * t), 0.4 * np.sin(30.0 * t), 0.5 * np.sin(20.0 * t) - 0.4 * np.sin(30.0 * t)], 1)
    v = np.stack([10.0 * np.cos(20.0 * t), 12.0 * np.cos(30.0 * t), 10 * np.cos(20.0 * t) - 12 * np.cos(30.0 * t)], 1)
    late = (t > 0.5 * N * DT)[:, None]
    theta = np.where(late, [500.0, 2.0, 3000.0, 1.0], [1000.0, 2.0, 1000.0, 1.0])
    zero = np.zeros(N)
    psi = np.stack(
        [
            np.stack([-x[:, 0] / M1, -v[:, 0] / M1, zero, zero], 1),
            np.stack([zero, zero, -x[:, 1] / M2, -v[:, 1] / M2], 1),
            np.stack([x[:, 0], v[:, 0], x[:, 1], v[:, 1]], 1),
        ],
        axis=1,
    )
    third = K3 * x[:, 2] + C3 * v[:, 2]
    known = np.stack([-third / M1, third / M2, zero], 1)
    e = NOISE * rng.standard_normal((N, 3))
    for k in range(1, N):
        e[k] += tail * e[k - 1]
    y = np.einsum("nqp,np->nq", psi, theta) + e
    names = ("one", "two", "three")
    channels = [Channel("a1", "acceleration", "cab"), Channel("a2", "acceleration", "engine"), Channel("f", "force")]
    channels += [Channel(f"x_{name}", "displacement") for name in names]
    channels += [Channel(f"v_{name}", "velocity") for name in names]
    values = np.column_stack([y + known, x, v])
    recording = Recording(Test("printed", tuple(channels)), np.arange(N, dtype=np.int64) * 1_000_000, values)
    return recording, psi, y


def structure(low=-np.inf, preset="ours"):
    def unknown(k):
        return Coefficient(START[k], estimated=True, std=STD[k], min=low)

    law = {
        "one": (unknown(0), unknown(1)),
        "two": (unknown(2), unknown(3)),
        "three": (Coefficient(K3), Coefficient(C3)),
    }
    ends = {"one": ("cab", "barrier"), "two": ("engine", "barrier"), "three": ("cab", "engine")}
    bodies = (
        Body("cab", M1, ("a1",), noise=NOISE[0]),
        Body("engine", M2, ("a2",), noise=NOISE[1]),
        Body("barrier", fixed=True, force="f", noise=NOISE[2]),
    )
    elements = tuple(Element(n, ends[n], *law[n], displacement=f"x_{n}", velocity=f"v_{n}") for n in law)
    return Structure("printed", bodies, elements, preset=preset)


def ours(recording, method, low=-np.inf, **settings):
    """-> theta (n - 1, 4) and its covariance after each sample but the first."""
    estimates = run(
        make_estimator(structure(low), recording.test, method, preset="thesis", **settings), recording.samples()
    )
    return (
        np.array([e.parameters[:4] for e in estimates[1:]]),
        np.array([e.covariance[:4, :4] for e in estimates[1:]]),
    )


def printed_mrls(psi, y, forgetting, m=0, cr=1.0, error_limit=np.inf, step_limit=np.inf):
    """5.3, and with m 5.5.1: Psi is the transpose of the thesis's; R, gamma and Lambda as printed."""
    theta, gamma, big_lambda = START.copy(), 1.0, np.diag(NOISE**2)
    r = np.diag(1.0 / STD**2) * gamma
    errors, found, rewound = [], [], 0

    def step(t, delta):
        nonlocal theta, gamma, big_lambda, r
        gamma = 1.0 / (forgetting / gamma + 1.0)
        e = y[t] - psi[t] @ theta
        big_lambda = big_lambda + gamma * (np.outer(e, e) - big_lambda)
        r = r + gamma * (psi[t].T @ np.linalg.inv(big_lambda) @ psi[t] - r)
        change = delta * gamma * np.linalg.inv(r) @ psi[t].T @ np.linalg.inv(big_lambda) @ e
        theta = theta + np.clip(change, -step_limit, step_limit)
        return e

    for t in range(1, len(y)):
        errors.append(step(t, 1.0))
        while m and t >= m and (np.abs(np.mean(errors[-m:], axis=0)) > error_limit).any():
            errors[-m:] = [step(k, cr) for k in range(t - m + 1, t + 1)]
            rewound += 1
            assert rewound < 1000
        found.append(theta)
    return np.array(found), rewound


def test_rls_is_5_3():
    recording, psi, y = problem()
    theta, _ = ours(recording, "rls", forgetting=0.9)
    assert_allclose(theta, printed_mrls(psi, y, 0.9)[0], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("seed", (0, 1, 3))
def test_mrls_is_5_5_1(seed):
    """On seeds with which the printed rewinding ends; with 2 it does not."""
    recording, psi, y = problem(seed)
    theta, _ = ours(recording, "mrls", forgetting=0.95, m=5, cr=3.0, step_limit=0.3, rewinds=1000)
    limit = 2.58 * NOISE / np.sqrt(5)
    expected, rewound = printed_mrls(psi, y, 0.95, 5, 3.0, limit, 0.3 * SCALE)
    assert rewound > 3
    assert_allclose(theta, expected, rtol=1e-9, atol=1e-9)


def printed_kalman(psi, y, r1, lowest=-np.inf):
    """6.3; with `lowest` 6.4.2: what falls below is known to lie there, and the others are estimated again."""
    theta, p, r2, found, held = START.copy(), np.diag(STD**2), np.diag(NOISE**2), [], 0
    for t in range(1, len(y)):
        free = np.ones(4)
        while True:
            reduced = psi[t] * free
            gain = p @ reduced.T @ np.linalg.inv(r2 + reduced @ p @ reduced.T) * free[:, None]
            known = np.where(free > 0, theta, lowest)
            new = known + gain @ (y[t] - psi[t] @ known)
            if (new >= lowest).all():
                break
            free, held = free * (new >= lowest), held + 1
        if free.all():
            p = p - p @ psi[t].T @ np.linalg.inv(r2 + psi[t] @ p @ psi[t].T) @ psi[t] @ p + r1
        else:  # the same for a gain that leaves some rows alone
            rest = np.eye(4) - gain @ reduced
            p = rest @ p @ rest.T + gain @ r2 @ gain.T + r1
        theta = new
        found.append((theta, p))
    return np.array([f[0] for f in found]), np.array([f[1] for f in found]), held


def test_kalman_is_6_3():
    recording, psi, y = problem()
    theta, covariance = ours(recording, "kalman", process_noise=0.4)
    expected, p, _ = printed_kalman(psi, y, np.diag((0.4 * SCALE) ** 2) * DT)
    assert_allclose(theta, expected, rtol=1e-9, atol=1e-9)
    assert_allclose(covariance / np.outer(STD, STD), p / np.outer(STD, STD), rtol=1e-9, atol=1e-9)


def test_the_constrained_filter_is_6_4_2():
    """A damping that would fall below 0 is known to be 0 in that step."""
    recording, psi, y = problem()
    theta, _ = ours(recording, "constrained_kalman", low=0.0, process_noise=0.4)
    expected, _, held = printed_kalman(psi, y, np.diag((0.4 * SCALE) ** 2) * DT, lowest=0.0)
    assert held > 3
    assert_allclose(theta, expected, rtol=1e-9, atol=1e-9)


def printed_gauss_newton(psi, y, forgetting, order_p, order_q):
    """4.10 on 4.12, D e = A e', for every equation; the gradient is that of the prediction by theta, d and a."""
    q, n = y.shape[1], order_p + order_q
    theta, gamma, big_lambda = np.concatenate([START, np.zeros(q * n)]), 1.0, np.diag(NOISE**2)
    r = np.diag(np.concatenate([1.0 / STD**2, np.ones(q * n)]))
    white, slopes, found = np.zeros((len(y), q)), np.zeros((len(y), q, len(theta))), []

    def predict(t):
        """The predicted output, and its gradient."""
        output, gradient = psi[t] @ theta[:4], np.zeros((q, len(theta)))
        gradient[:, :4] = psi[t]
        for k in range(q):
            at = 4 + k * n
            for i in range(1, order_p + 1):
                if t - i >= 1:
                    e = y[t - i, k] - psi[t - i, k] @ theta[:4]
                    output[k] -= theta[at + i - 1] * e
                    gradient[k, at + i - 1] -= e
                    gradient[k, :4] += theta[at + i - 1] * psi[t - i, k]
            for j in range(1, order_q + 1):
                if t - j >= 1:
                    a = theta[at + order_p + j - 1]
                    output[k] += a * white[t - j, k]
                    gradient[k, at + order_p + j - 1] += white[t - j, k]
                    gradient[k] -= a * slopes[t - j, k]
        return output, gradient

    for t in range(1, len(y)):
        gamma = 1.0 / (forgetting / gamma + 1.0)
        output, slopes[t] = predict(t)
        error = y[t] - output
        big_lambda = big_lambda + gamma * (np.outer(error, error) - big_lambda)
        r = r + gamma * (slopes[t].T @ np.linalg.inv(big_lambda) @ slopes[t] - r)
        theta = theta + gamma * np.linalg.inv(r) @ slopes[t].T @ np.linalg.inv(big_lambda) @ error
        white[t] = y[t] - predict(t)[0]
        found.append(theta[:4])
    return np.array(found)


@pytest.mark.parametrize(("p", "q"), [(0, 0), (1, 2), (0, 3)])
def test_gauss_newton_is_4_10(p, q):
    recording, psi, y = problem(tail=0.5)
    theta, _ = ours(recording, "gauss_newton", forgetting=0.98, p=p, q=q)
    assert_allclose(theta, printed_gauss_newton(psi, y, 0.98, p, q), rtol=1e-9, atol=1e-9)


def test_the_bank_of_orders_has_the_printed_recursion_as_its_members():
    """0,0 alone: the thesis has no such bank."""
    recording, psi, y = problem(tail=0.5)
    theta, _ = ours(recording, "gauss_newton_orders", forgetting=0.98, largest=0)
    assert_allclose(theta, printed_gauss_newton(psi, y, 0.98, 0, 0), rtol=1e-9, atol=1e-9)


def andersson(psi, y, models, probability):
    """4.4.3 names Andersson (1985): parallel recursions, each with a jump of its own, weighed by their likelihood."""
    bank, found = [(0.0, START, np.diag(STD**2))], []
    for t in range(1, len(y)):
        new = []
        for log_weight, theta, p in bank:
            s, e = np.diag(NOISE**2) + psi[t] @ p @ psi[t].T, y[t] - psi[t] @ theta
            gain = p @ psi[t].T @ np.linalg.inv(s)
            log_weight -= 0.5 * (e @ np.linalg.inv(s) @ e + np.log(np.linalg.det(s)))
            new.append((log_weight, theta + gain @ e, p - gain @ psi[t] @ p))
        total = np.logaddexp.reduce([w for w, _, _ in new])
        bank = sorted([(w - total, theta, p) for w, theta, p in new], key=lambda one: -one[0])
        found.append(sum(np.exp(w) * theta for w, theta, _ in bank))
        weight, theta, p = bank[0]
        bank[0] = (weight + np.log1p(-probability), theta, p)
        bank = [*bank[: models - 1], (weight + np.log(probability), theta, p + np.diag(SCALE**2))]
    return np.array(found)


def test_afmm_is_andersson_s_bank():
    recording, psi, y = problem()
    theta, _ = ours(recording, "afmm", models=5, probability=1e-3)
    assert_allclose(theta, andersson(psi, y, 5, 1e-3), rtol=1e-9, atol=1e-9)


def test_effective_mass_is_recursive_least_squares_on_4_3a():
    """M1 a1 + M2 a2 = -F; the start of R and Lambda is ours, 0.1 m/s^2 of the model's masses."""
    recording, _, _ = problem()
    estimates = run(
        make_estimator(structure(), recording.test, "effective_mass", preset="thesis", forgetting=0.95),
        recording.samples(),
    )
    theta, gamma, big_lambda, expected = np.array([M1, M2]), 1.0, (0.1 * (M1 + M2)) ** 2, []
    r = 0.1**2 / big_lambda * np.eye(2)
    for a1, a2, force in recording.values[1:, :3]:
        psi, gamma = np.array([-a1, -a2]), 1.0 / (0.95 / gamma + 1.0)
        e = force - psi @ theta
        big_lambda = big_lambda + gamma * (e * e - big_lambda)
        r = r + gamma * (np.outer(psi, psi) / big_lambda - r)
        theta = theta + gamma * np.linalg.inv(r) @ psi / big_lambda * e
        expected.append(theta)
    assert_allclose([e.parameters for e in estimates[1:]], expected, rtol=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_command_line_model_file_and_node_say_the_same(method, tmp_path):
    """A setting beside the preset keeps its value; the preset is another recursion than ours."""
    whole, _, _ = problem()
    recording = Recording(whole.test, whole.time_ns[:40], whole.values[:40])
    file = tmp_path / "model.yaml"
    file.write_text(
        "name: one\npreset: thesis\nbodies: {cab: {mass: 3, acceleration: a1}, wall: {fixed: true}}\n"
        "elements: {spring: {between: [cab, wall], stiffness: {estimate: true}}}\n"
    )

    def settled(given, **settings):
        estimates = run(make_estimator(given, recording.test, method, **settings), recording.samples())
        return np.array([e.parameters for e in estimates])

    by_preset = settled(structure(), **parse_settings(["preset=thesis"]))
    assert_allclose(settled(structure(preset="thesis")), by_preset, rtol=0)
    assert not np.array_equal(settled(structure()), by_preset)
    assert_allclose(settled(structure(preset="thesis"), preset="ours"), settled(structure()), rtol=0)
    for given in ({"settings.preset": "thesis"}, {"model": str(file)}):
        table = table_for({"method": method, **given})
        assert_allclose(
            settled(structure(), **settings_in({n: a.default for n, a in table.items()})), by_preset, rtol=0
        )


def test_a_preset_that_there_is_not_is_told():
    recording, _, _ = problem()
    with pytest.raises(ModelError, match="no preset 'thesys', only ours, thesis"):
        make_estimator(structure(), recording.test, "rls", preset="thesys")
