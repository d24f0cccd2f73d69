"""The experiments: each runs the estimators on noisy repetitions of a problem and returns what its table shows."""

from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from crash_replay.recording import Recording

from ..core.characteristic import Characteristic, characteristics
from ..core.compare_tests import NoiseDifference, coarser, compare_tests, curve_difference
from ..core.discretize import modes
from ..core.estimate import Description, Estimate
from ..core.methods import make_estimator
from ..core.structure import Structure
from ..core.validation import EquationValidation, chi_square_quantile, validate
from ..model_file import load_model
from . import cases

FOLDER = Path(__file__).parent

FRONTAL = {"forgetting": 0.5, "m": 5, "cr": 3.0, "error_limit": 1.0, "step_limit": 0.5}
SIDE = {"forgetting": 0.8, "m": 4, "cr": 3.0, "error_limit": 1.0, "step_limit": 0.5}
"""Forgetting, m and the error limit of sigma / sqrt(m) are table 5.3's; its cr (50 and 20) overshoots on our curves."""

GAUSS_NEWTON: dict[str, Any] = {"memory": 0.02, "noise_memory": 0.1, "known_to": np.inf}
"""80 samples are too few for the noise model to wait, and K/M starts near its value."""
PASSES = 3
"""Of recursive Gauss-Newton over a record whose noise model is estimated: the noise model is not linear, so that "an
iterative estimation method is required" (5.3). A pass starts from the noise model that the one before ended with;
a first pass takes its early samples for as sure as in white noise, and its sigma is then too small."""
SAMPLED = ("0.1 ms", "1 ms")

SETTLED = 0.015
"""s: until then 4.5.1 has too little crush for K/M to be known."""


class Run(NamedTuple):
    description: Description
    estimates: list[Estimate]
    state: Any  # the estimator and its last state


class Ratios(NamedTuple):
    """Error variance over noise variance: seeds x equations."""

    equations: tuple[str, ...]
    by_method: dict[str, np.ndarray]
    example: dict[str, Run]  # of the first seed
    means: dict[str, np.ndarray]  # error mean over noise standard deviation
    inputs: tuple[str, ...]  # "cab_barrier.crush", "cab_barrier.rate", ...
    cross: dict[str, np.ndarray]  # seeds x equations x inputs: correlation of the error with each at lag 0

    def median(self, method: str) -> np.ndarray:
        return np.median(self.by_method[method], axis=0)


class NoiseOrders(NamedTuple):
    """4.5.1, one parameter set, by (p, q)."""

    which: str
    q: dict[tuple[int, int], np.ndarray]  # (seeds,) Ljung and Box
    lags: int
    inside: dict[tuple[int, int], np.ndarray]  # (seeds,) share of lags in the 95 % limit
    uncorrelated: dict[tuple[int, int], np.ndarray]  # (seeds,) by Ljung and Box at 95 %
    rms: dict[tuple[int, int], np.ndarray]  # (seeds,) error of K/M, 1/s^2
    fit: dict[tuple[int, int], np.ndarray]  # (seeds,) estimated less assumed acceleration, m/s^2 rms
    crossed: dict[tuple[int, int], np.ndarray]  # (seeds, 2) share of lags in the 99 % limit, with crush and rate
    apart: np.ndarray  # (seeds,) median over time of |difference| / sigma of the two K/M; of two normals 0.67
    within: np.ndarray  # (seeds,) share of the time within two sigma
    example: dict[tuple[int, int], tuple[Run, EquationValidation]]
    truth: np.ndarray  # (n,) K/M at each sample
    assumed: np.ndarray  # (n,) m/s^2, acceleration without noise


class Covariances(NamedTuple):
    """6.4.3: seeds x 3 x 3, error covariance over noise variance."""

    equations: tuple[str, ...]
    ratio: np.ndarray
    example: Run


class Sampling(NamedTuple):
    """4.5.3: the force-crush curves at 0.1 and 1 ms, and the noise model's orders."""

    between: np.ndarray  # (seeds,) rms difference of the two curves, share of the peak force
    from_truth: dict[str, np.ndarray]  # (seeds,) of each from the true curve
    orders: dict[str, list[tuple[int, int]]]
    curves: dict[str, tuple[np.ndarray, np.ndarray]]  # m, N; of the first seed and the truth


class Alike(NamedTuple):
    """7.3: noise models of two tests of the same car, and of a car that vibrates differently."""

    same: list[list[NoiseDifference]]  # by seed, by equation
    other: list[list[NoiseDifference]]
    rings: tuple[float, float]  # Hz, the vibration in the noise model of the one car and of the other


def estimate(structure: Structure, recording: Recording, method: str, **settings) -> Run:
    estimator = make_estimator(structure, recording.test, method, **settings)
    estimates, state = [], estimator.init()
    for sample in recording.samples():
        state, one = estimator.step(state, sample)
        estimates.append(one)
    return Run(estimator.description, estimates, (estimator, state))


