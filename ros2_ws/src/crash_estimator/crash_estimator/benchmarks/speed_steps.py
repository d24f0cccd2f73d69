"""How long one step takes: called for each sample, and over a whole record; filterpy, numpy and C++ beside it."""

from collections.abc import Iterator
from dataclasses import fields
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit

from crash_replay.recording import Sample
from crash_replay.synthetic.recordings import SCENARIOS

from ..core.compiled.estimator import CompiledEstimator
from ..core.compiled.factors import widen
from ..core.compiled.kalman import kalman_update
from ..core.estimate import Estimate
from ..core.estimators.kalman import SMALLEST_SHARE
from ..core.fold import run
from ..core.methods import make_estimator
from ..model_file import load_model
from .speed_reference import Compiled, Problem, filterpy_step, regressions
from .speed_row import Row, microseconds, per_call

MRLS: dict[str, Any] = {"forgetting": 0.98, "m": 5, "cr": 3.0, "limit": 2.58, "rewinds": 10}
PROMISED = 5e-6
"""s for one call with its whole Estimate: a sample at 200 kHz."""
FIELDS = tuple(one.name for one in fields(Estimate))
SETTINGS: dict[str, Any] = {
    "forgetting": 0.98,
    "m": 5,
    "cr": 3.0,
    "error_limit": 2.58,
    "rewinds": 10,
    "step_limit": 1e9,
}


@njit(cache=True)
def _filter(  # noqa: PLR0913 - compiled: arrays only
    theta, factors, noise, psi, target, walk, active, lower, upper, scale, smallest, clamped
):  # fmt: skip
    unit, gain = np.empty(len(theta)), np.empty((len(theta), len(noise)))
    for t in range(len(psi)):
        for j in range(len(theta)):
            if walk[t, j] > 0.0:
                widen(factors, walk[t, j] * max(abs(theta[j]), smallest * scale[j]) ** 2, j, unit)
        kalman_update(theta, factors, noise, psi[t], target[t], active[t], lower, upper, True, clamped, gain)


def filtered(problem: Problem) -> np.ndarray:
    """theta (p,) after the record, by the project's compiled filter alone."""
    theta, factors = problem.initial.copy(), np.diag(problem.std**2)
    _filter(
        theta, factors, problem.noise, problem.psi, problem.target, problem.walk, problem.active, problem.lower,
        problem.upper, problem.scale, SMALLEST_SHARE, np.zeros(len(theta)),
    )  # fmt: skip
    return theta


def steps(folder: Path) -> Iterator[Row]:
    """Five stiffnesses on three equations: the dummy at 10 kHz."""
    structure, (recording, _) = load_model("side_dummy"), SCENARIOS["side_dummy_padded"](3)
    problem, compiled = regressions(structure, recording), Compiled.make(folder)
    yield from _kalman_calls(structure, recording, problem)
    yield from _records(structure, recording, problem, compiled)


def _kalman_calls(structure, recording, problem: Problem) -> Iterator[Row]:
    k = len(problem.psi) // 2
    theta, factors, clamped = problem.initial.copy(), np.diag(problem.std**2), np.zeros(len(problem.initial))
    sample = (problem.psi[k].copy(), problem.target[k].copy(), problem.active[k].copy())
    bounds, gain = (problem.lower, problem.upper), np.zeros((len(theta), len(problem.noise)))
    alone = per_call(lambda: kalman_update(theta, factors, problem.noise, *sample, *bounds, True, clamped, gain))
    reference = filterpy_step(problem, k)
    theirs = per_call(reference) if reference else None
    said = f"filterpy {microseconds(theirs)}" if theirs else "filterpy is not installed"

    def ratio(seconds: float) -> float | None:
        return theirs / seconds if theirs else None

    yield Row("constrained Kalman filter, a call per sample", microseconds(alone), said, ratio(alone), 10.0)
    middle = list(recording.samples())[len(recording) // 2]
    for method in ("constrained_kalman", "mrls"):
        estimator = make_estimator(structure, recording.test, method)
        assert isinstance(estimator, CompiledEstimator)
        state = estimator.init()
        state, _ = estimator.follow(state, recording.time_ns[: middle.number], recording.values[: middle.number])
        time_ns, values = recording.time_ns[middle.number :][:1], recording.values[middle.number :][:1]
        one = per_call(partial(estimator.follow, state, time_ns, values))
        whole = per_call(partial(estimator.step, state, middle))
        name = f"whole estimator, {method}, a call per sample"
        read = per_call(partial(_read, estimator, state, middle))
        reached = whole / PROMISED
        yield Row(f"{name}, numbers only (`follow`)", microseconds(one), said + ", filter alone", ratio(one))
        yield Row(
            f"{name}, with its Estimate (`step`)",
            microseconds(whole),
            microseconds(PROMISED),
            reached,
            1.0,
            least=False,
        )
        yield Row(f"{name}, all of its Estimate read", microseconds(read), said + ", filter alone", ratio(read))


def _read(estimator: CompiledEstimator, state: np.ndarray, sample: Sample) -> list:
    """Each field of its Estimate: they are made when they are asked for."""
    estimate = estimator.step(state, sample)[1]
    return [getattr(estimate, name) for name in FIELDS]


def _records(structure, recording, problem: Problem, compiled: Compiled | None) -> Iterator[Row]:
    n, samples = len(problem.psi), list(recording.samples())
    limits = {}
    if compiled:
        limits["constrained_kalman"] = per_call(lambda: compiled.constrained_kalman(problem)) / n
        limits["mrls"] = per_call(lambda: compiled.mrls(problem, *MRLS.values())) / n
    alone = per_call(lambda: filtered(problem)) / n
    yield _beside("constrained Kalman filter, a sample of a record", alone, limits.get("constrained_kalman"), 5.0)
    for method, settings in (("constrained_kalman", {}), ("mrls", SETTINGS)):
        estimator = make_estimator(structure, recording.test, method, **settings)
        record = per_call(partial(_followed, estimator, recording)) / len(recording)
        name = f"whole estimator, {method}, a sample of a record"
        yield _beside(name, record, limits.get(method), None, ", recursion alone")
        readable = make_estimator(structure, recording.test, method, compiled=False, **settings)
        plain = per_call(partial(run, readable, samples[:400]), 0.01) / 400
        yield Row(name, microseconds(record), f"numpy {microseconds(plain)}", plain / record)


def _followed(estimator, recording):
    return estimator.follow(estimator.init(), recording.time_ns, recording.values)


def _beside(what: str, seconds: float, limit: float | None, reach: float | None, note: str = "") -> Row:
    if limit is None:
        return Row(what, microseconds(seconds), "there is no g++")
    return Row(what, microseconds(seconds), f"C++ -O3 {microseconds(limit)}{note}", seconds / limit, reach, least=False)
