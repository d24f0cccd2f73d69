"""What an answer costs on one core: the whole search on two recordings, and one update of the live ranking."""

from dataclasses import replace
from time import perf_counter, process_time

import numpy as np

from ..core.diagnosis import OnlineDiagnosis, diagnose
from .effects_judge import drawn
from .effects_plan import Case

EVERY = 0.002
"""s of the crash between two live rankings, as the node's default."""


def timed(case: Case) -> dict:
    """Wall and CPU seconds of `diagnose`, and the wall seconds of each live update while the last recording arrives."""
    _, structure, recordings = drawn(case)
    wall, cpu = perf_counter(), process_time()
    diagnose(structure, recordings)
    wall, cpu = perf_counter() - wall, process_time() - cpu
    *others, recording = recordings
    live = OnlineDiagnosis(structure, recording.test, others)
    state, updates = live.init(), []
    for end in np.arange(EVERY, recording.time_ns[-1] * 1e-9, EVERY):
        seen = recording.time_ns <= end * 1e9
        so_far = replace(recording, time_ns=recording.time_ns[seen], values=recording.values[seen])
        start = perf_counter()
        state, answer = live.update(state, so_far)
        if answer:
            updates.append(perf_counter() - start)
    return {"case": f"time {case.name}", "time": {"wall": wall, "cpu": cpu, "updates": updates}}