def in_passes(structure: Structure, recording: Recording, p: int, q: int, passes: int = PASSES, **settings) -> Run:
    """Gauss-Newton over the record again and again, each time from the noise model found before."""
    found = estimate(structure, recording, "gauss_newton", p=p, q=q, **settings)
    for _ in range(passes - 1 if p + q else 0):
        estimator, state = found.state
        start = tuple(estimator.method.noise_models(state.method))
        found = estimate(structure, recording, "gauss_newton", p=p, q=q, start=start, **settings)
    return found


def with_noise(structure: Structure, noise: dict[str, float]) -> Structure:
    """The thesis takes the noise's variance as known; so does the model."""

    def known(body):
        channel = body.force or (body.acceleration[0] if body.acceleration else "")
        return replace(body, noise=noise.get(channel)) if body.force or body.free else body

    return replace(structure, bodies=tuple(map(known, structure.bodies)))


def noise_of(structure: Structure, noise: dict[str, float]) -> np.ndarray:
    """(q,) standard deviation of what was added to each equation's measurement."""
    bodies = [structure.bodies[k] for k in structure.equations]
    return np.array([noise[body.force or body.acceleration[0]] for body in bodies])


def ratios(scenario: cases.Scenario, model: str, settings: dict, seeds: int, as_printed: bool = True) -> Ratios:
    """RLS and MRLS at the same forgetting (tables 5.1 and 5.2), ours and, unless that is not asked for, as printed."""
    _, trials = cases.trials(scenario, seeds)
    structure = load_model(FOLDER / f"{model}.yaml")
    plain = {"forgetting": settings["forgetting"]}
    printed = {"preset": "thesis"}
    ways = {"rls": ("rls", plain), "mrls": ("mrls", settings)}
    if as_printed:
        ways |= {"rls as printed": ("rls", plain | printed), "mrls as printed": ("mrls", settings | printed)}
    found: dict[str, list] = {way: [] for way in ways}
    means: dict[str, list] = {way: [] for way in ways}
    cross: dict[str, list] = {way: [] for way in ways}
    example: dict[str, Run] = {}
    for trial in trials:
        known = with_noise(structure, trial.noise)
        sigma = noise_of(structure, trial.noise)
        for way, (method, given) in ways.items():
            with np.errstate(all="ignore"):  # as printed, with too large a correction, it diverges
                result = estimate(known, trial.recording, method, **given)
            after = [e for e in result.estimates if e.time_ns > 0]
            error = np.array([e.residual for e in after])
            found[way].append(error.var(axis=0) / sigma**2)
            means[way].append(error.mean(axis=0) / sigma)
            inputs = np.array([np.stack([e.crush, e.rate], axis=1).ravel() for e in after])
            cross[way].append(np.corrcoef(error, inputs, rowvar=False)[: error.shape[1], error.shape[1] :])
            example.setdefault(way, result)
    description = example["rls"].description
    names = tuple(f"{element}.{kind}" for element in description.elements for kind in ("crush", "rate"))
    arrays = [{way: np.array(rows) for way, rows in by.items()} for by in (found, means, cross)]
    return Ratios(description.equations, arrays[0], example, arrays[1], names, arrays[2])


def noise_orders(which: str, seeds: int, orders: tuple = ((0, 0), (1, 2)), noise=cases.vibrating) -> NoiseOrders:
    """4.5.1: K/M with and without a noise model, and whether what is left is white."""
    truth, trials = noise(cases.chapter_4(which), seeds)
    structure = load_model(FOLDER / "chapter_4.yaml")
    k_true = truth.elements["car_barrier"].secant
    assumed = -truth.elements["car_barrier"].force  # M = 1
    rows: dict[str, dict] = {
        name: {order: [] for order in orders} for name in ("q", "inside", "uncorrelated", "rms", "fit", "crossed")
    }
    apart, within, example = [], [], {}
    for trial in trials:
        k, sigma = {}, {}
        for p, q in orders:
            result = in_passes(structure, trial.recording, p, q, **GAUSS_NEWTON)
            late = [e for e in result.estimates if e.time_ns * 1e-9 > SETTLED]
            judged = validate(structure, result.description, result.estimates, what="innovation", start=0.01).equations[
                0
            ]
            k[p, q], sigma[p, q] = np.array([e.parameters[0] for e in late]), np.array([e.std[0] for e in late])
            rows["q"][p, q].append(judged.q)
            rows["inside"][p, q].append(judged.auto.inside(0.95))
            rows["uncorrelated"][p, q].append(judged.q <= uncorrelated_limit(judged.degrees, p, q))
            lumped = np.array([-one.force[0] for one in result.estimates])
            rows["fit"][p, q].append(np.sqrt(np.mean((lumped - assumed)[-len(late) :] ** 2)))
            rows["crossed"][p, q].append([cross.inside(0.99) for cross in judged.cross.values()])
            rows["rms"][p, q].append(np.sqrt(np.mean((k[p, q] - k_true[-len(late) :]) ** 2)))
            example.setdefault((p, q), (result, judged))
        first, second = orders[0], orders[1]
        distance = np.abs(k[first] - k[second]) / np.hypot(sigma[first], sigma[second])
        apart.append(np.median(distance))
        within.append(np.mean(distance < 2.0))
    arrays = {name: {order: np.array(v) for order, v in by.items()} for name, by in rows.items()}
    return NoiseOrders(
        which, arrays["q"], judged.degrees, arrays["inside"], arrays["uncorrelated"], arrays["rms"], arrays["fit"],
        arrays["crossed"], np.array(apart), np.array(within), example, k_true, assumed,
    )  # fmt: skip


