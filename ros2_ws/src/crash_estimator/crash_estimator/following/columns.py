"""Estimates of consecutive samples as columns, the form in which they travel: from the compiled recursion's rows as
they are, or from `Estimate`s."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from math import isfinite, isqrt
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from ..core.estimate import ROW, Estimate, Event, ParameterStatus, sent
from ..core.methods import AnyEstimator
from ..kept import Rows

if TYPE_CHECKING:  # who only reads estimates has no use for numba, which takes half a second to import
    from ..core.compiled.estimator import CompiledEstimator

SENT = sent("parameters", "equations", "elements", "bodies") | {"covariance": "covariance"}
"""Field of the messages -> name in an Estimate; the covariance is what the node's health looks at."""


class Columns(NamedTuple):
    """Estimates of the samples number, number + 1, ..."""

    number: int
    time_ns: np.ndarray  # (k,) int64
    of: Mapping[str, np.ndarray]  # field of the messages -> (k, width)
    events: Sequence[tuple[int, Event]]  # row, event
    again: "Again | None" = None

    def __len__(self) -> int:
        return len(self.time_ns)

    def later(self, fields: Iterable[str]) -> tuple[Callable[[], "Columns"], int]:
        """What gives these fields when they are wanted, and the bytes that it keeps until then."""
        if self.again:
            return self.again.columns, self.again.nbytes
        kept = Columns(self.number, self.time_ns, {field: self.of[field] for field in fields}, ())
        return lambda: kept, sum(array.nbytes for array in kept.of.values())


class Again(NamedTuple):
    """Computes a block's estimates once more, the same to the last bit.

    All it keeps is a state, the samples being kept anyway: to find new memory for what it gives, 200 bytes a sample and
    more for the forces alone, takes a compiled recursion 5 % of its time.
    """

    estimator: "CompiledEstimator"
    state: np.ndarray  # before the block
    rows: Rows  # views of what is kept

    @property
    def nbytes(self) -> int:
        return self.state.nbytes

    def columns(self) -> Columns:
        """Without the events."""
        _, table = self.estimator.follow(self.state, self.rows.time_ns, self.rows.values)
        return Columns(self.rows.number, self.rows.time_ns, Parts(table, self.estimator.columns), ())


class FilterFailure(Exception):
    """A filter that cannot go on; `done` is what it has said before that."""

    def __init__(self, method: str, number: int, time_ns: int, reason: str, done: Columns | None):
        super().__init__(f"sample {number} at {time_ns * 1e-6:.2f} ms: {method} cannot go on ({reason})")
        self.done = done


def follow(estimator: AnyEstimator, state: Any, rows: Rows) -> tuple[Any, Columns]:
    """Fold consecutive samples, at least one; raises FilterFailure.

    However the samples are shared out to calls, states and estimates are the same to the last bit.
    """
    if hasattr(estimator, "follow"):  # a compiled one takes them all at once
        return _follow_compiled(cast("CompiledEstimator", estimator), state, rows)
    estimates: list[Estimate] = []
    for sample in rows.samples():
        try:
            state, estimate = estimator.step(state, sample)
            if not np.isfinite(estimate.parameters).all():
                raise np.linalg.LinAlgError(NOT_FINITE)
        except np.linalg.LinAlgError as error:
            done = columns_of(estimates) if estimates else None
            raise FilterFailure(estimator.description.method, sample.number, sample.time_ns, str(error), done) from None
        estimates.append(estimate)
    return state, columns_of(estimates)


NOT_FINITE = "the parameters are no longer finite"


def columns_of(estimates: Sequence[Estimate]) -> Columns:
    """Of consecutive estimates, at least one."""
    of = {field: np.array([getattr(e, name) for e in estimates]) for field, name in SENT.items()}
    besides = np.array([e.extra for e in estimates])
    methods = {
        "parameters": besides,
        "std": np.array([e.extra_std for e in estimates]),
        "status": np.full(besides.shape, ParameterStatus.METHOD, dtype=np.uint8),
    }
    for field, name in sent("parameters").items():
        of[field] = np.hstack([of[field], methods.get(name, np.full(besides.shape, np.nan))])
    events = [(row, event) for row, estimate in enumerate(estimates) for event in estimate.events]
    return Columns(estimates[0].number, np.array([e.time_ns for e in estimates]), of, events)


def _follow_compiled(estimator: "CompiledEstimator", state: np.ndarray, rows: Rows) -> tuple[np.ndarray, Columns]:
    after, table = estimator.follow(state, rows.time_ns, rows.values)
    value = table[:, estimator.columns["parameters"]]
    if not isfinite(sum(value[-1].tolist())):  # what is not finite once stays so
        good = int(np.argmin(np.isfinite(value).all(axis=1)))
        done = _columns(estimator, state, rows.first(good), table[:good]) if good else None
        number, time_ns = rows.number + good, int(rows.time_ns[good])
        raise FilterFailure(estimator.description.method, number, time_ns, NOT_FINITE, done)
    return after, _columns(estimator, state, rows, table)


def _columns(estimator: "CompiledEstimator", state: np.ndarray, rows: Rows, table: np.ndarray) -> Columns:
    events = [
        (k, event)
        for k in table[:, estimator.columns["news"]].nonzero()[0].tolist()
        for event in estimator.events(table[k], table[k - 1] if k else state, int(rows.time_ns[k]))
    ]
    return Columns(rows.number, rows.time_ns, Parts(table, estimator.columns), events, Again(estimator, state, rows))


class Parts(Mapping):
    """The messages' fields, cut out of the rows of output when they are asked for: mostly some are not."""

    def __init__(self, table: np.ndarray, places: dict[str, slice]):
        self.table, self.places = table, places

    def __getitem__(self, field: str) -> np.ndarray:
        name = SENT[field]
        part = self.table[:, self.places[name]]
        if field == "covariance":
            side = isqrt(part.shape[1])
            return part.reshape(-1, side, side)
        return part.astype(np.uint8) if ROW[name].code else part

    def __iter__(self) -> Iterator[str]:
        return iter(SENT)

    def __len__(self) -> int:
        return len(SENT)
