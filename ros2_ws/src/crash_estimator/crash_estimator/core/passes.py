"""Gauss-Newton over a record that is at hand: pass after pass, each from the noise model that the one before has found.

One pass of the recursion estimates theta while it does not yet know the noise model: samples count little until it
begins to (`gauss_newton.TRUST`), and the first ones that count do so with a noise model that is wrong. A pass that
begins with the noise model is the recursion's next Gauss-Newton step (thesis 4.12). theta begins from its initial value
again, and the noise model with the covariance of the first pass, whatever the number of passes: the record is the same,
and tells no more.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from crash_replay.recording import Recording

from .estimate import Estimate
from .estimators.gauss_newton import GaussNewton
from .estimators.noise_model import NoiseModel

SETTLED = 0.05
"""Of its standard deviation: a pass that moves no parameter by more has settled. A twentieth does not show in an
error."""

MOST_PASSES = 10
"""On simulated tests with coloured noise three settle; ten that do not say that the orders are too many for the
record."""


class Passes(NamedTuple):
    """What was found, and how it settled."""

    estimator: Any
    estimates: list[Estimate]  # of the last pass
    moved: tuple[float, ...]  # largest change of a parameter by each pass after the first, in its standard deviations

    @property
    def settled(self) -> bool:
        return bool(self.moved) and self.moved[-1] <= SETTLED

    def as_json(self) -> dict:
        return {"made": len(self.moved) + 1, "moved": self.moved, "settled": self.settled}

    @property
    def text(self) -> str:
        if not self.moved:
            return "one pass over the record: its first samples count little, see docs/methods.md"
        end = "settled" if self.settled else "not settled: lower the orders p and q"
        moves = ", ".join(f"{x:.2f}" for x in self.moved)
        return f"{len(self.moved) + 1} passes over the record, parameters moved by {moves} sigma: {end}"


def most_passes(given: int | None, preset: str) -> int:
    """How many at most: as given; else the recursion that the thesis prints goes over a record once."""
    return given or (1 if preset == "thesis" else MOST_PASSES)


def repeats(estimator: Any) -> bool:
    """Whether its method has a noise model that a further pass can begin with."""
    method = getattr(estimator, "method", None)
    return isinstance(method, GaussNewton) and not method.start and bool(estimator.description.extra)


def settle(make: Callable[[tuple[NoiseModel, ...]], Any], recording: Recording, most: int = MOST_PASSES) -> Passes:
    """Passes of `make(start)`, an estimator with method Gauss-Newton, until they settle, `most` of them."""
    estimator = make(())
    models, estimates = _one_pass(estimator, recording)
    first, moved = models, []
    known = all(np.isfinite(model.variance) for model in models)  # else no sample has told anything
    while known and len(moved) + 1 < most and not (moved and moved[-1] <= SETTLED):
        start = tuple(model._replace(covariance=begun.covariance) for model, begun in zip(models, first))
        estimator, before = make(start), estimates[-1]
        models, estimates = _one_pass(estimator, recording)
        change, std = np.abs(estimates[-1].parameters - before.parameters), estimates[-1].std
        moved.append(float(np.max(change[std > 0.0] / std[std > 0.0], initial=0.0)))
    return Passes(estimator, estimates, tuple(moved))


def _one_pass(estimator: Any, recording: Recording) -> tuple[tuple[NoiseModel, ...], list[Estimate]]:
    state, estimates = estimator.init(), []
    for sample in recording.samples():
        state, estimate = estimator.step(state, sample)
        estimates.append(estimate)
    return tuple(estimator.method.noise_models(state.method)), estimates
