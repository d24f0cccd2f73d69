"""What may be wrong with a recording beside the model: zeros, masses in doubt, slow errors of driven motions and of
applied forces, velocities at the start, when bodies touch. Parameters of a fit, each with its prior."""

from collections.abc import Iterable, Sequence

import numpy as np

from crash_replay.onset import AS_WELL

from ...effects.kinds.body_inertia import WEIGHED_TO
from ...structure import Structure
from ..observation.record import ObservedRecord, Output
from ..observation.trajectory import Trajectory
from .prior import LEAST_STD, Builder

DRIFT = 0.003
"""Of a channel's peak, standard deviation at the recording's end: the zero of an accelerometer that is shaken and warms
up drifts by some 0.15 g in a crash of 50 g. Ours: at 0.002 three of 120 looked-at models that lack nothing, whose zeros
drift by up to 0.2 g, were told an offset; at 0.003 none."""

BEYOND_DOUBT = 3.0
"""Standard deviations that such an error has at most: the usual three sigma. Halved, of 34 looked-at cases one
that lacks nothing, whose zeros drift, is told an offset; doubled, none is told otherwise. And of the noise in the band
that a channel has to pass to be rated: halved and doubled it changed nothing of what 36 looked-at cases were told."""

START_ERRS = 0.3
"""Of the velocity's standard deviation: wide, since a derivative at the end of a channel has half of the samples to go
by, and the recording itself says soon enough how the body started. Halved it changed nothing of 34 looked-at cases."""

FARTHEST = 2.0 * AS_WELL**0.5
"""Standard deviations that an onset may be off: twice as far as any that fits its signals as well. And that a signal's
mean may be off its zero where it is said to rest."""


def weighed(b: Builder, structure: Structure) -> dict[int, int]:
    """Errors of the masses, where anything tells of them: of one body alone, M a = F hides a mass in the law."""
    free = [k for k, body in enumerate(structure.bodies) if body.free]
    told = len(free) > 1 or any(structure.bodies[k].fixed for k in structure.equations)
    return {k: _bounded(b, f"{structure.bodies[k].name}.mass", WEIGHED_TO) for k in free if told}


def drifts(b: Builder, outputs: Sequence[Output], record: ObservedRecord) -> dict[int, int]:
    """Zeros at the recording's end, of the accelerometers."""
    felt = [q for q, output in enumerate(outputs) if output.quantity == "acceleration"]
    peak = np.nanmax(np.abs(record.measured), axis=0)
    return {q: _bounded(b, "drift", DRIFT * peak[q]) for q in felt}


def _bounded(b: Builder, name: str, std: float) -> int:
    """What a wrong model leaves is no reason for an error beyond its limits."""
    limit = BEYOND_DOUBT * max(std, LEAST_STD)
    return b.add(name, 0.0, std, low=-limit, high=limit)


def modes(b: Builder, record: ObservedRecord, by: Iterable[tuple[int, Sequence[str], int]]) -> dict[int, range]:
    """Mean and so many cosines of the noise of channels whose mean moves or pushes a body: white noise spreads its
    variance evenly over them. Where there are none a force's zero errs as its rest says: with the noise's own mean the
    friction of an axis, recorded for 25 s, was told as 17.5 N for 20.4."""
    found, samples = {}, len(record.at)
    for k, channels, count in by:
        noise = np.sqrt(sum(record.signals[c].noise ** 2 for c in channels)) / len(channels)
        offset = np.sqrt(sum(record.signals[c].offset_std ** 2 for c in channels)) / len(channels)
        found[k] = range(len(b.parameters), len(b.parameters) + 1 + count)
        b.add("mode", 0.0, np.hypot(offset, noise / np.sqrt(samples)) if count else offset)
        for _ in range(count):
            b.add("mode", 0.0, noise * np.sqrt(2.0 / samples))
    return found


def kicks(b: Builder, structure: Structure, measured: Trajectory) -> dict[int, int]:
    """Errors of the velocities that bodies start with, where these are derivatives at the very end of a channel."""
    own = (k for k, body in enumerate(structure.bodies) if body.starts_as_observed)
    return {k: b.add("kick", 0.0, START_ERRS * float(np.std(measured.v[:, k]))) for k in own}


def late(b: Builder, record: ObservedRecord) -> int:
    """How late bodies touch that coast until then, where that is not known; not before the record begins."""
    limit = FARTHEST * record.impact_std
    return b.add("late", 0.0, record.impact_std, low=-limit, high=limit) if record.impact_std else -1
