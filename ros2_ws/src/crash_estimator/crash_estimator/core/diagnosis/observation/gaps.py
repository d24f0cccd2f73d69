"""How a body has moved while its accelerometer was at the end of its range, or showed nothing."""

import numpy as np

from crash_replay.recording import Recording

from ...clipping import runs_of
from ...momentum import acceleration_by_momentum, lacking_for_momentum
from ...structure import Structure

BESIDE = 0.25
"""Of a gap's length, to either side, that a cubic through it is fitted to: the rise and the fall of a pulse that is
clipped at 0.6 of its peak, without what comes before and after them."""

FEWEST = 4
"""Samples to either side, for a cubic."""


def through_gaps(structure: Structure, body: str, recording: Recording, name: str, bridged: np.ndarray) -> np.ndarray:
    """(n,) m/s^2 of a free body's channel, bridged by straight lines (n,), with what it has lost.

    As the momentum says, where nothing lacks for that; else a cubic through what is beside each gap.
    """
    lost = ~np.isfinite(recording.column(name))
    if not lacking_for_momentum(structure, body):
        found = acceleration_by_momentum(structure, body, recording)
        return np.where(lost & np.isfinite(found), found, bridged)
    values = bridged.copy()
    for start, stop in runs_of(lost):
        beside = max(round(BESIDE * (stop - start)), FEWEST)
        near = np.arange(max(start - beside, 0), min(stop + beside, len(lost)))
        known = near[~lost[near]]
        if min(np.count_nonzero(known < start), np.count_nonzero(known >= stop)) >= FEWEST:
            cubic = np.polynomial.Polynomial.fit(recording.time[known], bridged[known], 3)
            values[start:stop] = cubic(recording.time[start:stop])
    return values
