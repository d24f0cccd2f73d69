"""7.3, items 3 to 7: what the thesis recommends to try next, tried on simulated tests."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from crash_replay.conditioning import filter_recording
from crash_replay.recording import Recording
from crash_replay.synthetic.recordings import SCENARIOS
from crash_replay.synthetic.scenario import Truth, record
from crash_replay.synthetic.sensors import Sensor

from ..core.compare_tests import coarser
from ..core.estimator import Estimator
from ..core.estimators.kalman import Kalman, KalmanState
from ..core.estimators.update import Theta, Update, theta_settings
from ..core.regression import Regression
from ..core.structure import Coefficient, Structure
from ..figures import markdown_table
from ..model_file import load_model
from . import cases
from .experiments import FOLDER, Run, estimate, with_noise
from .model_reduction import NOISE, TRUE_C, constant, recordings, reduced

METHODS = ("rls", "mrls", "constrained_kalman")
FILTERS = {"none": None, "CFC 180": 180, "CFC 60": 60}
UNLOADING = 6.0e5  # N/m, of the simulated door's inside
SUDDEN = (1.0 * 9.81, 20.0 * 9.81, 0.02)
"""m/s^2, m/s^2, s: noise of a sensor that is shaken: 1 g, and 20 g more at first, which decay."""
TESTS = 5
"""From which the variance over time is found, item 7."""


class FutureWork(NamedTuple):
    sampling: dict[tuple[str, str], dict[str, float]]  # (change, rate) -> method -> force error, share of the peak
    filtered: dict[str, dict[str, float]]  # filter -> method -> the same
    unloading: np.ndarray  # (seeds, 2) N/m, of both contacts
    damping: dict[str, np.ndarray]  # way -> (seeds, 2) rms error of K (share) to 20 ms and of C (share) at the end
    varying: dict[str, np.ndarray]  # way -> (seeds,) force error
    inside: dict[str, np.ndarray]  # way -> (seeds,) share of the time with the truth within 1.96 sigma


def force_error(run: Run, truth: Truth) -> float:
    """Rms over the record, share of each element's peak, the worst element that is estimated."""
    time = np.array([e.time_ns for e in run.estimates])
    force, found = np.array([e.force for e in run.estimates]), []
    for k, name in enumerate(run.description.elements):
        true = np.interp(time, truth.time_ns, truth.elements[name].force)
        found.append(np.sqrt(np.mean((force[:, k] - true)[time > 0] ** 2)) / np.abs(true).max())
    return float(max(found))


def frontal_fast(step: float, seed: int) -> tuple[Recording, Truth]:
    """The frontal test of 5.6.1 at 10 kHz, 3 g of noise and 10 kN, and a vibration of 300 Hz on both accelerometers."""
    base = replace(cases.frontal(step), rate=10_000.0, before=0.05, duration=0.08)
    noise = {"acceleration": 30.0, "force": 1.0e4}
    sensors = tuple(Sensor(s.channel, s.of, noise=noise[s.channel.quantity]) for s in base.sensors)
    recording, truth = record(replace(base, sensors=sensors), seed)
    t = np.maximum(recording.time, 0.0)
    ring = 60.0 * np.exp(-20.0 * t) * np.sin(2.0 * np.pi * 300.0 * t)
    shaken = [c.quantity == "acceleration" for c in recording.test.channels]
    return Recording(recording.test, recording.time_ns, recording.values + np.outer(ring, shaken)), truth


def sampling_and_filters(seeds: int) -> tuple[dict, dict]:
    structure = load_model(FOLDER / "frontal.yaml")
    sampled: dict[tuple[str, str], dict[str, list]] = {}
    filtered: dict[str, dict[str, list]] = {}
    for seed in range(seeds):
        for change, step in (("20 mm", 0.02), ("2 mm", 0.002)):
            fine, truth = frontal_fast(step, seed)
            for rate, one in (("0.1 ms", fine), ("1 ms", coarser(fine, 1e-3))):
                for method in METHODS:
                    error = force_error(estimate(structure, one, method), truth)
                    sampled.setdefault((change, rate), {}).setdefault(method, []).append(error)
        fine, truth = frontal_fast(0.02, seed)
        for name, cfc in FILTERS.items():
            one = fine if cfc is None else filter_recording(fine, cfc)
            for method in METHODS:
                error = force_error(estimate(structure, one, method), truth)
                filtered.setdefault(name, {}).setdefault(method, []).append(error)
    middle = [{k: {m: float(np.median(v)) for m, v in by.items()} for k, by in d.items()} for d in (sampled, filtered)]
    return middle[0], middle[1]


