"""The thesis's simulated problems, made by crash_replay.synthetic, which shares no formula with the estimators.

The assumed stiffness curves are in figures that its text lacks. Those here change abruptly: within 20 mm of crush,
1.5 ms at the impact's speed, by factors of up to four.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from crash_replay.gravity import G
from crash_replay.recording import Recording
from crash_replay.synthetic.curves import Curve, constant, stepped
from crash_replay.synthetic.dummy import side_dummy_unpadded
from crash_replay.synthetic.forces import Spring
from crash_replay.synthetic.scenario import Scenario, Truth, record
from crash_replay.synthetic.sensors import Sensor, accelerometer, load_cell_barrier, read
from crash_replay.synthetic.system import Body, Element, System

RATE = 1000.0  # Hz
NOISE_SHARES = {"frontal": (0.375, 0.404, 0.301), "side": (0.382, 0.293, 0.198)}
"""Of each output's standard deviation: noise over input in tables 5.1 and 5.2, equations 1 to 3."""
EQUAL = (0.37, 0.37, 0.37)
"""The mean of the frontal ones, about."""
ARMA_SETTLED = 100
"""Samples until the noise has forgotten that it began with nothing."""
STEP = 0.02
"""m of crush over which a stiffness changes."""

CHAPTER_4 = {  # K/M over crush, two sets as in figure 4.3
    "#1": Curve((0.0, 0.2, 0.4, 0.6), (500.0, 650.0, 550.0, 600.0)),
    "#2": Curve((0.0, 0.2, 0.4, 0.55), (500.0, 700.0, 600.0, 750.0)),
}


class Trial(NamedTuple):
    """One noisy repetition."""

    recording: Recording
    noise: dict[str, float]  # channel -> standard deviation of what was added


def chapter_4(which: str) -> Scenario:
    """4.5.1: M = 1, C/M = 1, 13.3 m/s, 80 ms; noise is added by `vibrating`."""
    spring = Spring(CHAPTER_4[which])
    system = System(
        (Body("car", 1.0, 13.3), Body("barrier")), (Element("car_barrier", ("car", "barrier"), spring, 1.0),)
    )
    sensors = (_exact(accelerometer("car_ax", "car")),)
    return Scenario(f"chapter_4{which}", "One mass on a barrier", system, sensors, 0.08, before=0.0, rate=RATE)


def frontal(step: float = STEP, shares: Sequence[float] = NOISE_SHARES["frontal"]) -> Scenario:
    """5.6.1, figure 5.2: M1 3000, M2 1000, K3 1e6, C 1000, 13.3 m/s, 100 ms."""
    system = System(
        (Body("cab", 3000.0, 13.3), Body("engine", 1000.0, 13.3), Body("barrier")),
        (
            Element(
                "cab_barrier",
                ("cab", "barrier"),
                Spring(stepped((0.0, 1.4e6), (0.20, 6.0e5), (0.42, 1.0e6), width=step), 3.0e7),
                1000.0,
            ),
            Element(
                "engine_barrier",
                ("engine", "barrier"),
                Spring(stepped((0.0, 2.0e5), (0.30, 8.0e5), (0.48, 4.0e5), width=step), 3.0e7),
                1000.0,
            ),
            Element("cab_engine", ("cab", "engine"), Spring(constant(1.0e6)), 1000.0),
        ),
    )
    sensors = (
        accelerometer("car_ax", "cab"),
        accelerometer("engine_ax", "engine"),
        load_cell_barrier("barrier_fx", "barrier"),
    )
    return Scenario(
        "frontal", "Cab and engine on a barrier", system, _noisy(sensors, shares), 0.1, before=0.0, rate=RATE
    )


