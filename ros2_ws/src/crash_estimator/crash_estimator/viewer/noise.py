"""How much of each measured channel is the sensor's noise: the band that what a model leaves is held against.

It follows from the channel alone (`core.sensor_noise`), never from an estimator: one that fails believes in more noise.
"""

import numpy as np

from ..core.sensor_noise import ENOUGH, sensor_noise


class NoiseFloor:
    """Of every equation's measurement."""

    def __init__(self) -> None:
        self.heard: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {}  # time in ns, values
        self.samples: dict[str, int] = {}
        self.found: dict[str, tuple[int, float]] = {}  # from how many samples, standard deviation

    def hear(self, body: str, time_ns: np.ndarray, values: np.ndarray) -> float:
        """Standard deviation as far as it is known; NaN from too few samples."""
        self.heard.setdefault(body, []).append((time_ns, values))
        count = self.samples[body] = self.samples.get(body, 0) + len(time_ns)
        looked_at, _ = self.found.get(body, (0, np.nan))
        if count >= max(2 * ENOUGH, 2 * looked_at):  # ever more rarely: it takes all samples each time
            self.of_all(body)
        return self.known(body)

    def of_all(self, body: str) -> float:
        """From every sample so far."""
        time_ns, values = (np.concatenate(column) for column in zip(*self.heard[body]))
        valid = np.isfinite(values)
        time_ns, values = time_ns[valid], values[valid]
        std = sensor_noise(values, time_ns, rests=True).of_one_sample if len(values) >= 2 * ENOUGH else np.nan
        self.found[body] = self.samples[body], std
        return std

    def known(self, body: str) -> float:
        """What was found last."""
        return self.found.get(body, (0, np.nan))[1]

    def spans(self) -> dict[str, np.ndarray]:
        """(2,) ns, the first and the last instant, by body."""
        return {body: np.array([heard[0][0][0], heard[-1][0][-1]]) for body, heard in self.heard.items()}
