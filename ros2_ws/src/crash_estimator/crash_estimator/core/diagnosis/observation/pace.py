"""How closely a recording has to be looked at: the steps of its simulation, and means over samples that lie closer."""

from dataclasses import replace

import numpy as np

from crash_replay.recording import Recording

from ...structure import Structure

LONGEST_STEP = 1.5e-4
"""s: the linear-acceleration step's phase error is (omega dt)^2 / 24: 3.75e-5 for the stiffest contact, 200 rad/s."""

LONG = 1.0
"""s: no crash lasts as long. A longer record is of something slower, or oscillates: its steps are as short as its own
motion asks for, since the work would follow the duration else."""

MOVES = 0.99
"""Share of the power of a body's acceleration below the frequency that a long record's step is chosen for ... Ours: of
a shaken oscillator (Silverbox) 0.98 and 0.995 tell the same effects, the cubic one as 3.928 and 3.924 N/m^3."""

PHASE = 2e-3
"""... so that the step's phase error there, (omega dt)^2 / 24, is this, where a spring brings the body back: its
resonance would be at another frequency else. Ours: halved and doubled, 3.919 and 3.933 of that oscillator."""

TURN = 1.0 / 60.0
"""Change of a body's speed in a step, both RMS, where no spring brings it back: how fast a measured force is does not
matter, as it is integrated as it is, but friction has to be seen to turn with the speed. The step of two recordings of
one axis, with and without pulses of force, is 3 ms so; with 5 ms and more some parts of them tell its friction 6 to
13 % too small, with 1 ms three times the time goes by for the same answer."""

FEWEST_MEANS = 500
"""After the impact: as many as a crash of 0.1 s has at 5 kHz; a shorter recording is taken as it is sampled."""


def longest_step(structure: Structure, recording: Recording) -> float:
    """s between two instants of the simulation."""
    duration = float(recording.time[-1] - max(recording.time[0], 0.0))
    names = [name for body in structure.bodies for name in body.acceleration]
    if duration <= LONG or not names:
        return LONGEST_STEP
    held = any(structure.is_held(k) for k, body in enumerate(structure.bodies) if body.free)
    fastness, most = (_fastest, np.sqrt(24.0 * PHASE)) if held else (_turning, TURN)
    fastest = max(fastness(np.nan_to_num(recording.column(name)), recording.sample_period) for name in names)
    return max(LONGEST_STEP, most / max(fastest, 1.0 / duration))


def at_its_own_pace(structure: Structure, recording: Recording) -> Recording:
    """In means over some samples, where it is sampled more closely than the simulation steps."""
    after = int(np.count_nonzero(recording.time_ns >= 0))
    samples = min(int(longest_step(structure, recording) / recording.sample_period + 1e-6), after // FEWEST_MEANS)
    return _averaged(recording, samples) if samples > 1 else recording


def _averaged(recording: Recording, samples: int) -> Recording:
    """Means of so many samples each; none of those at the impact, of which some may lie before a force that jumps."""
    first = int(np.count_nonzero(recording.time_ns < 0)) % samples  # a mean is of before the impact, or of after it
    used = (len(recording) - first) // samples * samples
    time_ns = recording.time_ns[first : first + used].reshape(-1, samples)
    values = recording.values[first : first + used].reshape(len(time_ns), samples, -1)
    valid = np.isfinite(values)
    count = valid.sum(axis=1)
    mean = np.where(valid, values, 0.0).sum(axis=1) / np.where(count, count, np.nan)
    mean[np.flatnonzero(time_ns[:, 0] >= 0)[:1]] = np.nan
    return replace(recording, time_ns=np.rint(time_ns.mean(axis=1)).astype(np.int64), values=mean)


def _fastest(acceleration: np.ndarray, period: float) -> float:
    """rad/s below which MOVES of the power lies."""
    power = np.cumsum(np.abs(np.fft.rfft(acceleration - acceleration.mean())) ** 2)
    at = int(np.searchsorted(power, MOVES * power[-1]))
    return 2.0 * np.pi * at / (len(acceleration) * period)


def _turning(acceleration: np.ndarray, period: float) -> float:
    """rad/s of the harmonic that has its ratio of acceleration to speed, RMS; a zero offset adds up to none."""
    speed = period * np.cumsum(acceleration - acceleration.mean())
    return float(acceleration.std() / max(speed.std(), np.finfo(float).tiny))
