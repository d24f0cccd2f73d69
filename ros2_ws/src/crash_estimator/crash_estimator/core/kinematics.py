"""Motion of the bodies and crush of the elements, integrated sample by sample from the measured accelerations.

    v(t) = v0 + integral of a,    x(t) = x0 + integral of v

from a stated initial velocity and displacement, after removing each channel's pre-impact mean; a measured crush counts
from where it stands before the impact. Between
two samples the acceleration is taken as a straight line: v += dt (a0 + a1)/2, x += v0 dt + dt^2 (2 a0 + a1)/6.
"""

from typing import NamedTuple

import numpy as np

from crash_replay.recording import Sample, Test

from .structure import ModelError, Structure

RATE_SMOOTHING = 3e-4
"""s: time constant of the rate of crush where only the crush is measured (a difference alone is mostly noise)."""


FEWEST = 20
"""Pre-impact samples from which the sensors' noise is learnt."""


RECORD = 0.05
"""s: over a record of this length the noise's own mean is an offset as well; it adds to the error of the zero."""


STANDS = 0.5
"""Of its mean, by which a measured crush may differ from that at the impact and still stand: a gap that closes evenly
differs by all of it."""


class Motion(NamedTuple):
    """What moves at one sample: b bodies, e elements, q equations."""

    time: float  # s since the impact
    dt: float  # s since the last sample after the impact; 0 before it
    displacement: np.ndarray  # (b,) m
    velocity: np.ndarray  # (b,) m/s
    acceleration: np.ndarray  # (b,) m/s^2, NaN where not measured
    crush: np.ndarray  # (e,) m
    rate: np.ndarray  # (e,) m/s
    measured: np.ndarray  # (q,) left-hand side of each equation, NaN where not measured
    noise: np.ndarray  # (q,) variance of it before the impact: the sensors' noise; NaN where not known
    offset_variance: np.ndarray  # (b,) (m/s^2)^2 by which the removed zero offset may be wrong; 0 where not known
    sensors: np.ndarray  # (2, b) variance of each body's measured acceleration before the impact, and of its mean, the
    # zero offset (of a fixed body that of the force on it); 0 where not known
    held: np.ndarray  # (b,) m/s^2, the last valid acceleration after the impact
    displacement_by: np.ndarray | None = None  # (b, n) its change with each of n estimated errors of channels
    velocity_by: np.ndarray | None = None  # (b, n)
    applied: np.ndarray | None = None  # (q,) m/s^2 by the measured forces on free bodies, where there are any


class KinematicState(NamedTuple):
    time_ns: int  # of the last sample after the impact; -1 before
    count: np.ndarray  # type: ignore[assignment]  # (channels,) pre-impact samples; hides the tuple's own method
    offset: np.ndarray  # (channels,) their mean: the zero offset
    squares: np.ndarray  # (b,) sum of squared accelerations before the impact, their running mean removed
    force_squares: np.ndarray  # (q,) the same of measured forces
    displacement: np.ndarray  # (b,)
    velocity: np.ndarray  # (b,)
    acceleration: np.ndarray  # (b,) the last valid one
    crush: np.ndarray  # (e,) of the last sample
    rate: np.ndarray  # (e,)
    zero: np.ndarray  # (e,) m, of a measured crush: where it stands before the impact
    swings: tuple[tuple[float, float], ...]  # m, m/s of each body that hangs, from where it hangs at rest


def initial_motion(structure: Structure, test: Test) -> tuple[np.ndarray, np.ndarray]:
    """(b,) displacement m and velocity m/s at time zero: stated for the body, or for the one that the test says its
    sensor sits on (a cab on a car).

    A fixed body rests at 0, whatever the test says of its name.
    """
    both = np.zeros((2, len(structure.bodies)))
    for values, stated, part in zip(both, (test.initial_displacement, test.initial_velocity), (0, 1)):
        for k, body in enumerate(structure.bodies):
            carriers = [test.channels[test.index(name)].body for name in body.acceleration]
            known = [name for name in (body.name, *carriers) if name in stated]
            values[k] = 0.0 if body.fixed else stated[known[0]] if known else body.start[part]
    both[1] *= [1.0 + body.starts_faster for body in structure.bodies]
    if not np.isfinite(both).all():
        raise ModelError("an initial velocity or displacement of the test is not a finite number")
    return both[0], both[1]


