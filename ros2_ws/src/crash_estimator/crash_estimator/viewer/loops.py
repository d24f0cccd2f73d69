"""Force over crush, one drawing for each element, growing as the crash goes on.

Rerun has no XY plot: a 2D view with axes of our own. The data are in mm and kN (or N); a static transform
scales them to a box of 1.35 by 1 with y up. When the data outgrow the axes only the transform and the ticks change.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from ..core.estimate import ElementState
from .axes import Axis, axis_for, text
from .blocks import ForceBlock, revision_of
from .cast import Cast
from .colors import GRID, INK, TITLE
from .frames import frame_ends
from .pen import TIMELINE, Pen, own_path, path, points
from .plausible import Limits
from .units import MM

WIDTH, HEIGHT = 1.35, 1.0
"""Of the plotting area."""
LINE = 0.115
"""Height of a line of text above it."""
GRID_WIDTH = 0.15
"""Pixels: half the width of a grid's lines."""
FRONT = 10.0
"""Draw order of the loops, above grid and axes; a newer revision's is in front."""


class Extent(NamedTuple):
    """The range of crush and force seen so far, and its axes."""

    x: Axis
    y: Axis
    range: tuple[float, float, float, float]

    def grown(self, crush: np.ndarray, force: np.ndarray) -> "Extent":
        low_x, high_x, low_y, high_y = self.range
        range_ = (
            float(np.fmin.reduce(crush, initial=low_x)),
            float(np.fmax.reduce(crush, initial=high_x)),
            float(np.fmin.reduce(force, initial=low_y)),
            float(np.fmax.reduce(force, initial=high_y)),
        )
        return extent(range_)


def extent(range_: tuple[float, float, float, float] = (0.0, 1e-3, 0.0, 1e-3)) -> Extent:
    return Extent(axis_for(*range_[:2]), axis_for(*range_[2:]), range_)