def side(step: float = STEP, shares: Sequence[float] = NOISE_SHARES["side"]) -> Scenario:
    """5.6.1, figure 5.6: M1 1000, M2 80, M3 1500, C 2000, 14 m/s, 100 ms."""
    system = System(
        (Body("mdb", 1000.0, 14.0), Body("door", 80.0), Body("car", 1500.0)),
        (
            Element(
                "mdb_door",
                ("mdb", "door"),
                Spring(stepped((0.0, 9.0e5), (0.10, 5.5e5), (0.20, 7.5e5), width=step), 1.0e7),
                2000.0,
            ),
            Element(
                "door_car",
                ("door", "car"),
                Spring(stepped((0.0, 5.0e5), (0.12, 3.5e5), (0.24, 4.6e5), width=step), 1.0e7),
                2000.0,
            ),
        ),
    )
    sensors = _noisy([accelerometer(f"{body}_ay", body) for body in ("mdb", "door", "car")], shares)
    return Scenario("side", "Barrier, door and car", system, sensors, 0.1, before=0.0, rate=RATE)


def dummy() -> Scenario:
    """6.4.3, figure 6.4b: rib 16.8, pelvis 39.2, spine 28 kg on the motion of door and car; 3 g of noise."""
    base = side_dummy_unpadded()
    sensors = tuple(Sensor(sensor.channel, sensor.of, noise=3.0 * G) for sensor in base.sensors)
    return replace(base, name="dummy", sensors=sensors)


def trials(scenario: Scenario, seeds: int) -> tuple[Truth, Iterator[Trial]]:
    """Simulated once, recorded with the noise of each seed."""
    exact, truth = record(scenario.ideal(), 0)
    signals = [truth.channels[sensor.channel.name].signal for sensor in scenario.sensors]

    def one(seed: int) -> Trial:
        readings = [
            read(sensor, signal, np.random.default_rng([seed, k]))
            for k, (sensor, signal) in enumerate(zip(scenario.sensors, signals))
        ]
        values = np.stack([reading.values for reading in readings], axis=1)
        noise = {sensor.channel.name: reading.noise for sensor, reading in zip(scenario.sensors, readings)}
        return Trial(Recording(exact.test, exact.time_ns, values), noise)

    return truth, (one(seed) for seed in range(seeds))


def vibrating(scenario: Scenario, seeds: int) -> tuple[Truth, Iterator[Trial]]:
    """4.5.1: plus 10 sin(0.3 t), t in ms, and white noise of variance 10."""

    def noise(time: np.ndarray, generator: np.random.Generator) -> np.ndarray:
        return 10.0 * np.sin(0.3 * time * 1e3) + np.sqrt(10.0) * generator.standard_normal(len(time))

    return _plus(scenario, seeds, noise)


def arma(scenario: Scenario, seeds: int) -> tuple[Truth, Iterator[Trial]]:
    """The same with noise that is ARMA(1,2): its coefficients the best fit to `vibrating`'s, its variance 60 too."""

    def noise(time: np.ndarray, generator: np.random.Generator) -> np.ndarray:
        eps = np.sqrt(18.0) * generator.standard_normal(len(time) + ARMA_SETTLED)
        e = np.zeros(len(eps))
        for t in range(2, len(e)):
            e[t] = 0.78 * e[t - 1] + eps[t] - 0.05 * eps[t - 1] + 0.27 * eps[t - 2]
        return e[ARMA_SETTLED:]

    return _plus(scenario, seeds, noise)


def _plus(scenario: Scenario, seeds: int, noise: Callable) -> tuple[Truth, Iterator[Trial]]:
    exact, truth = record(scenario.ideal(), 0)

    def one(seed: int) -> Trial:
        added = noise(exact.time, np.random.default_rng(seed))
        return Trial(Recording(exact.test, exact.time_ns, exact.values + added[:, None]), {"car_ax": np.sqrt(10.0)})

    return truth, (one(seed) for seed in range(seeds))


def _exact(sensor: Sensor) -> Sensor:
    return Sensor(sensor.channel, sensor.of)


def _noisy(sensors: Sequence[Sensor], shares: Sequence[float]) -> tuple[Sensor, ...]:
    return tuple(Sensor(s.channel, s.of, noise_share=share) for s, share in zip(sensors, shares))