def unloading_slopes(seeds: int) -> np.ndarray:
    """Item 5: the slope is a parameter of both contacts, from half its value."""
    base = load_model("side_dummy")
    slope = Coefficient(0.5 * UNLOADING, estimated=True, std=UNLOADING, min=0.0, shape="constant")
    elements = tuple(replace(e, unloading=None, unloading_slope=slope) if e.unloading else e for e in base.elements)
    structure, found = replace(base, elements=elements), []
    for seed in range(seeds):
        run = estimate(structure, SCENARIOS["side_dummy_unpadded"](seed)[0], "constrained_kalman")
        places = [k for k, name in enumerate(run.description.parameters) if "unloading" in name]
        found.append([run.estimates[-1].parameters[k] for k in places])
    return np.array(found)


def damping(seeds: int) -> dict[str, np.ndarray]:
    """Item 6: constant K/M and C/M; C at once, once K is known to 5 %, and never."""
    true, tests = recordings(constant(600.0), seeds)
    found: dict[str, list] = {}
    for recording in tests:
        for way, model, settings in (
            ("at once", "K, C", {}), ("once K is known to 5 %", "K, C", {"damping_after": 0.05}), ("never", "K", {}),
        ):  # fmt: skip
            structure = with_noise(reduced(model), {"car_ax": NOISE})
            run = estimate(structure, recording, "kalman", **settings)
            k = np.array([e.parameters[0] for e in run.estimates])
            early = (recording.time > 0.005) & (recording.time <= 0.02)
            c = run.estimates[-1].parameters[1]
            errors = [
                np.sqrt(np.mean((k[early] / true[early] - 1.0) ** 2)),
                abs(k[-1] / true[-1] - 1.0),
                c / TRUE_C - 1.0,
            ]
            found.setdefault(way, []).append(errors)
    return {way: np.array(rows) for way, rows in found.items()}


@dataclass(frozen=True)
class Varying:
    """The Kalman filter with R2 given for each instant (7.3 item 7, first of GM's)."""

    filter: Kalman
    times: np.ndarray  # (n,) s
    variance: np.ndarray  # (n,) (m/s^2)^2

    @property
    def settings(self) -> Theta:
        return self.filter.settings

    def init(self, equations: int) -> KalmanState:
        return self.filter.init(equations)

    def update(self, state: KalmanState, regression: Regression) -> tuple[KalmanState, Update]:
        noise = np.full(len(regression.measured), np.interp(regression.time, self.times, self.variance))
        return self.filter.update(state._replace(noise=noise), regression)


def varying_noise(seeds: int) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Noise that decays after the impact; its variance over time from TESTS other tests' residuals."""
    exact, truth = record(replace(cases.chapter_4("#1"), rate=10_000.0, before=0.05).ideal(), 0)
    quiet, more, decay = SUDDEN
    t = exact.time
    sigma = np.where(t < 0.0, quiet, quiet + more * np.exp(-t / decay))

    def test(seed: int) -> Recording:
        noise = sigma * np.random.default_rng(seed).standard_normal(len(exact))
        return Recording(exact.test, exact.time_ns, exact.values + noise[:, None])

    base = load_model(FOLDER / "chapter_4.yaml")
    structure = replace(base, bodies=tuple(replace(b, noise=None) for b in base.bodies))
    true, found, inside = truth.elements["car_barrier"], {}, {}
    for seed in range(seeds):
        others = [estimate(structure, test(1000 * (seed + 1) + k), "kalman") for k in range(TESTS)]
        squares = np.mean([[e.residual[0] ** 2 for e in run.estimates] for run in others], axis=0)
        variance = np.convolve(np.pad(squares, 10, mode="edge"), np.ones(21) / 21.0, mode="valid")
        for way in ("constant, from before the impact", "learnt", "over time, from five tests"):
            run = _with_r2(structure, test(seed), way, t, variance)
            after = t > 0.01
            k = np.array([e.parameters[0] for e in run.estimates])[after]
            std = np.array([e.std[0] for e in run.estimates])[after]
            force = np.array([e.force[0] for e in run.estimates])
            error = np.sqrt(np.mean((force - true.force)[t > 0] ** 2)) / np.abs(true.force).max()
            found.setdefault(way, []).append(error)
            inside.setdefault(way, []).append(np.mean(np.abs(k - true.secant[after]) <= 1.96 * std))
    return {w: np.array(v) for w, v in found.items()}, {w: np.array(v) for w, v in inside.items()}


