"""How often the truth lies inside the stated 95 %, for every method that states a sigma; `coverage_page` prints it.

Tests are simulated, their crush integrated from noisy accelerometers whose zero is known from the samples before the
impact alone. They are looked at where an element loads and its crush is over `LEAST_CRUSH`.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np

from crash_replay.recording import Recording, Test
from crash_replay.synthetic.curves import constant
from crash_replay.synthetic.forces import Spring
from crash_replay.synthetic.recordings import BUILDERS
from crash_replay.synthetic.scenario import Scenario, Truth, record
from crash_replay.synthetic.sensors import read

from ..core.compiled.estimator import CompiledEstimator
from ..core.methods import make_estimator
from ..core.structure import Structure
from ..model_file import load_model

METHODS = ("rls", "mrls", "kalman", "constrained_kalman", "gauss_newton", "afmm")
TESTS = {  # recording: model
    "frontal_single": "frontal_single",
    "frontal_engine_cab": "frontal_engine_cab",
    "side_mdb_door_car": "side_mdb_door_car",
    "side_dummy_unpadded": "side_dummy",
    "impactor_single": "impactor_single",
}
NOISES = (0.5, 1.0, 2.0, 3.0)
"""g, of the accelerometers: one after the other, seed by seed."""
LEAST_CRUSH, LEAST_SHARE = 0.010, 0.3
"""m, and share of the element's largest crush where that is smaller: below it a spring's force is small beside the
noise."""
INSTANTS = 5
"""In each element's time of loading beyond that, evenly from its first sample to its last."""
LIMIT = 1.96
"""Standard deviations that a normal error stays within in 95 %."""
NORMAL_MEDIAN = 0.6745
"""Of a standard normal error's absolute value."""


class Look(NamedTuple):
    """A parameter at an instant."""

    sample: int
    parameter: int
    truth: float


class Draw(NamedTuple):
    """What one method said in one test with one seed, at all looks."""

    error: np.ndarray  # (looks,)
    std: np.ndarray  # (looks,) as stated


@cache
def simulated(name: str, drifting: bool, elastic: bool) -> Truth:
    """The test without sensors' errors: simulated once for all seeds.

    Its springs unload and pull as the model has it that the method is given (elastic: as one without unloading lines):
    a sigma speaks of noise and of errors in the motion, not of what the model has wrong.
    """
    scenario, model = BUILDERS[name](), {e.name: e for e in load_model(TESTS[name]).elements}
    elements = []
    for element in scenario.system.elements:
        assert isinstance(element.spring, Spring)
        curve, of_model = element.spring.stiffness, model[element.name]
        spring = replace(
            element.spring,
            stiffness=curve if drifting else constant(float(np.median(curve.y))),
            unloading=None if elastic else of_model.unloading,
            tension=of_model.tension,
        )
        elements.append(replace(element, spring=spring))
    scenario = replace(scenario, system=replace(scenario.system, elements=tuple(elements)))
    return record(scenario.ideal(), 0)[1]._replace(scenario=scenario)


def recorded(truth: Truth, noise: float, seed: int) -> Recording:
    """The test as its sensors record it; noise in g. As `scenario.record` has it, the same seed and numbers."""
    scenario = truth.scenario.with_noise(noise)
    values = [
        read(sensor, truth.channels[sensor.channel.name].signal, np.random.default_rng([seed, k])).values
        for k, sensor in enumerate(scenario.sensors)
    ]
    return Recording(_test_of(truth.scenario), truth.time_ns, np.stack(values, axis=1))


@cache
def _test_of(scenario: Scenario) -> Test:
    return record(replace(scenario.ideal(), duration=2.0 / scenario.rate), 0)[0].test


def model_for(name: str, drifting: bool) -> Structure:
    """The ready model; of a constant stiffness with `shape: constant`, which is what is known of it then."""
    structure = load_model(TESTS[name])
    if drifting:
        return structure
    elements = tuple(
        replace(e, stiffness=replace(e.stiffness, shape="constant", drift=None)) for e in structure.elements
    )
    return replace(structure, elements=elements)


def looks(structure: Structure, truth: Truth) -> list[Look]:
    """Each estimated stiffness and damping at `INSTANTS` of its element's loading beyond `LEAST_CRUSH`."""
    found, scenario = [], truth.scenario
    damping = {element.name: element.damping for element in scenario.system.elements}
    for j, parameter in enumerate(structure.parameters):
        if not parameter.coefficient.estimated:
            continue
        name = structure.elements[parameter.element].name
        element = truth.elements[name]
        crush = np.abs(element.crush)
        loading = (crush > min(LEAST_CRUSH, LEAST_SHARE * crush.max())) & (element.state == "loading")
        samples = np.flatnonzero(loading)
        for n in samples[np.linspace(0, len(samples) - 1, INSTANTS).astype(int)] if len(samples) else ():
            value = element.secant[n] if parameter.is_stiffness else damping[name]
            found.append(Look(int(n), j, float(value)))
    return found


def said(structure: Structure, recording: Recording, method: str, places: list[Look]) -> Draw:
    """The method's values at the looks; it sees the recording up to the last of them."""
    estimator, last = make_estimator(structure, recording.test, method), max(look.sample for look in places)
    at, which = [look.sample for look in places], [look.parameter for look in places]
    if isinstance(estimator, CompiledEstimator):
        _, rows = estimator.follow(estimator.init(), recording.time_ns[: last + 1], recording.values[: last + 1])
        value, std = (rows[:, estimator.columns[field]][at, which] for field in ("parameters", "std"))
    else:
        wanted, state, kept = set(at), estimator.init(), {}
        for sample in recording.samples():
            if sample.number > last:
                break
            state, estimate = estimator.step(state, sample)
            if sample.number in wanted:
                kept[sample.number] = estimate.parameters, np.sqrt(np.diagonal(estimate.covariance))
        value, std = (np.array([kept[n][part][j] for n, j in zip(at, which)]) for part in (0, 1))
    return Draw(value - [look.truth for look in places], std)


class Row(NamedTuple):
    """One parameter of one model by one method."""

    model: str
    parameter: str
    method: str
    inside: float  # share of seeds and instants at which the truth lies within `LIMIT` sigma
    by_instant: np.ndarray  # (INSTANTS,) the same at each
    spread: float  # median of |error| / sigma, over that of a normal error: 1 where the sigmas are right
    relative: float  # median sigma over the truth


def rows(
    seeds: range, drifting: bool, methods: Sequence[str] = METHODS, tests: Sequence[str] = tuple(TESTS)
) -> Iterator[Row]:
    """One row for each test, method and parameter; the noise goes round `NOISES` seed by seed."""
    for name in tests:
        structure = model_for(name, drifting)
        for method in methods:
            truth = simulated(name, drifting, elastic=method == "kalman")
            places = looks(structure, truth)
            index = np.array([look.parameter for look in places])
            values = np.array([look.truth for look in places])
            draws = [
                said(structure, recorded(truth, NOISES[k % len(NOISES)], seed), method, places)
                for k, seed in enumerate(seeds)
            ]
            error, std = (np.array([getattr(draw, part) for draw in draws]) for part in ("error", "std"))
            inside = np.abs(error) <= LIMIT * std
            for j in dict.fromkeys(index.tolist()):
                of = index == j
                yield Row(
                    TESTS[name],
                    structure.parameters[j].name,
                    method,
                    float(inside[:, of].mean()),
                    inside[:, of].mean(axis=0),
                    float(np.median(np.abs(error / std)[:, of]) / NORMAL_MEDIAN),
                    float(np.median((std / np.abs(values))[:, of])),
                )