def uncorrelated_limit(lags: int, p: int, q: int) -> float:
    """95 % limit of Q of an innovation whose p + q coefficients were fitted to the same record (Box and Pierce)."""
    return chi_square_quantile(0.95, lags - p - q)


def dummy(seeds: int, offsets: bool = False) -> Covariances:
    """6.4.3, table 6.1: the constrained Kalman filter as in the thesis, or with the zero offsets' errors estimated."""
    _, trials = cases.trials(cases.dummy(), seeds)
    structure = load_model("side_dummy")
    found, example = [], None
    for trial in trials:
        result = estimate(structure, trial.recording, "constrained_kalman", offsets=offsets)
        error = np.array([e.residual for e in result.estimates if e.time_ns > 0])
        sigma = noise_of(structure, trial.noise)
        found.append(np.cov(error, rowvar=False) / np.outer(sigma, sigma))
        example = example or result
    return Covariances(example.description.equations, np.array(found), example)


def sampling(seeds: int) -> Sampling:
    """4.5.3: the same frontal test at 0.1 ms, with vibration and 3 g of noise, and as means over 1 ms."""
    scenario = replace(cases.chapter_4("#1"), rate=10_000.0)
    _, trials = cases.trials(replace(scenario, sensors=tuple(replace(s, noise=30.0) for s in scenario.sensors)), seeds)
    structure = load_model(FOLDER / "chapter_4.yaml")
    crush = np.linspace(0.0, 0.55, 56)
    true = Characteristic("true", crush, np.array([cases.CHAPTER_4["#1"](x) * x for x in crush]), None, 1.0, True)
    between, from_truth = [], {name: [] for name in SAMPLED}
    orders = {name: [] for name in SAMPLED}
    curves = {"true": (true.crush, true.force)}
    for trial in trials:
        vibration = _vibration(trial.recording.time)
        fine = Recording(trial.recording.test, trial.recording.time_ns, trial.recording.values + vibration[:, None])
        laws = []
        for name, recording in zip(SAMPLED, (fine, coarser(fine, 1e-3))):
            result = estimate(structure, recording, "gauss_newton_orders", memory=0.02)
            laws.append(characteristics(structure, result.description, result.estimates)[0])
            orders[name].append(tuple(int(x) for x in result.estimates[-1].extra))
            curves.setdefault(name, (laws[-1].crush, laws[-1].force))
            from_truth[name].append(curve_difference(laws[-1], true))
        between.append(curve_difference(*laws))
    return Sampling(np.array(between), {name: np.array(v) for name, v in from_truth.items()}, orders, curves)


def _vibration(time: np.ndarray) -> np.ndarray:
    """m/s^2: a structure's ringing after the impact, 300 Hz and 60 m/s^2 at first."""
    return 60.0 * np.exp(-20.0 * time) * np.sin(2.0 * np.pi * 300.0 * time)


def alike(seeds: int) -> Alike:
    """7.3: the coloured noise of one car twice, and of one whose accelerometer's mount rings at another frequency."""
    scenario = replace(cases.chapter_4("#1"), rate=10_000.0)
    _, trials = cases.trials(scenario, 1)
    exact = next(trials).recording
    structure = load_model(FOLDER / "chapter_4.yaml")

    def models(seed: int, d: tuple[float, float]):
        recording = Recording(exact.test, exact.time_ns, exact.values + _coloured(len(exact), d, seed)[:, None])
        result = estimate(structure, recording, "gauss_newton", p=2, q=0, memory=0.02, noise_memory=1.0)
        estimator, state = result.state
        return estimator.method.noise_models(state.method)

    one_car, other_car = (-1.2, 0.6), (-0.9, 0.6)
    same, other = [], []
    for seed in range(seeds):
        first, twin, stranger = (
            models(3 * seed, one_car),
            models(3 * seed + 1, one_car),
            models(3 * seed + 2, other_car),
        )
        same.append(compare_tests(first, twin, exact.sample_period))
        other.append(compare_tests(first, stranger, exact.sample_period))
    ours, others = (modes(found[0], exact.sample_period)[0].frequency for found in (first, stranger))
    return Alike(same, other, (ours, others))


def _coloured(n: int, d: tuple[float, float], seed: int) -> np.ndarray:
    eps, e = 10.0 * np.random.default_rng(seed).standard_normal(n), np.zeros(n)
    for t in range(n):
        e[t] = eps[t] - sum(c * e[t - i - 1] for i, c in enumerate(d) if t > i)
    return e
