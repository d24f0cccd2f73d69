"""Samples in which a sensor does not show what it feels: at the end of its range, dead, and spikes."""

from collections.abc import Sequence

import numpy as np

from crash_replay.recording import Recording

from .clipping import clipped
from .dropouts import dropouts
from .spikes import spikes


def without_faults(recordings: Sequence[Recording]) -> tuple[list[Recording], str]:
    """With holes where an acceleration or a force shows none, and a line that says so; "" where all do."""
    found, said = [], []
    for recording in recordings:
        values = recording.values.copy()
        for k, channel in enumerate(recording.test.channels):
            if channel.quantity not in ("acceleration", "force"):
                continue
            recorded = recording.values[:, k]
            for what, lost in (
                ("is clipped", clipped(recorded)),
                ("is dead for a while", dropouts(recorded)),
                ("has spikes", spikes(recorded, recording.sample_period)),
            ):
                lost &= np.isfinite(values[:, k])
                if lost.any():
                    values[lost, k] = np.nan
                    said.append(
                        f"{channel.name} of {recording.test.id} {what}, {np.count_nonzero(lost)} samples left out"
                    )
        found.append(Recording(recording.test, recording.time_ns, values))
    return found, "; ".join(said)
