"""How the cost of a sample grows with channels, parameters and the record's length, without the graph."""

import tracemalloc
from collections.abc import Iterator, Sequence
from pathlib import Path
from time import perf_counter

import numpy as np

from ..core.compiled.estimator import CompiledEstimator
from ..core.methods import make_estimator
from ..model_file import load_model
from .speed_recordings import chain, ringing
from .speed_row import Row, microseconds, per_call

CHANNELS, PARAMETERS, SECONDS = (1, 4, 16, 64), (2, 6, 10, 20, 40), (0.1, 1.0, 10.0, 100.0)
METHODS = ("constrained_kalman", "mrls")
BLOCK = 500
"""Samples: the shortest record has two, so that one is let go while the next is made."""


def growth(folder: Path, seconds: Sequence[float] = SECONDS, parameters: Sequence[int] = PARAMETERS) -> Iterator[Row]:
    yield _said("channels of the recording", [(n, _cost(folder, n, 1, "constrained_kalman")) for n in CHANNELS])
    for method in METHODS:
        cost = [(p, _cost(folder, p // 2, p // 2, method)) for p in parameters]
        yield _said(f"parameters, {method}", cost)
    yield from _length(folder, seconds)


def _cost(folder: Path, channels: int, bodies: int, method: str) -> float:
    """s a sample in blocks."""
    recording = ringing(channels, 0.05)
    estimator = make_estimator(load_model(str(chain(bodies, folder / "grow.yaml"))), recording.test, method)
    assert isinstance(estimator, CompiledEstimator)
    whole = lambda: estimator.follow(estimator.init(), recording.time_ns, recording.values)  # noqa: E731
    return per_call(whole, 0.2) / len(recording)


def _said(what: str, cost: list[tuple[int, float]]) -> Row:
    numbers = ", ".join(f"{n}: {microseconds(seconds)}" for n, seconds in cost)
    exponent = np.polyfit(np.log([n for n, _ in cost]), np.log([seconds for _, seconds in cost]), 1)[0]
    return Row(f"a sample of a record by {what}", numbers, f"grows as n^{exponent:.2f}")


def _length(folder: Path, seconds: Sequence[float]) -> Iterator[Row]:
    """Followed in blocks, as a node does; the state that is kept does not grow."""
    cost, peaks = [], []
    model = load_model(str(chain(3, folder / "grow.yaml")))
    block = ringing(4, BLOCK / 10e3)
    estimator = make_estimator(model, block.test, "constrained_kalman")
    assert isinstance(estimator, CompiledEstimator)
    for length in seconds:
        blocks, state = max(1, round(length * 10e3 / BLOCK)), estimator.init()
        tracemalloc.start()
        start = perf_counter()
        for k in range(blocks):
            state, _ = estimator.follow(state, block.time_ns + k * 100_000 * BLOCK, block.values)
        cost.append((perf_counter() - start) / (blocks * BLOCK))
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    numbers = ", ".join(f"{length:g} s: {microseconds(c)}" for length, c in zip(seconds, cost))
    what = "a sample by the record's length at 10 kHz"
    yield Row(what, numbers, "constant: linear in length", cost[-1] / cost[0], 1.5, least=False)
    said = f"{peaks[0] / 1024:.0f} to {peaks[-1] / 1024:.0f} KiB"
    bound = f"state {state.nbytes} bytes, blocks of {BLOCK}"
    yield Row("memory that following it takes at most", said, bound, peaks[-1] / peaks[0], 1.1, least=False)
