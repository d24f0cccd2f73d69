"""A recording made ready for the fit: samples after the impact on an even grid, and what is known of their noise.

The simulation runs on a grid that has every sample on it, at no more than `LONGEST_STEP`. Each channel that a body or
force is measured by is one output; outputs are compared in means over short bins of samples, since what a
crash model can say ends far below 1 kHz.
"""

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from crash_replay.conditioning import RESTS_AT_ZERO
from crash_replay.recording import SI_UNIT, Recording, RecordingError, Test
from crash_replay.time_unit import SECOND

from ...derived_motion import between_samples, smoothed
from ...kinematics import Kinematics, zero_crush
from ...noise_spectrum import NoiseSpectrum, seen_early
from ...sensor_noise import sensor_noise
from ...structure import ModelError, Structure
from .gaps import through_gaps
from .grid import bins_of, grid_of, modes_of, on_grid
from .pace import longest_step
from .rest import Rest, bridged, rests_of, seen_early_by
from .tracked_motion import tracked_acceleration
from .whitening import coefficients, filtered, weights

FEWEST_SAMPLES = 20
"""After the impact: 2 ms at 10 kHz, five bins, in which no curve has a second slope yet."""


class Signal(NamedTuple):
    """One channel, zero offset removed, NaN bridged, from before the impact to the end."""

    time: np.ndarray  # s since the impact
    values: np.ndarray
    on_grid: np.ndarray  # (g,) values at the instants of the record
    spectrum: NoiseSpectrum
    offset_std: float  # of the zero offset that was removed

    @property
    def noise(self) -> float:
        """Standard deviation of a sample of white noise as strong as this one is where bodies move."""
        return self.spectrum.std


class Output(NamedTuple):
    """One measured channel that the simulation predicts."""

    channel: str
    body: int
    quantity: str  # acceleration, velocity or displacement of a free body, or force on a fixed one
    to_acceleration: float = 1.0  # 1/kg, 1/s or 1/s^2, by which it counts beside accelerations

    @property
    def fixed(self) -> bool:
        return self.quantity == "force"

    @property
    def unit(self) -> str:
        return SI_UNIT[self.quantity]

    @property
    def of_motion(self) -> int:
        """Times that the acceleration is integrated: 0, 1 or 2."""
        return {"velocity": 1, "displacement": 2}.get(self.quantity, 0)


class ObservedRecord(NamedTuple):
    """One recording on a grid of g instants, with n samples of q outputs."""

    test: Test
    time: np.ndarray  # (g,) s since the impact, from 0
    dt: np.ndarray  # (g,) s from the instant before; 0 at the first
    step: float  # s, median of dt
    at: np.ndarray  # (n,) indices of the samples on the grid
    period: float  # s, median between samples
    measured: np.ndarray  # (n, q) zero offset removed, NaN where not valid
    noise: np.ndarray  # (q,) standard deviation of a sample of white noise as strong as this one is where bodies move
    spectra: tuple[NoiseSpectrum, ...]  # (q,) of a sample; known from inf samples where the model states it
    offset_std: np.ndarray  # (q,)
    signals: dict[str, Signal]  # every channel of the model, and every acceleration channel
    initial_displacement: np.ndarray  # (b,) m
    initial_velocity: np.ndarray  # (b,) m/s
    bin: np.ndarray  # (g,) bin of the sample at that instant, -1 where none
    valid: np.ndarray  # (g, q) 1 where a sample is valid, divided by the root of the valid samples in its bin
    bins: int
    cosines: np.ndarray  # (g, 1 + DRIVEN_MODES), the mean first
    whitener: np.ndarray | None = None  # (q, q) of outputs in units of their noise; None: independent, as the sensors'
    means_over: int = 1  # of the sensors' samples, for which `spectra` hold, that one of these is a mean of
    below: float = np.inf  # Hz: the band that is compared
    in_doubt: bool = False  # masses may be off by what scales miss, and zeros drift
    weight: np.ndarray | None = None  # (bins, q) of the outputs' frequencies, `whitening.weights`; None: all alike
    impact_std: float = 0.0  # s: bodies coast, and when they touch is not known better than so

    @property
    def noise_is_inflated(self) -> bool:
        """Noise stands for what a model leaves, not for the sensors' alone."""
        return self.whitener is not None

    def whitened(self, binned: np.ndarray, in_time: bool = True) -> np.ndarray:
        """Outputs in bins (bins, q, ...), in units of noise, as if that were white, in the band that is compared.

        Not in time: their cosine coefficients where there are any, which have the same sums of products.
        """
        if self.weight is not None:
            binned = (filtered if in_time else coefficients)(binned, self.weight)
        return self.whitener @ binned if self.noise_is_inflated else binned

    def in_band(self, below: float) -> "ObservedRecord":
        """Compared below so many Hz only."""
        inside = self._replace(below=below)
        return inside._replace(weight=inside.weights_of(self.bins, self.per_bin))

    def weights_of(self, n: int, per_mean: int = 1) -> np.ndarray | None:
        """`whitening.weights` of n means over so many samples each."""
        period, means_over = self.period / self.means_over, per_mean * self.means_over
        return weights(self.spectra, self.below, n, period, means_over)

    @property
    def noise_of_samples(self) -> np.ndarray:
        """(n, q) standard deviation of the sensors' noise in a sample; NaN where that is missing."""
        each = np.array([spectrum.of_one_sample for spectrum in self.spectra])
        return np.where(np.isfinite(self.measured), each, np.nan)

    @property
    def compared(self) -> np.ndarray:
        """(q,) share of the frequencies."""
        return np.ones(len(self.noise)) if self.weight is None else (self.weight > 0.0).mean(axis=0)

    @property
    def seen_early(self) -> float:
        """s by which a filter that runs backward, too, may show a motion before it begins."""
        return seen_early_by(self.spectra)

    @property
    def onset_early(self) -> float:
        """s by which its onset may come before the motion: a loud one stands out of a filter's noise from afar."""
        each = zip(self.spectra, np.abs(np.nan_to_num(self.measured)).max(axis=0), strict=True)
        return max((seen_early(s.corner, peak / s.of_one_sample) for s, peak in each if s.corner < np.inf), default=0.0)

    @property
    def kick(self) -> np.ndarray:
        """(g,) acceleration in the first step that changes the velocity by 1 m/s."""
        found = np.zeros(len(self.time))
        found[1] = 2.0 / (self.time[2] - self.time[0])
        return found

    @property
    def per_bin(self) -> int:
        return round(len(self.at) / self.bins)


