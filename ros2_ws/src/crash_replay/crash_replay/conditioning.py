"""What may be done to a recording before it is used: zero offset, SAE J211 filter, integration, choice of channels.

Pure functions; none is applied unless asked for. Each says what it did in the test's notes.
"""

import re
from collections.abc import Sequence
from dataclasses import replace
from fnmatch import fnmatchcase

import numpy as np

from .channel_class import BY_CLASS, class_of
from .recording import Recording, RecordingError
from .shortened import shortened
from .unique_names import unique

RESTS_AT_ZERO = ("acceleration", "force", "moment", "angular_velocity")
"""Quantities that are zero before the impact; a velocity or displacement then is a fact, not an offset."""
ENOUGH_SAMPLES = 20
"""Fewer pre-impact samples than this give no offset that is better than none."""

CFC_CLASSES = (60, 180, 600, 1000)
"""Channel frequency classes of SAE J211-1, Hz."""
IN_NAME = re.compile(r"_cfc(\d+)(?=_\d+$|$)")
"""As the reader of ISO-MME names a channel that the laboratory filtered."""
RATE_PER_CFC = 10
"""SAE J211-1: the sample rate is at least ten times the channel frequency class."""
STEADY = 0.01
"""Share of the sample period by which steps may differ where equal steps are needed (rounding, jitter)."""


def pre_impact_offset(recording: Recording) -> np.ndarray:
    """(channels,) SI: mean of each channel before time zero; NaN where that is no offset or the samples are too few."""
    before = recording.values[recording.time_ns < 0]
    count = np.count_nonzero(np.isfinite(before), axis=0)
    rests = np.array([channel.quantity in RESTS_AT_ZERO for channel in recording.test.channels], dtype=bool)
    mean = np.where(np.isfinite(before), before, 0.0).sum(axis=0) / np.maximum(count, 1)
    return np.where(rests & (count >= ENOUGH_SAMPLES), mean, np.nan)


def remove_offset(recording: Recording) -> Recording:
    """Subtract each channel's mean before the impact; the notes say how much, and where it could not be done."""
    offset = pre_impact_offset(recording)
    channels = recording.test.channels
    removed = [f"{c.name} {o:.4g} {c.unit}" for c, o in zip(channels, offset) if np.isfinite(o)]
    kept = [c.name for c, o in zip(channels, offset) if not np.isfinite(o) and c.quantity in RESTS_AT_ZERO]
    notes = [f"pre-impact mean removed: {shortened(removed)}"] if removed else []
    if kept:
        notes.append(f"zero offset kept, fewer than {ENOUGH_SAMPLES} samples before time zero: {shortened(kept)}")
    recorded = tuple(
        replace(c, source=_with(c.source, f"offset {o:.4g} {c.unit} removed")) if np.isfinite(o) else c
        for c, o in zip(channels, offset)
    )
    test = replace(recording.test, channels=recorded)
    return _changed(replace(recording, test=test), recording.values - np.nan_to_num(offset), notes)


def cfc_coefficients(cfc: float, sample_period: float) -> tuple[np.ndarray, np.ndarray]:
    """Numerator and denominator (3,) each of the 2-pole Butterworth low-pass of SAE J211-1, appendix C.

        wd = 2 pi CFC 2.0775,  wa = tan(wd T/2)
        a0 = wa^2 / (1 + sqrt(2) wa + wa^2),  a1 = 2 a0,  a2 = a0
        b1 = -2 (wa^2 - 1) / (1 + sqrt(2) wa + wa^2),  b2 = (-1 + sqrt(2) wa - wa^2) / (1 + sqrt(2) wa + wa^2)
        y[k] = a0 x[k] + a1 x[k-1] + a2 x[k-2] + b1 y[k-1] + b2 y[k-2]

    cfc in Hz, sample_period T in s.
    """
    wa = np.tan(2.0 * np.pi * cfc * 2.0775 * sample_period / 2.0)
    scale = 1.0 + np.sqrt(2.0) * wa + wa * wa
    a0 = wa * wa / scale
    b1, b2 = -2.0 * (wa * wa - 1.0) / scale, (-1.0 + np.sqrt(2.0) * wa - wa * wa) / scale
    return np.array([a0, 2.0 * a0, a0]), np.array([1.0, -b1, -b2])


def cfc_filter(values: np.ndarray, sample_period: float, cfc: int) -> np.ndarray:
    """Values (n,) filtered as SAE J211-1 asks for a channel frequency class (`low_passed`).

    Raises RecordingError for a class that the standard has not got, or a sample rate below ten times the class.
    """
    if cfc not in CFC_CLASSES:
        raise RecordingError(f"CFC must be one of {', '.join(map(str, CFC_CLASSES))}, got {cfc}")
    if not 0.0 < sample_period * cfc * RATE_PER_CFC <= 1.0 + STEADY:
        rate = f"{1.0 / sample_period:.6g} Hz" if sample_period > 0.0 else "none (one sample)"
        raise RecordingError(f"CFC {cfc} needs a sample rate of at least {RATE_PER_CFC * cfc} Hz, got {rate}")
    return low_passed(values, sample_period, cfc)


def low_passed(values: np.ndarray, sample_period: float, cfc: float) -> np.ndarray:
    """Values (n,) filtered forward and backward (no phase shift; -3 dB at 1.65 cfc Hz), NaN where they were NaN.

    Stretches between NaN are filtered each on its own, their ends extended against start-up transients by point
    reflection, of 10 ms or, below CFC 60, of as many periods of the filter as that is there.
    """
    from scipy.signal import filtfilt  # it takes longer to import than all the rest: only who filters waits for it

    numerator, denominator = cfc_coefficients(cfc, sample_period)
    filtered = np.full(len(values), np.nan)
    valid = np.concatenate([[False], np.isfinite(values), [False]])
    edges = np.flatnonzero(valid[1:] != valid[:-1])
    for start, end in zip(edges[::2], edges[1::2], strict=False):
        extension = min(end - start - 1, round(0.010 * max(1.0, CFC_CLASSES[0] / cfc) / sample_period))
        filtered[start:end] = filtfilt(numerator, denominator, values[start:end], padlen=extension)
    return filtered


