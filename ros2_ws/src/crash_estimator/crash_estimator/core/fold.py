"""The one loop that runs any estimator over any samples."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

from crash_replay.recording import Sample

from .estimate import Estimate

if TYPE_CHECKING:
    from .methods import AnyEstimator


def run(estimator: "AnyEstimator", samples: Iterable[Sample]) -> list[Estimate]:
    """Fold the samples through the estimator -> one estimate a sample."""
    state, estimates = estimator.init(), []
    for sample in samples:
        state, estimate = estimator.step(state, sample)
        estimates.append(estimate)
    return estimates