class Loops:
    """Writes the loops of all estimators into one recording."""

    def __init__(self, pen: Pen):
        self.pen = pen
        self.limits = Limits()
        self.extents: dict[str, Extent] = {}  # by element
        self.last_point: dict[tuple[str, str], np.ndarray] = {}  # by (estimator, element): where its line goes on

    def write(self, cast: Cast, block: ForceBlock) -> None:
        ends = frame_ends(block.time_ns, cast.span)
        limit = self.limits.force(block)
        factor = cast.shown("N").factor
        for k, element in enumerate(block.element):
            # a gap that opens and closes is not part of the loop, nor is a force out of this world
            carries = (block.state[:, k] != ElementState.APART) & np.isfinite(block.crush[:, k])
            drawn = carries & (np.abs(block.force[:, k]) <= limit)
            line = np.column_stack([MM * block.crush[:, k], factor * block.force[:, k]])[drawn]
            self._fit(cast, element, line)
            if len(line):
                own_ends = np.unique(np.cumsum(drawn)[ends] - 1)
                self._draw(block.estimator, element, block.time_ns[drawn], line, own_ends[own_ends >= 0])

    def _draw(self, who: str, element: str, time_ns: np.ndarray, line: np.ndarray, ends: np.ndarray) -> None:
        key = (who, element)
        start = self.last_point.get(key, line[0])
        self.last_point[key] = line[-1]
        joined = np.vstack([start, line])  # row i of the line is row i + 1 here
        strips = [joined[a : b + 2] for a, b in zip(np.append(0, ends[:-1] + 1), ends)]
        entity = loop_path(element, who)
        order = FRONT + revision_of(who)
        self.pen.once(entity, lambda cast: rr.LineStrips2D.from_fields(
            colors=[cast.color(who)], radii=[points(1.1)], draw_order=order
        ))  # fmt: skip
        self.pen.columns(entity, time_ns[ends], rr.LineStrips2D.columns(strips=strips))
        now = f"{entity}/now"
        self.pen.once(now, lambda cast: rr.Points2D.from_fields(
            colors=[cast.color(who)], radii=[points(4.0)], draw_order=order
        ))  # fmt: skip
        self.pen.columns(now, time_ns[ends], rr.Points2D.columns(positions=line[ends]))

    def _fit(self, cast: Cast, element: str, line: np.ndarray) -> None:
        before = self.extents.get(element)
        after = (before or extent()).grown(line[:, 0], line[:, 1])
        self.extents[element] = after
        if before is None or (before.x, before.y) != (after.x, after.y):
            self._axes(path("force_crush", element), after.x, after.y, f"force, {cast.shown('N').unit}")
        self.pen.once(path("force_crush", element, "legend"), lambda cast: _legend(cast, element))

    def _axes(self, root: str, x: Axis, y: Axis, force: str) -> None:
        scale = np.diag([WIDTH / (x.high - x.low), -HEIGHT / (y.high - y.low), 1.0])
        origin = [-x.low * scale[0, 0], -y.low * scale[1, 1], 0.0]
        self.pen.static(f"{root}/data", rr.Transform3D(translation=origin, mat3x3=scale))
        across = [(value - x.low) / (x.high - x.low) * WIDTH for value in x.ticks]
        up = [-(value - y.low) / (y.high - y.low) * HEIGHT for value in y.ticks]
        grid = [[(u, 0.0), (u, -HEIGHT)] for u in across] + [[(0.0, v), (WIDTH, v)] for v in up]
        zero = [[(origin[0], 0.0), (origin[0], -HEIGHT)], [(0.0, origin[1]), (WIDTH, origin[1])]]
        self.pen.static(f"{root}/grid", rr.LineStrips2D(grid, colors=[GRID], radii=points(GRID_WIDTH), draw_order=1.0))
        self.pen.static(f"{root}/zero", rr.LineStrips2D(zero, colors=[INK], radii=points(0.6), draw_order=2.0))
        at = [(u, 0.01) for u in across] + [(-0.09, v - 0.06) for v in up]
        self.pen.labels(
            f"{root}/ticks", at, [text(v, x.step) for v in x.ticks] + [text(v, y.step) for v in y.ticks], INK
        )
        at = [(WIDTH / 2, 0.11), (0.02, -HEIGHT - 1.4 * LINE)]
        self.pen.labels(f"{root}/titles", at, ["crush, mm", force], TITLE)


def _legend(cast: Cast, element: str) -> rr.Points2D:
    """One line of text for each member, above the plot at the right."""
    owners = [m.name for m in cast.members if element in m.elements]
    at = [(0.62 * WIDTH, -HEIGHT - LINE * (1.4 + k)) for k in reversed(range(len(owners)))]
    colors = [cast.color(name) for name in owners]
    labels = [cast.label(name) for name in owners]
    return rr.Points2D(at, labels=labels, colors=colors, radii=points(0.01), show_labels=True)


def loop_path(element: str, who: str) -> str:
    return own_path("force_crush", element, "data", who=who)


def loop_views(cast: Cast, elements: Sequence[str]) -> list[rrb.View]:
    """Force over crush, one view for each of the elements; a loop shows all its past, everything else the present."""
    until_now = rrb.VisibleTimeRanges(
        rrb.VisibleTimeRange(
            TIMELINE, start=rrb.TimeRangeBoundary.infinite(), end=rrb.TimeRangeBoundary.cursor_relative()
        )
    )
    return [
        rrb.Spatial2DView(
            origin=path("force_crush", element),
            name=f"{element}: force over crush",
            visual_bounds=rrb.VisualBounds2D(
                x_range=[-0.2, WIDTH + 0.1], y_range=[-HEIGHT - LINE * (len(cast.members) + 0.8), 0.24]
            ),
            overrides={loop_path(element, m.name): until_now for m in cast.members if element in m.elements},
        )
        for element in elements
    ]
