"""A scenario: a system, its sensors and how long they record; `record` makes a recording and its truth of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..gravity import G
from ..recording import Recording, RecordingError, Test
from .integrate import MAX_STEP, History, simulate
from .sensors import Reading, Sensor, read
from .system import Body, Element, System
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
    max_step: float = MAX_STEP  # s, of the integration
    stated: float = 1.0  # speeds that the test states, times the real ones

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
    moving = simulate(system, time[before:], scenario.max_step)
    quiet = _before(system, moving, time[:before])
    history = History(*(np.concatenate(columns) for columns in zip(quiet, moving)))
    seen = signals_of(system, scenario.sensors, time[before:], scenario.max_step, moving)
    readings = [
        read(sensor, np.append(_signal(sensor, system, quiet), signal), np.random.default_rng([seed, k]))
        for k, (sensor, signal) in enumerate(zip(scenario.sensors, seen))
    ]
    channels = {
        sensor.channel.name: ChannelTruth(_signal(sensor, system, history), reading.noise, reading.offset)
        for sensor, reading in zip(scenario.sensors, readings)
    }
    values = np.stack([reading.values for reading in readings], axis=1)
    truth = Truth(scenario, seed, time_ns, body_truths(system, history), element_truths(system, history), channels)
    return Recording(_test(scenario, seed, readings), time_ns, values), truth


def _before(system: System, history: History, before: np.ndarray) -> History:
    """The instants (m,) s before the impact that a history begins with: steady motion, no force."""
    velocity = np.tile(history.velocity[0], (len(before), 1))
    displacement = history.displacement[0] + before[:, None] * velocity
    a, b = np.array(system.ends()).T
    still, unloaded = np.zeros_like(velocity), np.zeros((len(before), len(system.elements)))
    crush, rate = displacement[:, a] - displacement[:, b], velocity[:, a] - velocity[:, b]
    return History(before, displacement, velocity, still, still, crush, rate, unloaded, unloaded)


def _signal(sensor: Sensor, system: System, history: History) -> np.ndarray:
    match sensor.channel.quantity:
        case "acceleration":
            return history.acceleration[:, _index(system.bodies, sensor.of)]
        case "force":
            return history.load[:, _index(system.bodies, sensor.of)]
        case "displacement":
            return history.crush[:, _index(system.elements, sensor.of)]
        case "velocity":
            return history.rate[:, _index(system.elements, sensor.of)]
    raise ValueError(f"sensor {sensor.channel.name}: nothing here simulates {sensor.channel.quantity}")


def _index(parts: Sequence[Body] | Sequence[Element], name: str) -> int:
    return [part.name for part in parts].index(name)


def signals_of(
    system: System, sensors: Sequence[Sensor], time: np.ndarray, max_step: float, history: History | None = None
) -> list[np.ndarray]:
    """What each sensor sees at the instants `time` (n,) from 0 on, without its noise, offset and quantisation.

    history: what happens at these instants, where it is simulated already. What a late sensor sees is simulated at the
    instants that it sees: to interpolate would smooth every edge.
    """
    histories = {0.0: simulate(system, time, max_step) if history is None else history}
    signals = []
    for sensor in sensors:
        seen = time - sensor.delay
        if sensor.delay not in histories:
            histories[sensor.delay] = simulate(system, np.append(0.0, seen[seen > 0.0]), max_step)
        found = _signal(sensor, system, histories[sensor.delay])
        signal = np.append(np.zeros(len(time) - len(found) + 1), found[1:]) if sensor.delay else found
        signals.append(sensor.distortion(time, signal) if sensor.distortion else signal)
    return signals


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
        initial_velocity={body.name: scenario.stated * body.velocity for body in moving},
        initial_displacement={body.name: body.displacement for body in moving},
        notes=(f"standard deviation of the sensors' noise: {noise or 'none'}",),
    )
