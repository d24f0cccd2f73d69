"""Axes that can be read on a screen of 1600 x 900: Rerun's ticks are powers of ten, not all of them with a number.

It writes numbers at the finest power of ten that leaves them room. Where a plot is too small for that of its range, it
is left with 0 alone; then the range is widened up to a coarser tick.
"""

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import rerun.blueprint as rrb
from rerun.blueprint.api import Container, View

from .cast import Cast, Range

SCREEN = (1600.0, 760.0)
"""Pixels that are left for the tabs' content on it."""
TITLE, TIMES, NUMBERS = 30.0, 22.0, 34.0
"""Pixels of a plot's height for its title and for its time axis, of its width for the numbers of the other axis."""
TICK_WIDTH, TICK_HEIGHT = 66.0, 22.0
"""Pixels between two numbers of an axis from which Rerun writes them (it begins with 60 and 20, hardly to be seen)."""
MARGIN = 0.04
"""Share of the range that is left free above and below."""


class Plot(NamedTuple):
    """A time plot and the pixels that it has for its curves."""

    view: View
    width: float
    height: float


def plots(part: Container | View, width: float = SCREEN[0], height: float = SCREEN[1]) -> Iterator[Plot]:
    """All time plots in a part of the layout, which has so many pixels."""
    if isinstance(part, View):
        if part.class_identifier == "TimeSeries":
            yield Plot(part, width - NUMBERS, height - TITLE - TIMES)
        return
    if not (contents := list(part.contents)):
        return
    columns: Any = [1.0]  # shares, as any of the sequences that Rerun takes
    rows: Any = [1.0]
    if isinstance(part, rrb.Horizontal):
        columns = part.column_shares or [1.0] * len(contents)
    elif isinstance(part, rrb.Vertical):
        rows = part.row_shares or [1.0] * len(contents)
    elif isinstance(part, rrb.Grid):
        count = part.grid_columns or math.ceil(math.sqrt(len(contents)))
        columns, rows = [1.0] * count, [1.0] * math.ceil(len(contents) / count)
    for k, child in enumerate(contents):
        across, down = (columns[k % len(columns)], rows[k // len(columns) % len(rows)])
        yield from plots(child, width * across / sum(columns), height * down / sum(rows))


def set_axes(tabs: Container, cast: Cast) -> Range | None:
    """Give the plots whose lines' ranges are known their vertical axes -> the time axis of all, s."""
    found, ranges = list(plots(tabs)), dict(cast.ranges)
    for view, _, height in found:
        low, high = ranges.get(str(view.origin).strip("/"), (1.0, 0.0))
        if low <= high:
            view.properties["ScalarAxis"] = rrb.ScalarAxis(range=value_range(low, high, height / TICK_HEIGHT))
    return time_range(cast.span, min((plot.width for plot in found), default=SCREEN[0]))


def rounded(low: float, high: float) -> Range:
    """To two digits of what lies between, so that alike recordings have one layout."""
    step = 10.0 ** (math.floor(math.log10(max(high - low, 1e-9 * max(abs(low), abs(high)), 1e-12))) - 1)
    return math.floor(low / step) * step, math.ceil(high / step) * step


def time_range(span: Range, width: float) -> Range | None:
    """What of the recording is shown, s: from a little before the impact on, and at least two numbers."""
    start, end = span
    if not end > 0.0:
        return None
    start = max(start, -0.1 * end)  # the quiet before it needs little room
    step = 10.0 ** math.floor(math.log10(end) + 1e-9)
    while (end - start) / step > width / TICK_WIDTH:
        step *= 10.0
    return start, end if end >= step else 1.07 * step


def value_range(low: float, high: float, most: float) -> Range:
    """A range that holds low to high and two numbers, where there is room for `most` steps."""
    room = max(high - low, 1e-9 * max(abs(low), abs(high)), 1e-12) * MARGIN
    low, high = low - room, high + room
    step = 10.0 ** math.floor(math.log10(high - low) - 1.0)
    while True:
        first, last = math.floor(low / step), math.ceil(high / step)
        if (high - low) / step <= most and _numbers(low, high, step) >= 2:
            return low, high
        if (last - first) <= most:
            room, wider = 0.05 * step, ((low, last * step), (first * step, high), (first * step, last * step))
            least = next(ends for ends in sorted(wider, key=_length) if _numbers(*ends, step) >= 2)
            return least[0] - room * (least[0] != low), least[1] + room * (least[1] != high)
        step *= 10.0


def _length(ends: Range) -> float:
    return ends[1] - ends[0]


def _numbers(low: float, high: float, step: float) -> int:
    return math.floor(high / step + 1e-9) - math.ceil(low / step - 1e-9) + 1