def outputs_of(structure: Structure) -> tuple[Output, ...]:
    """Every channel of every free body, and the measured force of every fixed one, which counts divided by the mass of
    all free bodies.

    The displacement of a body that no spring holds is none: errors of the forces on it add up to any distance. Where it
    is all there is, the acceleration derived from it takes its place.
    """
    found: list[Output] = []
    mass = sum(body.mass for body in structure.bodies if body.free) or 1.0
    for k in structure.equations:
        body = structure.bodies[k]
        if body.fixed:
            found.append(Output(body.force, k, "force", 1.0 / mass))
            continue
        of_motion = [Output(body.velocity, k, "velocity")] if body.velocity else []
        if body.displacement and structure.is_held(k):
            of_motion.append(Output(body.displacement, k, "displacement"))
        if not (body.derived and of_motion):
            found += [Output(name, k, "acceleration") for name in body.acceleration]
        found += of_motion
    return tuple(found)


def comparable(
    outputs: Sequence[Output], structure: Structure, records: Sequence[ObservedRecord]
) -> tuple[Output, ...]:
    """Outputs whose sizes can be compared: a displacement counts as an acceleration of the body's own frequency."""
    found = []
    for output in outputs:
        if output.of_motion:
            channels = structure.bodies[output.body].acceleration
            a = [np.mean([record.signals[name].on_grid for name in channels], axis=0) for record in records]
            x = [record.signals[output.channel].on_grid for record in records]
            spread = max(max(float(np.std(each)) for each in x), np.finfo(float).tiny)
            output = output._replace(to_acceleration=max(float(np.std(each)) for each in a) / spread)
        found.append(output)
    return tuple(found)


