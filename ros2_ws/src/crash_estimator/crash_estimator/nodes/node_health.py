"""How estimator, diagnosis and viewer fare, for `/diagnostics`."""

import time

import numpy as np

from crash_replay.attending import Attending, Progress
from crash_replay.health import Health, Level

from ..core.estimate import Description, ParameterStatus
from ..core.filter_health import covariance_health
from ..following.columns import Columns
from ..viewer.recorder import Recorder
from .catching_up import behind

OLD = 5.0
"""s without a sample after which what a node says is old, where the replay has sent more."""
FULL = 0.5
"""Share of the viewer's queue that counts as nearly full."""


def estimator_health(node) -> Health:
    """node: an EstimatorNode."""
    if node.test_message is None:
        return Health(Level.OK, "waits for a test", {})
    progress, intake = node.attending.progress(), node.intake
    filter_values = filter_health(node.latest, node.follower.estimator.description) if node.latest else {}
    values = {
        "model": node.model.structure.name,
        "revision": node.model.revision,
        "method": node.model.method,
        **_samples(progress),
        "samples asked again": intake.asked_again,
        "messages waiting for missing samples": len(intake.waiting),
        **filter_values,
    }
    level, message = Level.OK, "follows the samples"
    if filter_values.get("covariance positive") is False:
        level, message = Level.WARN, "the covariance is not positive: the standard deviations mean nothing"
    level, message = _of_samples(progress, node.attending, intake.catching_up.came_at) or (level, message)
    if why := node.stopped or node.at_fault:
        level, message = Level.ERROR, f"stopped: {why}"
    return Health(level, message, values, node.test_message.id)


def filter_health(latest: Columns, description: Description) -> dict[str, object]:
    """Of the estimates of the last sample."""
    flat = np.asarray(latest.of["covariance"])[-1].ravel()
    side = round(len(flat) ** 0.5)
    found = covariance_health(flat.reshape(side, side))
    status = latest.of["status"][-1]
    clamped = [name for name, its in zip(description.parameters, status) if its == ParameterStatus.CLAMPED]
    return {
        "estimates finite": found.finite and bool(np.isfinite(latest.of["value"][-1]).all()),
        "covariance positive": found.positive,
        "condition of the correlations": found.condition,
        "clamped": ", ".join(clamped) or "none",
    }


def diagnosis_health(node) -> Health:
    """node: a DiagnosisNode."""
    progress, asked, busy = node.attending.progress(), node.asked, node.worker.busy
    values = {
        "model": node.structure.name,
        "revision": node.revision,
        "busy": busy,
        **_samples(progress),
        "last answer": node.telling.last or "none yet",
    }
    if not node.prepared:
        return Health(Level.OK, "compiles its code", values)
    if node.kept is None and not node.at_fault:
        return Health(Level.OK, "waits for a test", values)
    level, message = Level.OK, "waits for samples"
    if asked is not None:
        doing = "compares every candidate on all samples" if asked.final else "ranks the candidates"
        message = doing if busy else "has answered"
    level, message = _of_samples(progress, node.attending, node.catching_up.came_at) or (level, message)
    if why := node.stopped or node.at_fault:
        level, message = Level.ERROR, f"stopped: {why}"
    return Health(level, message, values, node.kept.test.id if node.kept else "")


def viewer_health(recorder: Recorder) -> Health:
    queue = recorder.queue()
    values = {
        "messages waiting": queue.items,
        "MB waiting": queue.size * 1e-6,
        "messages left out": queue.dropped,
        "server": recorder.sinks.url,
        "file": recorder.sinks.rrd or "none",
    }
    level, message = Level.OK, "draws what comes"
    if queue.items > FULL * recorder.limit:
        level, message = Level.WARN, f"{queue.items} messages wait to be drawn"
    if queue.dropped:
        level, message = Level.WARN, f"{queue.dropped} messages left out of the picture: they came too fast"
    if queue.troubles:
        level, message = Level.WARN, "something cannot be drawn: the log says what"
    return Health(level, message, values, queue.test)


def _samples(progress: Progress) -> dict[str, object]:
    return {
        "run": progress.run,
        "next sample": progress.next,
        "samples of the test": progress.total,
        "samples missing": progress.missing,
    }


def _of_samples(progress: Progress, attending: Attending, came_at: float) -> tuple[Level, str] | None:
    """What is wrong with the samples, if anything is; came_at: when the last one came."""
    state, quiet = attending.replay_state, time.monotonic() - came_at
    if state and quiet > OLD and behind((progress.run, progress.next), state):
        return Level.STALE, f"no sample for {quiet:.0f} s, though the replay has sent more"
    if progress.missing:
        return Level.WARN, f"{progress.missing} samples missing{': ' * bool(progress.reason)}{progress.reason}"
    return None
