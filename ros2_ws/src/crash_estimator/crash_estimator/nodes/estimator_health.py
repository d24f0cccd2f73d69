"""How an estimator fares, for `/diagnostics`."""

import numpy as np

from crash_replay.health import Health, Level

from ..core.estimate import Description, ParameterStatus
from ..core.filter_health import covariance_health
from ..following.columns import Columns
from .node_health import counts_of_samples, trouble_with_samples


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
        **counts_of_samples(progress),
        "samples asked again": intake.asked_again,
        "messages waiting for missing samples": len(intake.waiting),
        **filter_values,
    }
    level, message = Level.OK, "follows the samples"
    if filter_values.get("covariance positive") is False:
        level, message = Level.WARN, "the covariance is not positive: the standard deviations mean nothing"
    level, message = trouble_with_samples(progress, node.attending, intake.catching_up.came_at) or (level, message)
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
