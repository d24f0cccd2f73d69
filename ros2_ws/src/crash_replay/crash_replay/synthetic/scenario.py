"""A scenario: a system, its sensors and how long they record; `record` makes a recording and its truth of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.constants import g as G

from ..recording import Recording, RecordingError, Test
from .integrate import History, simulate
from .sensors import Reading, Sensor, read
from .system import System
from .truth import BodyTruth, ChannelTruth, ElementTruth, body_truths, element_truths


@dataclass(frozen=True)
class Scenario:
    """Hidden effects are functions from a scenario to a scenario: other laws, other bodies or other sensors."""

    name: str
    title: str
    system: System
    sensors: tuple[Sensor, ...]
    duration: float  # s after the impact
    before: float = 0.050  # s before it, as in NHTSA tests: its mean gives the zero offset
    rate: float = 10_000.0  # Hz

    def at_speed(self, factor: float) -> "Scenario":
        return replace(self, system=self.system.at_speed(factor))

    def with_noise(self, noise: float) -> "Scenario":
        """noise: standard deviation of the accelerometers, g."""
        sensors = [s.with_noise(noise * G) if s.channel.quantity == "acceleration" else s for s in self.sensors]
        return replace(self, sensors=tuple(sensors))

    def ideal(self) -> "Scenario":
        """Sensors without noise, offset or quantisation."""
        return replace(self, sensors=tuple(sensor.ideal() for sensor in self.sensors))


class Truth(NamedTuple):
    """What really happened; row k belongs to the recording's sample k. Parameters and curves are in the scenario."""

    scenario: Scenario
    seed: int
    time_ns: np.ndarray  # (n,) ns since the impact
    bodies: Mapping[str, BodyTruth]
    elements: Mapping[str, ElementTruth]
    channels: Mapping[str, ChannelTruth]


def record(scenario: Scenario, seed: int) -> tuple[Recording, Truth]:
    """Simulate the scenario and record it; the same scenario and seed give the same numbers, bit for bit.

    Each sensor draws from a stream of its own, so that one more sensor leaves the others' noise as it is.
    """
    if not 0.0 < scenario.rate <= 1e6:
        raise RecordingError(
            f"scenario {scenario.name}: the rate must be above 0 and at most 1e6 Hz, got {scenario.rate:g}"
        )
    system, rate = scenario.system, scenario.rate
    before, after = round(scenario.before * rate), round(scenario.duration * rate)
    time_ns = np.rint(np.arange(-before, after + 1) * (1e9 / rate)).astype(np.int64)
    time = time_ns * 1e-9
    history = _with_time_before(system, simulate(system, time[before:]), time[:before])
    bodies, elements = body_truths(system, history), element_truths(system, history)
    signals = [_signal(sensor, bodies, elements) for sensor in scenario.sensors]
    readings = [
        read(sensor, signal, np.random.default_rng([seed, k]))
        for k, (sensor, signal) in enumerate(zip(scenario.sensors, signals))
    ]
    channels = {
        sensor.channel.name: ChannelTruth(signal, reading.noise, reading.offset)
        for sensor, signal, reading in zip(scenario.sensors, signals, readings)
    }
    values = np.stack([reading.values for reading in readings], axis=1)
    truth = Truth(scenario, seed, time_ns, bodies, elements, channels)
    return Recording(_test(scenario, seed, readings), time_ns, values), truth


def _with_time_before(system: System, history: History, before: np.ndarray) -> History:
    """The history with the instants (m,) s before the impact: steady motion, no force."""
    velocity = np.tile(history.velocity[0], (len(before), 1))
    displacement = history.displacement[0] + before[:, None] * velocity
    a, b = np.array(system.ends()).T
    still, unloaded = np.zeros_like(velocity), np.zeros((len(before), len(system.elements)))
    crush, rate = displacement[:, a] - displacement[:, b], velocity[:, a] - velocity[:, b]
    quiet = History(before, displacement, velocity, still, still, crush, rate, unloaded, unloaded)
    return History(*(np.concatenate(columns) for columns in zip(quiet, history)))


def _signal(sensor: Sensor, bodies: dict[str, BodyTruth], elements: dict[str, ElementTruth]) -> np.ndarray:
    match sensor.channel.quantity:
        case "acceleration":
            return bodies[sensor.of].acceleration
        case "force":
            return bodies[sensor.of].load
        case "displacement":
            return elements[sensor.of].crush
        case "velocity":
            return elements[sensor.of].rate
    raise ValueError(f"sensor {sensor.channel.name}: nothing here simulates {sensor.channel.quantity}")


def _test(scenario: Scenario, seed: int, readings: Sequence[Reading]) -> Test:
    noise = ", ".join(
        f"{s.channel.name} {r.noise:.3g} {s.channel.unit}" for s, r in zip(scenario.sensors, readings) if r.noise
    )
    moving = [body for body in scenario.system.bodies if body.mass or body.motion]
    return Test(
        id=scenario.name,
        channels=tuple(sensor.channel for sensor in scenario.sensors),
        title=scenario.title,
        source=f"simulated by crash_replay, seed {seed}",
        initial_velocity={body.name: body.velocity for body in moving},
        initial_displacement={body.name: body.displacement for body in moving},
        notes=(f"standard deviation of the sensors' noise: {noise or 'none'}",),
    )