def filter_recording(recording: Recording, cfc: int | str) -> Recording:
    """Every channel through `cfc_filter`, with one class or (`BY_CLASS`) each with its own.

    What was done stands in each channel's source, and a class in its name is corrected. A channel that was filtered
    with a lower class already stays as it is. Raises RecordingError also where the sample steps are not equal.
    """
    step = np.diff(recording.time_ns)
    uneven = np.flatnonzero(np.abs(step - np.median(step)) > STEADY * np.median(step)) if len(step) else step
    if len(uneven):
        k = int(uneven[0])
        raise RecordingError(
            f"test {recording.test.id}: a CFC filter needs equal time steps, but the step at {recording.time[k]:.6f} s "
            f"is {step[k] * 1e-6:.6g} ms where most are {np.median(step) * 1e-6:.6g} ms; import it unfiltered"
        )
    period = recording.sample_period
    columns, channels, done = [], [], {}
    for channel, column in zip(recording.test.channels, recording.values.T):
        wanted, what = class_of(channel) if cfc == BY_CLASS else (int(cfc), "")
        had = _class_in_name(channel.name)
        if had and had <= wanted:
            outcome = f"left at the CFC {had} that it came with"
        elif cfc == BY_CLASS and not 0.0 < period * wanted * RATE_PER_CFC <= 1.0 + STEADY:
            outcome = f"not filtered, CFC {wanted} needs a sample rate of {RATE_PER_CFC * wanted} Hz"
        else:
            outcome, column = f"CFC {wanted}", cfc_filter(column, period, wanted)
            name = IN_NAME.sub(f"_cfc{wanted}", channel.name) if had else channel.name
            because = f": {what}" if what else ""
            channel = replace(channel, name=name, source=_with(channel.source, f"CFC {wanted} (SAE J211-1{because})"))
        columns.append(column)
        channels.append(channel)
        done.setdefault(outcome, []).append(channel.name)
    if list(done) == [f"CFC {cfc}"]:
        notes = [f"filtered with CFC {cfc} (SAE J211-1), all channels"]
    else:
        by = "by channel class" if cfc == BY_CLASS else "by one class"
        notes = [f"filtered {by} (SAE J211-1), {how}: {shortened(names)}" for how, names in done.items()]
    test = replace(recording.test, channels=unique(channels))
    return _changed(replace(recording, test=test), np.stack(columns, axis=1), notes)


def _class_in_name(name: str) -> int:
    """180 of head_ax_cfc180 or head_ax_cfc180_2; 0 for none."""
    found = IN_NAME.search(name)
    return int(found[1]) if found else 0


def _with(source: str, what: str) -> str:
    return f"{source}; {what}" if source else what


def integrate(
    time: np.ndarray, acceleration: np.ndarray, initial_velocity: float = 0.0, initial_displacement: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Velocity and displacement (n,) in m/s and m from acceleration (n,) in m/s^2 at time (n,) in s since the impact.

        v[k] = v[k-1] + dt (a[k-1] + a[k]) / 2,   x[k] = x[k-1] + dt v[k-1] + dt^2 (2 a[k-1] + a[k]) / 6

    which is exact where the acceleration is a straight line between samples. The initial values hold at
    time zero; before it the velocity is the initial one. A NaN is bridged by the last valid value (0 before
    the first).
    """
    after = time >= 0.0
    t, a = time[after], np.asarray(acceleration, dtype=float)[after]
    last_valid = np.maximum.accumulate(np.where(np.isfinite(a), np.arange(len(a)), -1))
    a = np.where(last_valid >= 0, a[last_valid], 0.0) if len(a) else a
    dt = np.diff(t, prepend=0.0)
    previous = np.concatenate([a[:1], a[:-1]])  # from time zero to the first sample: the first value
    velocity = np.full(len(time), float(initial_velocity))
    displacement = initial_displacement + initial_velocity * time
    velocity[after] = v = initial_velocity + np.cumsum(dt * (previous + a) / 2.0)
    v_before = np.concatenate([[initial_velocity], v[:-1]])[: len(v)]
    displacement[after] = initial_displacement + np.cumsum(dt * v_before + dt * dt * (2.0 * previous + a) / 6.0)
    return velocity, displacement


def select_channels(recording: Recording, patterns: Sequence[str]) -> Recording:
    """Only the channels that match one of the shell patterns ("car_*"), in the recording's order."""
    names = recording.test.channel_names
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in names):
            raise RecordingError(f"no channel matches {pattern!r}; channels: {', '.join(names)}")
    chosen = [k for k, name in enumerate(names) if any(fnmatchcase(name, pattern) for pattern in patterns)]
    test = replace(recording.test, channels=tuple(recording.test.channels[k] for k in chosen))
    left_out = [name for k, name in enumerate(names) if k not in chosen]
    notes = [f"left out, not asked for: {shortened(left_out)}"] if left_out else []
    return _changed(Recording(test, recording.time_ns, recording.values[:, chosen]), recording.values[:, chosen], notes)


def _changed(recording: Recording, values: np.ndarray, notes: Sequence[str]) -> Recording:
    return Recording(replace(recording.test, notes=recording.test.notes + tuple(notes)), recording.time_ns, values)
