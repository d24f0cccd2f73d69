"""The lumped model as a figure: which body stands in which column, which spring runs in which row (pure).

A spring pushes its first body back and its second one forward, so the first stands to the left. Springs that
do not overlap share a row, and a body is as tall as the rows of its springs. Among the orders of the springs
the one is taken in which the fewest springs run through a body that is not theirs.
"""

from functools import cache
from itertools import islice, permutations
from typing import NamedTuple

MOST_ORDERS = 1000
"""Orders of the springs that are tried; up to six springs that is all of them."""


class Schematic(NamedTuple):
    """Columns from the left, rows from the top."""

    columns: dict[str, int]  # of each body that a spring holds
    rows: tuple[int, ...]  # of each spring
    heights: dict[str, tuple[int, int]]  # first and last row of each body

    @property
    def last_column(self) -> int:
        return max(self.columns.values())

    @property
    def row_count(self) -> int:
        return max(self.rows) + 1

    @property
    def reference(self) -> str:
        """The body that stands still in the picture: the one struck last."""
        return max(self.columns, key=lambda body: self.columns[body])


@cache
def schematic(between: tuple[tuple[str, str], ...]) -> Schematic:
    """The figure of springs given by their two bodies each; there must be one at least."""
    columns = _columns(between)
    tried = islice(permutations(range(len(between))), MOST_ORDERS)
    return min((_packed(between, columns, order) for order in tried), key=lambda s: _disorder(between, s))


def _columns(between: tuple[tuple[str, str], ...]) -> dict[str, int]:
    """Each body's longest chain of springs from the left; rings are cut where they would never end."""
    columns = {body: 0 for ends in between for body in ends}
    for _ in range(len(columns)):
        for a, b in between:
            columns[b] = min(max(columns[b], columns[a] + 1), len(columns) - 1)
    return columns


def _packed(between: tuple[tuple[str, str], ...], columns: dict[str, int], order: tuple[int, ...]) -> Schematic:
    """Springs one after the other, each into the first row where it overlaps no other."""
    rows: dict[int, int] = {}
    for k in order:
        low, high = sorted(columns[body] for body in between[k])
        row = 0
        while any(rows[j] == row and _overlap((low, high), sorted(columns[b] for b in between[j])) for j in rows):
            row += 1
        rows[k] = row
    heights = {}
    for body in columns:
        own = [rows[k] for k, ends in enumerate(between) if body in ends]
        heights[body] = (min(own), max(own))
    return Schematic(columns, tuple(rows[k] for k in range(len(between))), heights)


def _overlap(first: tuple[int, int], second: list[int]) -> bool:
    return first[0] < second[1] and second[0] < first[1]


def _disorder(between: tuple[tuple[str, str], ...], figure: Schematic) -> tuple[int, int, tuple[int, ...]]:
    """Springs through bodies and bodies over one another, then rows, then the springs out of their given order."""
    columns, heights = figure.columns, figure.heights
    clashes = 0
    for (a, b), row in zip(between, figure.rows):
        low, high = sorted((columns[a], columns[b]))
        clashes += sum(low < columns[k] < high and heights[k][0] <= row <= heights[k][1] for k in columns)
    bodies = list(columns)
    for i, one in enumerate(bodies):
        for other in bodies[i + 1 :]:
            same = columns[one] == columns[other]
            clashes += same and heights[one][0] <= heights[other][1] and heights[other][0] <= heights[one][1]
    return clashes, figure.row_count, figure.rows
