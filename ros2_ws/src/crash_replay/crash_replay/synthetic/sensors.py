"""Sensors: what a channel records of the true signal.

recorded = step * round(clip(seen + zero offset + white noise, full scale) / step)

Seen is the true signal `delay` ago, and then what the sensor's `distortion` makes of it.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..gravity import G
from ..recording import Channel


@dataclass(frozen=True)
class Sensor:
    """One channel and how it errs, in its SI unit."""

    channel: Channel
    of: str  # acceleration, force: a body; displacement, velocity: an element's crush and its rate
    noise: float = 0.0  # standard deviation
    noise_share: float = 0.0  # the same as a share of the signal's standard deviation; both add up
    offset: float = 0.0  # the zero offset is drawn evenly from +- this
    step: float = 0.0  # quantisation; 0 for none
    full_scale: float = np.inf
    delay: float = 0.0  # s
    distortion: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None  # (time from zero on, signal) -> seen

    def ideal(self) -> "Sensor":
        """The same sensor without noise, offset or quantisation."""
        return Sensor(self.channel, self.of, delay=self.delay, distortion=self.distortion)

    def with_noise(self, noise: float) -> "Sensor":
        return replace(self, noise=noise, noise_share=0.0)


class Reading(NamedTuple):
    values: np.ndarray  # (n,) recorded
    noise: float  # standard deviation of the noise
    offset: float  # the zero offset that was drawn


def read(sensor: Sensor, signal: np.ndarray, rng: np.random.Generator) -> Reading:
    """What the sensor records of the true signal (n,); always draws n + 1 numbers, whatever its settings."""
    offset = sensor.offset * rng.uniform(-1.0, 1.0)
    noise = sensor.noise + sensor.noise_share * float(np.std(signal))
    values = np.clip(signal + offset + noise * rng.standard_normal(len(signal)), -sensor.full_scale, sensor.full_scale)
    if sensor.step:
        values = sensor.step * np.rint(values / sensor.step)
    return Reading(values, noise, offset)


def accelerometer(name: str, body: str, noise: float = 1.0, offset: float = 0.5, step: float = 0.03) -> Sensor:
    """Noise, largest zero offset and step in g; 2000 g full scale. The name ends in the axis."""
    channel = Channel(name, "acceleration", body, name[-1])
    return Sensor(channel, body, noise=noise * G, offset=offset * G, step=step * G, full_scale=2000.0 * G)


def load_cell_barrier(name: str, body: str) -> Sensor:
    """The force on a barrier: 0.5 % of 600 kN as noise (its cells summed), steps of 100 N, an offset within 1 kN."""
    channel = Channel(name, "force", body, name[-1])
    return Sensor(channel, body, noise=3000.0, offset=1000.0, step=100.0, full_scale=3e6)


def crush_sensor(name: str, element: str) -> Sensor:
    """A displacement transducer with a noise and steps of 1 um."""
    return Sensor(Channel(name, "displacement"), element, noise=1e-6, step=1e-6)


def crush_rate_sensor(name: str, element: str) -> Sensor:
    """Noise of 1 mm/s, steps of 0.01 mm/s."""
    return Sensor(Channel(name, "velocity"), element, noise=1e-3, step=1e-5)
