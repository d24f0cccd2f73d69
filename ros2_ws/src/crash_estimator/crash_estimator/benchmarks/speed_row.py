"""One line of docs/benchmark.md: what was measured beside its reference from the same run."""

from collections.abc import Callable
from time import perf_counter
from typing import NamedTuple


class Row(NamedTuple):
    what: str
    ours: str
    reference: str = ""  # what it is compared with, measured in the same run
    ratio: float | None = None
    reach: float | None = None
    least: bool = True  # the ratio is to be at least `reach`; else at most

    @property
    def held(self) -> str:
        if self.ratio is None or self.reach is None:
            return ""
        return "yes" if (self.ratio >= self.reach if self.least else self.ratio <= self.reach) else "no"

    def cells(self) -> tuple[str, ...]:
        ratio = "" if self.ratio is None else f"{self.ratio:.3g}"
        reach = "" if self.reach is None else f"{'>=' if self.least else '<='} {self.reach:g}"
        return self.what, self.ours, self.reference, ratio, reach, self.held


HEAD = ("measured", "ours", "reference", "ratio", "reach", "held")


def per_call(function: Callable[[], object], seconds: float = 0.3) -> float:
    """s a call: the best of five rounds, because whatever else the machine does only adds."""
    function()
    start = perf_counter()
    function()
    n = max(1, int(seconds / 5 / max(perf_counter() - start, 1e-7)))
    rounds = []
    for _ in range(5):
        start = perf_counter()
        for _ in range(n):
            function()
        rounds.append((perf_counter() - start) / n)
    return min(rounds)


def microseconds(seconds: float) -> str:
    return f"{seconds * 1e6:.3g} us"
