"""What is recorded of a motion: the sensors' mounts, errors, noise, range, filters and clocks, in the order of the
chain.

A nuisance is a trouble of all sensors, or of one, that is no effect:

    clean      white noise and a constant zero
    coloured   the same noise behind a pole at 150 to 800 Hz, at the same RMS
    ringing    mounts that resonate at 300 to 900 Hz, 2 to 5 % damped, struck by the impact: 3 to 8 % of the peak
    cfc180     all channels filtered with CFC 180, forward and backward (SAE J211-1)
    1khz       that, and every tenth sample kept
    clipped    one accelerometer whose range ends at 80 to 90 % of its peak
    shifted    a time zero 1 to 5 ms off, to either side, other in each recording
    masses     the model's masses are 1 to 2 % off
    drifting   zeros that drift by 0.05 to 0.2 g in 100 ms
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import cos, inf, pi, radians

import numpy as np
from scipy.signal import butter, filtfilt, lfilter

from ..recording import Channel, Recording, Test
from .forms import Wrong
from .machine import Motion
from .structures import G, Rng, Setup

RATE = 10_000.0
BEFORE = 0.03
"""s recorded before the impact."""

STEP = 1000.0 * G / 2**16
"""m/s^2: 16 bits over +- 500 g."""

LOAD_CELL = 1500.0
"""N of noise of the barrier's cells for each g of the accelerometers'."""

NUISANCES = ("clean", "coloured", "ringing", "cfc180", "1khz", "clipped", "shifted", "masses", "drifting")


def times(until: float) -> np.ndarray:
    return np.arange(-round(BEFORE * RATE), round(until * RATE)) / RATE


@dataclass(frozen=True)
class Sensors:
    """Of one structure; what is drawn here is the same in all its recordings."""

    setup: Setup
    wrong: Mapping[str, Wrong]
    noise: float  # g
    nuisance: str

    def late(self) -> float:
        """s by which the wrong channel is late: its motion is asked for at earlier times."""
        return sum(w.size for w in self.wrong.values() if w.kind == "delay")

    def true(self, motion: Motion, late: Motion) -> dict[str, np.ndarray]:
        """Channel -> what its sensor would say with no noise, m/s^2 or N: all that is wrong with it in it."""
        signals = {}
        for i, body in enumerate(self.setup.bodies):
            name = f"{body.name}_a{self.setup.axis}"
            if body.name in self.setup.hidden_bodies or (body.mass == inf and not body.motion):
                continue
            wrong = self.wrong.get(name)
            signal = late.a[:, i] if wrong and wrong.kind == "delay" else motion.a[:, i]
            signals[name] = _erroneous(signal, motion.time, wrong) if wrong else signal
        if self.setup.barrier:
            onto = [k for k, joint in enumerate(self.setup.joints.values()) if joint.b == self.setup.barrier]
            signals[f"{self.setup.barrier}_f{self.setup.axis}"] = motion.forces[:, onto].sum(axis=1)
        return signals

    def record(self, tests: list[tuple[Motion, Motion]], seed: int, title: str) -> list[Recording]:
        """The recordings of several tests with one set of sensors."""
        signals = [self.true(motion, late) for motion, late in tests]
        shared = np.random.default_rng([seed, 1_000_003])
        ranges = self._ranges(signals, shared)
        mounts = {name: (shared.uniform(300.0, 900.0), shared.uniform(0.02, 0.05)) for name in signals[0]}
        corner = shared.uniform(150.0, 800.0)
        recordings = []
        for k, (motion, _) in enumerate(tests):
            rng = np.random.default_rng([seed, 1_000_003, k])
            columns = []
            for name, signal in signals[k].items():
                if self.nuisance == "ringing" and name not in _forces(self.setup):
                    signal = _rung(signal, motion.time, mounts[name], rng)
                columns.append(self._noisy(name, signal, motion.time, corner, ranges.get(name, inf), rng))
            recordings.append(self._recording(f"{title} {k + 1}", motion, list(signals[k]), columns, rng))
        return recordings

    def _ranges(self, signals: list[dict[str, np.ndarray]], rng: Rng) -> dict[str, float]:
        """Channel -> where its range ends."""
        if self.nuisance != "clipped":
            return {}
        name = str(rng.choice([f"{body}_a{self.setup.axis}" for body in self.setup.free]))
        return {name: rng.uniform(0.8, 0.9) * max(float(np.abs(s[name]).max()) for s in signals)}

    def _noisy(
        self, name: str, signal: np.ndarray, time: np.ndarray, corner: float, end: float, rng: Rng
    ) -> np.ndarray:
        force = name in _forces(self.setup)
        size = self.noise * (LOAD_CELL if force else G)
        noise = rng.standard_normal(len(signal))
        if self.nuisance == "coloured":
            pole = np.exp(-2.0 * pi * corner / RATE)
            noise = lfilter([np.sqrt(1.0 - pole**2)], [1.0, -pole], noise)
        signal = signal + size * noise + rng.uniform(-1.0, 1.0) * size
        if self.nuisance == "drifting" and not force:
            sign = 1.0 if rng.random() < 0.5 else -1.0
            signal = signal + sign * rng.uniform(0.05, 0.2) * G * time / 0.1
        signal = np.clip(signal, -end, end)
        if self.nuisance in ("cfc180", "1khz"):
            signal = cfc(signal, 180.0)
        return signal if force else np.round(signal / STEP) * STEP

    def _recording(
        self, title: str, motion: Motion, names: list[str], columns: list[np.ndarray], rng: Rng
    ) -> Recording:
        time_ns = np.round(motion.time * 1e9).astype(np.int64)
        values = np.column_stack(columns)
        if self.nuisance == "1khz":
            time_ns, values = time_ns[::10], values[::10]
        if self.nuisance == "shifted":  # stated late where positive: it was struck before what is called zero
            shift = rng.uniform(1.0e-3, 5.0e-3) * (1.0 if rng.random() < 0.5 else -1.0)
            time_ns = time_ns - int(round(shift * 1e9))
        channels = tuple(_channel(name, self.setup) for name in names)
        seen = [
            b.name for b in self.setup.bodies if b.name not in self.setup.hidden_bodies and b.name != self.setup.barrier
        ]
        of_all = zip(self.setup.bodies, self.setup.stated * motion.v[0], strict=True)
        at_zero = {body.name: float(v) for body, v in of_all if body.name in seen}
        test = Test(title, channels, source="simulated", initial_velocity=at_zero)
        return Recording(test, time_ns, values)


def cfc(signal: np.ndarray, channel_class: float) -> np.ndarray:
    """SAE J211-1, appendix C: a Butterworth filter of two poles, run forward and backward; -3 dB at 1.65 times the
    class."""
    b, a = butter(2, 2.0775 * channel_class, fs=RATE)
    return filtfilt(b, a, signal)


def _forces(setup: Setup) -> tuple[str, ...]:
    return (f"{setup.barrier}_f{setup.axis}",) if setup.barrier else ()


def _channel(name: str, setup: Setup) -> Channel:
    body = name[:-3]
    return Channel(name, "force" if name[-2] == "f" else "acceleration", body, setup.axis, "second generator")


def _erroneous(signal: np.ndarray, time: np.ndarray, wrong: Wrong) -> np.ndarray:
    after = np.maximum(time, 0.0)
    if wrong.kind == "offset":  # a zero that the blow has moved
        return signal + wrong.size * G * (time >= 0.0)
    if wrong.kind == "drift":
        return signal + wrong.size * G * after / time[-1]
    if wrong.kind == "gain":
        return signal * wrong.size
    if (
        wrong.kind == "misaligned"
    ):  # what is left of the axis; across it the structure shakes by 2 % of the peak, at 40 Hz
        askew = radians(wrong.size)
        across = 0.02 * float(np.abs(signal).max()) * np.sin(2.0 * pi * 40.0 * after) * np.exp(-after / 0.05)
        return signal * cos(askew) + np.sin(askew) * across
    if wrong.kind == "lowpass":  # an analogue filter of two poles in this channel alone: late by sqrt(2) / (2 pi f)
        return lfilter(*butter(2, wrong.size, fs=RATE), signal)
    return signal


def _rung(signal: np.ndarray, time: np.ndarray, mount: tuple[float, float], rng: Rng) -> np.ndarray:
    """Behind a mount of one degree of freedom, y'' + 2 z w y' + w^2 y = w^2 a, that the impact has struck as well."""
    frequency, damping = mount
    w = 2.0 * pi * frequency
    poles = np.exp((-damping + 1j * np.sqrt(1.0 - damping**2) * np.array([1.0, -1.0])) * w / RATE)
    a = np.real(np.poly(poles))
    rung = lfilter([a.sum()], a, signal)
    after = np.maximum(time, 0.0)
    struck = rng.uniform(0.03, 0.08) * float(np.abs(signal).max()) * np.exp(-damping * w * after)
    return rung + struck * np.sin(w * after)
