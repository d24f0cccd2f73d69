"""What the health of estimator and diagnosis has in common: how they fare with their samples."""

import time

from crash_replay.attending import Attending, Progress
from crash_replay.health import Level

from .catching_up import behind

OLD = 5.0
"""s without a sample after which what a node says is old, where the replay has sent more."""


def counts_of_samples(progress: Progress) -> dict[str, object]:
    return {
        "run": progress.run,
        "next sample": progress.next,
        "samples of the test": progress.total,
        "samples missing": progress.missing,
    }


def trouble_with_samples(progress: Progress, attending: Attending, came_at: float) -> tuple[Level, str] | None:
    """What is wrong with the samples, if anything is; came_at: when the last one came."""
    state, quiet = attending.replay_state, time.monotonic() - came_at
    if state and quiet > OLD and behind((progress.run, progress.next), state):
        return Level.STALE, f"no sample for {quiet:.0f} s, though the replay has sent more"
    if progress.missing:
        return Level.WARN, f"{progress.missing} samples missing{': ' * bool(progress.reason)}{progress.reason}"
    return None
