"""What a node says of itself on `/diagnostics`, without a graph."""

import time
from types import SimpleNamespace

import numpy as np
import pytest
from helpers_alone import attending

from crash_estimator.core.estimate import ParameterStatus
from crash_estimator.nodes.estimator_health import filter_health
from crash_estimator.nodes.node_health import OLD, trouble_with_samples
from crash_estimator.nodes.viewer_health import FULL, viewer_health
from crash_replay.attending import Progress
from crash_replay.health import Level


def latest(covariance, value=(1.0, 2.0, 3.0), status=(0, 0, 0)):
    """The estimates of a block of two samples, whose last one counts."""
    rows = {"covariance": covariance, "value": value, "status": status}
    return SimpleNamespace(of={name: np.array([np.full(np.shape(row), np.nan), row]) for name, row in rows.items()})


def test_the_covariance_of_the_last_sample_is_looked_at_as_a_matrix():
    description = SimpleNamespace(parameters=("a", "b", "c"))
    positive = np.diag([1e6, 1.0, 1e-6]) + 0.0
    positive[0, 1] = positive[1, 0] = 300.0
    found = filter_health(latest(positive.ravel(), status=(0, ParameterStatus.CLAMPED, 0)), description)
    assert found["estimates finite"] and found["covariance positive"] and found["clamped"] == "b"
    assert found["condition of the correlations"] == pytest.approx(1.3 / 0.7)
    positive[0, 1] = positive[1, 0] = 2000.0  # a correlation of two
    assert not filter_health(latest(positive.ravel()), description)["covariance positive"]
    assert not filter_health(latest(positive.ravel(), value=(1.0, np.nan, 3.0)), description)["estimates finite"]


@pytest.mark.parametrize(
    ("quiet", "sent", "missing", "level"),
    [
        (2.0 * OLD, 500, 0, Level.STALE),
        (0.5 * OLD, 500, 0, None),  # on their way
        (2.0 * OLD, 100, 0, None),  # there are no more
        (0.0, 100, 3, Level.WARN),
    ],
)
def test_samples_that_do_not_come_make_what_is_said_old(quiet, sent, missing, level):
    state = SimpleNamespace(run=1, number=sent, state=0, first=0, FINISHED=2)
    progress = Progress(run=1, total=1000, next=100, missing=missing)
    found = trouble_with_samples(progress, attending(state), time.monotonic() - quiet)
    assert (found[0] if found else None) == level


@pytest.mark.parametrize(
    ("items", "dropped", "troubles", "level"),
    [
        (0, 0, 0, Level.OK),
        (int(FULL * 100) - 1, 0, 0, Level.OK),
        (int(FULL * 100) + 1, 0, 0, Level.WARN),
        (0, 1, 0, Level.WARN),
        (0, 0, 1, Level.WARN),
    ],
)
def test_a_viewer_warns_while_its_queue_is_long_or_something_is_not_drawn(items, dropped, troubles, level):
    queue = SimpleNamespace(items=items, size=2_000_000, dropped=dropped, troubles=troubles, test="one")
    sinks = SimpleNamespace(url="http://here", rrd="")
    found = viewer_health(SimpleNamespace(queue=lambda: queue, limit=100, sinks=sinks))
    assert found.level == level
    assert found.values["messages waiting"] == items and found.values["MB waiting"] == pytest.approx(2.0)