def _with_r2(structure: Structure, recording: Recording, way: str, times: np.ndarray, variance: np.ndarray) -> Run:
    if way != "over time, from five tests":
        return estimate(structure, recording, "kalman", noise_memory=0.005 if way == "learnt" else 0.0)
    method = Varying(Kalman(theta_settings(structure), False, 0.0, False), times, variance)
    estimator, estimates = Estimator(structure, recording.test, method, "kalman"), []
    state = estimator.init()
    for sample in recording.samples():
        state, one = estimator.step(state, sample)
        estimates.append(one)
    return Run(estimator.description, estimates, (estimator, state))


def future_work(seeds: int) -> FutureWork:
    sampled, filtered = sampling_and_filters(seeds)
    return FutureWork(sampled, filtered, unloading_slopes(seeds), damping(seeds), *varying_noise(seeds))


def section(found: FutureWork) -> list[str]:
    sampled = [
        (f"K changes within {change}, {rate}", *(f"{by[m]:.1%}" for m in METHODS))
        for (change, rate), by in found.sampling.items()
    ]
    filtered = [(name, *(f"{by[m]:.1%}" for m in METHODS)) for name, by in found.filtered.items()]
    slopes = np.median(found.unloading, axis=0) * 1e-3
    low, high = found.unloading.min() * 1e-3, found.unloading.max() * 1e-3
    dampings = [
        (way, f"{np.median(v[:, 0]):.0%}", f"{np.median(v[:, 1]):.1%}",
         "-" if way == "never" else f"{np.median(np.abs(v[:, 2])):.0%}")
        for way, v in found.damping.items()
    ]  # fmt: skip
    varying = [(w, f"{np.median(v):.1%}", f"{np.median(found.inside[w]):.0%}") for w, v in found.varying.items()]
    return [
        "## 7.3 Future work recommended, items 3 to 7", "",
        "The thesis has no numbers here; force errors are rms, share of the peak, the worst element, medians over "
        f"{len(found.unloading)} repetitions.", "",
        "**3, sampling where parameters change rapidly.** The frontal test of 5.6.1 with 3 g of noise, 10 kN on the "
        "barrier and a vibration of 300 Hz, default settings:", "",
        markdown_table(("test", *METHODS), sampled), "",
        "Unlike the slowly changing parameter of 4.5.3, these want the faster sampling: a change takes a "
        "millisecond or two, and at 1 ms a method has one sample of it.", "",
        "**4, filtered data.** The same at 0.1 ms, K changes within 20 mm, all channels filtered forwards and "
        "backwards:",
        "",
        markdown_table(("filter", *METHODS), filtered), "",
        "To filter helps the Kalman filter, for which less vibration is less noise. It leaves noise that is no "
        "longer independent from sample to sample: RLS, whose memory is short, gets worse by half; MRLS is about as "
        "good as before.", "",
        "**5, unloading estimated.** The dummy of 6.4 without padding, both contacts' slopes unknown, from half "
        f"their value of {UNLOADING * 1e-3:g} kN/m: {slopes[0]:.0f} and {slopes[1]:.0f} kN/m in the median, from "
        f"{low:.0f} to {high:.0f}.", "",
        f"**6, damping later.** One mass, K/M 600 and C/M {TRUE_C:g}, Kalman filter without drift:", "",
        markdown_table(
            ("C is estimated", "rms error of K/M, 5 to 20 ms", "error of K/M at the end", "error of C/M at the end"),
            dampings,
        ), "",
        "At the beginning there is much rate and little crush: left out, the damper passes for stiffness, and what "
        "was learnt so is in the filter for good. Later pays where C is not told at first, not here.", "",
        "**7, measurement noise that varies with time.** One mass of 4.5.1 at 10 kHz; noise of 1 g, and after the "
        f"impact {SUDDEN[1] / 9.81:.0f} g more that decay within {SUDDEN[2] * 1e3:g} ms. R2 of the Kalman filter "
        f"constant as in the thesis, learnt on the way (our default), and over time from the residuals of {TESTS} "
        "other tests:", "",
        markdown_table(("R2", "force error", "K/M within 1.96 sigma of the truth, share of the time"), varying), "",
        "A variance over time from like tests pays most, in force and sigma. To learn it in the one test is less "
        "good and its sigma too small: what K does not follow at once is taken for noise late.", "",
    ]  # fmt: skip