class Kinematics:
    """Settings: which channel moves which body. `init` and `step` fold samples into motion."""

    def __init__(self, structure: Structure, test: Test):
        structure.check_channels(test)
        _check_accelerations(structure)
        bodies, elements = structure.bodies, structure.elements
        self.structure = structure
        self.channel_count = len(test.channels)
        self.offsets = np.array([channel.quantity in ("acceleration", "force") for channel in test.channels])
        self.accelerometers = [
            (k, [] if b.hangs else [test.index(name) for name in b.acceleration]) for k, b in enumerate(bodies)
        ]
        self.crush_channels = [(k, test.index(e.displacement)) for k, e in enumerate(elements) if e.displacement]
        self.rate_channels = [(k, test.index(e.velocity)) for k, e in enumerate(elements) if e.velocity]
        self.derived_rates = [k for k, e in enumerate(elements) if e.displacement and not e.velocity]
        self.force_channels = [
            (row, test.index(bodies[k].force)) for row, k in enumerate(structure.equations) if bodies[k].fixed
        ]
        self.balances = [(row, k) for row, k in enumerate(structure.equations) if bodies[k].free]
        self.applied_channels = [
            (row, test.index(bodies[k].applied), bodies[k].mass)
            for row, k in enumerate(structure.equations) if bodies[k].applied
        ]  # fmt: skip
        self.hangs = np.array([bool(body.hangs) for body in bodies])
        self.hanging = [(k, structure.body_index[b.carried_by], *b.hangs) for k, b in enumerate(bodies) if b.hangs]
        self.initial_displacement, self.initial_velocity = initial_motion(structure, test)
        self.origin = np.array([element.origin for element in elements])
        self.play = np.array([element.play for element in elements])

    def init(self) -> KinematicState:
        channels, bodies = np.zeros(self.channel_count), np.zeros(len(self.structure.bodies))
        elements = np.zeros(len(self.structure.elements))
        forces = np.zeros(len(self.structure.equations))
        return KinematicState(
            -1,
            channels,
            channels,
            bodies,
            forces,
            self.initial_displacement,
            self.initial_velocity,
            bodies,
            elements,
            elements,
            elements,
            tuple((0.0, 0.0) for _ in self.hanging),
        )

    def step(self, state: KinematicState, sample: Sample) -> tuple[KinematicState, Motion]:
        """Fold one sample in; `state` is left as it was."""
        before_impact = sample.time_ns < 0
        if before_impact:
            state = self._learn_offset(state, sample.values)
        values = np.where(self.offsets, sample.values - state.offset, sample.values)
        acceleration = self._body_accelerations(values)
        if before_impact:
            dt, displacement, velocity = (
                0.0,
                self.initial_displacement + self.initial_velocity * sample.time,
                state.velocity,
            )
            now = state.acceleration
        else:
            dt = (sample.time_ns - max(state.time_ns, 0)) * 1e-9
            now = np.where(np.isnan(acceleration), state.acceleration, acceleration)  # bridges a dropout
            last = now if state.time_ns < 0 else state.acceleration
            if self.hanging:
                state = self._swung(state, dt, last, now)
                acceleration = np.where(self.hangs, now, acceleration)
            displacement = state.displacement + dt * state.velocity + dt * dt * (2.0 * last + now) / 6.0
            velocity = state.velocity + 0.5 * dt * (last + now)
        if before_impact:
            state = state._replace(zero=self._zeros(state, values))
        crush, rate = self._crush(state, values, displacement, velocity, dt)
        measured = self._measured(values, acceleration)
        applied = self._applied(values)
        if before_impact:
            state = self._learn_noise(state, acceleration, measured)._replace(crush=crush, rate=rate)
        else:
            state = state._replace(
                time_ns=sample.time_ns,
                displacement=displacement,
                velocity=velocity,
                acceleration=now,
                crush=crush,
                rate=rate,
            )
        noise, offset_variance, sensors = self._noise(state, dt)
        return state, Motion(
            sample.time, dt, displacement, velocity, acceleration, crush, rate, measured, noise, offset_variance,
            sensors, now, applied=applied,
        )  # fmt: skip

    def _body_accelerations(self, values: np.ndarray) -> np.ndarray:
        """(b,) mean of each body's valid channels, NaN where all have dropped out; 0 for a body without channels, and
        for one that hangs: it does not move as the channels do that it follows."""
        result = np.zeros(len(self.accelerometers))
        for body, columns in self.accelerometers:
            if len(columns) == 1:
                result[body] = values[columns[0]]
            elif columns:
                valid = [values[c] for c in columns if values[c] == values[c]]
                result[body] = sum(valid) / len(valid) if valid else np.nan
        return result

    def _swung(self, state: KinematicState, dt: float, last: np.ndarray, now: np.ndarray) -> KinematicState:
        """With what hangs a step further; its acceleration is put into now (b,)."""
        from .hung_body import hung  # the compiler takes long to import: only who needs it waits for it

        swings = []
        for (k, carrier, frequency, damping), start in zip(self.hanging, state.swings, strict=True):
            at_both_ends = np.array([last[carrier], now[carrier]])
            found, swing = hung(np.array([0.0, dt]), at_both_ends, start, frequency, damping)
            now[k] = found[-1]
            swings.append(swing)
        return state._replace(swings=tuple(swings))

    def _crush(self, state, values, displacement, velocity, dt) -> tuple[np.ndarray, np.ndarray]:
        """(e,) crush and rate: from the bodies' motion, or from measured channels where the model names them."""
        ends = self.structure.ends
        crush = displacement[ends[:, 0]] - displacement[ends[:, 1]] - self.origin
        rate = velocity[ends[:, 0]] - velocity[ends[:, 1]]
        for element, column in self.crush_channels:
            measured = values[column] - state.zero[element] - self.origin[element]
            crush[element] = measured if measured == measured else state.crush[element]
        for element in self.derived_rates:
            slope = (crush[element] - state.crush[element]) / dt if dt > 0 else 0.0
            rate[element] = state.rate[element] + (slope - state.rate[element]) * dt / (dt + RATE_SMOOTHING)
        for element, column in self.rate_channels:
            rate[element] = values[column] if values[column] == values[column] else state.rate[element]
        return beyond(self.play, crush, rate) if self.play.any() else (crush, rate)

    def _zeros(self, state: KinematicState, values: np.ndarray) -> np.ndarray:
        zero = state.zero.copy()
        for element, column in self.crush_channels:
            tension = self.structure.elements[element].tension
            if values[column] == values[column]:
                zero[element] = zero_crush(state.offset[column], values[column], tension)
        return zero

    def _measured(self, values: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
        measured = np.empty(len(self.structure.equations))
        for row, body in self.balances:
            measured[row] = acceleration[body]
        for row, column in self.force_channels:
            measured[row] = values[column]
        return measured

    def _applied(self, values: np.ndarray) -> np.ndarray | None:
        """(q,) m/s^2; NaN where the channel has dropped out, which leaves no equation there."""
        if not self.applied_channels:
            return None
        applied = np.zeros(len(self.structure.equations))
        for row, column, mass in self.applied_channels:
            applied[row] = values[column] / mass
        return applied

    def _learn_offset(self, state: KinematicState, values: np.ndarray) -> KinematicState:
        valid = ~np.isnan(values)
        count = state.count + valid
        change = np.where(valid, values - state.offset, 0.0) / np.maximum(count, 1.0)
        return state._replace(count=count, offset=state.offset + change)

    def _learn_noise(self, state: KinematicState, acceleration: np.ndarray, measured: np.ndarray) -> KinematicState:
        """Deviations from the running mean; the first samples' mean is poor, but their share fades as 1/n."""
        return state._replace(
            squares=state.squares + np.nan_to_num(acceleration) ** 2,
            force_squares=state.force_squares + np.nan_to_num(measured) ** 2,
        )

    def _noise(self, state: KinematicState, dt: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(q,) variance of each measurement, (b,) of the error of the zero offset that was removed, and `sensors`."""
        count = state.count.max(initial=0.0)
        if count < FEWEST:
            nothing = np.zeros_like(state.squares)
            return np.full_like(state.force_squares, np.nan), nothing, np.array([nothing, nothing])
        noise = state.force_squares / count
        for row, body in self.balances:
            noise[row] = state.squares[body] / count
        each = state.squares / count
        zero = each / count
        for row, _ in self.force_channels:
            zero[self.structure.equations[row]] = noise[row] / count
        return noise, each * (1.0 / count + dt / RECORD), np.array([each, zero])


def zero_crush(mean: float, last: float, tension: bool) -> float:
    """m to be taken off a measured crush, of which the mean and the last value before the impact are known: where it
    stands, for what carried there would push. What carries no tension may stand apart, and what moves does not stand.
    """
    stands = abs(last - mean) <= STANDS * abs(mean)
    return mean if stands and (tension or mean > 0.0) else 0.0


def _check_accelerations(structure: Structure) -> None:
    for body in structure.bodies:
        if body.free and not body.acceleration:
            by = f"is observed by {body.motion_channel} alone" if body.motion_channel else "has no sensor"
            raise ModelError(
                f"body {body.name} of model {structure.name} {by}: sample by "
                "sample an acceleration channel is needed (`diagnose`, `estimate`, `simulate` and `report` derive it "
                "from the whole recording)"
            )


def beyond(play: np.ndarray, crush: np.ndarray, rate: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(e,) crush and rate beyond the play (e,) m to either side; 0 within it."""
    return crush - np.clip(crush, -play, play), np.where(np.abs(crush) < play, 0.0, rate)