def observe(structure: Structure, recording: Recording, rest: Rest | None = None) -> ObservedRecord:
    """rest: one of `rests_of` it and others of the same system.

    Raises ModelError or RecordingError, one line, where the recording does not serve the model.
    """
    kinematics = Kinematics(structure, recording.test)  # checks the channels, knows the initial motion
    after = recording.time_ns >= 0
    if np.count_nonzero(after) < FEWEST_SAMPLES:
        raise ModelError(
            f"test {recording.test.id} has {np.count_nonzero(after)} samples after the impact, too few to fit"
        )
    sample_time = recording.time[after]
    time, at = grid_of(sample_time, longest_step(structure, recording))
    outputs = outputs_of(structure)
    names = [name for _, name, _ in structure.channels()]
    others = (c.name for c in recording.test.channels if c.quantity == "acceleration")
    names += [name for name in others if np.isfinite(recording.column(name)).any()]
    rest = rest or rests_of([recording])[0]
    derived = {name for body in structure.bodies if body.derived for name in body.acceleration}
    signals = {name: _signal(recording, name, time, rest, name in derived) for name in dict.fromkeys(names)}
    for element in structure.elements:
        if element.displacement:
            signals[element.displacement] = _from_rest(signals[element.displacement], element.tension, rest.ends)
    start = np.array([kinematics.initial_displacement, kinematics.initial_velocity])
    for k, body in enumerate(structure.bodies):
        if body.applied:
            force = between_samples(recording.time, recording.column(body.applied))
            signals[body.applied] = signals[body.applied]._replace(on_grid=force(time))
        if body.derived and body.displacement:
            from scipy.interpolate import CubicSpline  # late: few models have such a body

            name, x = body.acceleration[0], signals[body.displacement]
            path = CubicSpline(x.time, smoothed(x.values, recording.sample_period).value)
            signals[name] = signals[name]._replace(on_grid=tracked_acceleration(time, path, *start[:, k]))
        for name in body.acceleration if body.free else ():
            if not np.isfinite(recording.column(name)[after]).all():
                values = through_gaps(structure, body.name, recording, name, signals[name].values)
                signals[name] = signals[name]._replace(on_grid=np.interp(time, recording.time, values))
    seen = [(o, signals[o.channel], np.isfinite(recording.column(o.channel))) for o in outputs]
    measured = np.stack([np.where(valid, signal.values, np.nan)[after] for _, signal, valid in seen], axis=1)
    given = [structure.bodies[o.body].noise for o in outputs]
    period = recording.sample_period
    spectra = [NoiseSpectrum(g, np.inf, period) if g else signals[o.channel].spectrum for g, o in zip(given, outputs)]
    mixed = max(seen_early_by(spectra), rest.blurred)
    bin_, valid, bins = bins_of(
        time, at, measured, mixed=mixed, transformed=not all(spectrum.white for spectrum in spectra)
    )
    return ObservedRecord(
        test=recording.test,
        **on_grid(time, at, modes_of(measured)),
        measured=measured,
        noise=np.array([spectrum.std for spectrum in spectra]),
        spectra=tuple(spectra),
        # a displacement counts from anywhere: as much as it spreads
        offset_std=np.array([np.std(s.values) if o.of_motion == 2 else s.offset_std for o, s, _ in seen]),
        signals=signals,
        initial_displacement=kinematics.initial_displacement,
        initial_velocity=kinematics.initial_velocity,
        bin=bin_,
        valid=valid,
        bins=bins,
    ).in_band(np.inf)


def refuse_twins(recordings: Sequence[Recording]) -> None:
    """Raises RecordingError for one that is given twice: its samples would count as those of two tests."""
    for one, other in combinations(recordings, 2):
        if np.array_equal(one.time_ns, other.time_ns) and np.array_equal(one.values, other.values, equal_nan=True):
            raise RecordingError(
                f"test {other.test.id} is given twice: its samples are those of test {one.test.id}; give each "
                "recording once"
            )


def refuse_dead_channels(structure: Structure, recording: Recording) -> None:
    """Raises ModelError for a measured output that never changes: it has no noise to compare a model with."""
    for name in [output.channel for output in outputs_of(structure)]:
        values = recording.column(name)[np.isfinite(recording.column(name))]
        if len(values) and np.ptp(values) == 0.0:
            unit = recording.test.channels[recording.test.index(name)].unit
            raise ModelError(
                f"test {recording.test.id}: channel {name} is {values[0]:g} {unit} throughout, as of a dead sensor: "
                "leave it out of the model file"
            )


def _signal(recording: Recording, name: str, grid: np.ndarray, rest: Rest, derived: bool) -> Signal:
    valid = np.isfinite(recording.column(name))
    if not valid.any():
        raise ModelError(f"test {recording.test.id}: channel {name} has no valid sample")
    channel = recording.test.channels[recording.test.index(name)]
    before = valid & (recording.time_ns < rest.ends)
    count = np.count_nonzero(before)
    rests = channel.quantity in RESTS_AT_ZERO
    offset = float(recording.column(name)[before].mean()) if rests and count else 0.0
    values = bridged(recording, name) - offset
    noise = sensor_noise(values, recording.time_ns - rest.ends, rests, rest.colours.get(name, ()), derived)
    values = noise.unfiltered(values)
    on_grid = np.interp(grid, recording.time, values)
    return Signal(recording.time, values, on_grid, noise, noise.std / np.sqrt(count) if count else 0.0)


def _from_rest(crush: Signal, tension: bool, rest_ends: int) -> Signal:
    before = crush.values[crush.time * SECOND < rest_ends]
    zero = zero_crush(float(before.mean()), float(before[-1]), tension) if len(before) else 0.0
    return crush._replace(values=crush.values - zero, on_grid=crush.on_grid - zero)
