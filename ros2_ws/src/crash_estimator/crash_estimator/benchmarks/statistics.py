"""Shares of counted cases, with their confidence intervals."""

from collections.abc import Callable, Iterable, Sequence
from math import sqrt
from typing import NamedTuple

Z95 = 1.959964
"""Standard deviations of the two-sided 95 % interval."""


class Share(NamedTuple):
    hits: int
    of: int

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's 95 % interval (E. B. Wilson, J. Am. Stat. Assoc. 22, 1927): honest near 0 and 1; of nothing 0 to
        1."""
        if not self.of:
            return 0.0, 1.0
        p, n, z2 = self.hits / self.of, self.of, Z95**2
        middle, half = p + z2 / (2 * n), Z95 * sqrt(p * (1 - p) / n + z2 / (4 * n * n))
        return max((middle - half) / (1 + z2 / n), 0.0), min((middle + half) / (1 + z2 / n), 1.0)

    def __str__(self) -> str:
        """97 % (93 to 99)  of 160"""
        if not self.of:
            return "-"
        low, high = self.interval
        return f"{100 * self.hits / self.of:.0f} % ({100 * low:.0f} to {100 * high:.0f}) of {self.of}"

    @property
    def short(self) -> str:
        return f"{self.hits}/{self.of}" if self.of else "-"


def share(of: Iterable[dict], hit: Callable[[dict], bool]) -> Share:
    found = [bool(hit(one)) for one in of]
    return Share(sum(found), len(found))


def median(values: Sequence[float]) -> float:
    """nan of nothing."""
    ordered, n = sorted(values), len(values)
    return 0.5 * (ordered[(n - 1) // 2] + ordered[n // 2]) if n else float("nan")
