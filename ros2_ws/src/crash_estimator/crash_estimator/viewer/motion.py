"""The bodies moving, with springs coloured by their force: one lane for each estimator, all to one scale.

Where a model was changed its newest revision is drawn, and each spring says what it carried before.

Crush is true to scale: a spring at rest is REST long in the drawing, which stands for `Scale.length` metres. Bodies
stand where the crush of their springs puts them; the one struck last stands still.
"""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from ..core.estimate import ElementState
from . import shapes
from .axes import text
from .blocks import ForceBlock, estimator_of
from .cast import Cast, Member, Range
from .colors import BODY, EDGE, PLATE
from .frames import frame_ends
from .pen import Pen, path, points
from .plausible import Limits
from .schematic import Schematic, schematic
from .shapes import PITCH, REST, half_size, lane_height, row_y

STEP = 0.5
"""Units of the drawing."""


class Scale(NamedTuple):
    """What the drawing's sizes and colours mean."""

    length: float  # m of crush that would take all of a spring's length
    force: float  # N at the ends of the colour scale


@dataclass
class Lane:
    """One member's figure and its frames so far."""

    member: Member
    figure: Schematic
    top: float
    positions: np.ndarray  # (bodies, springs): position of each body from the crush of each spring
    time_ns: list[np.ndarray] = field(default_factory=list)
    crush: list[np.ndarray] = field(default_factory=list)  # (frames, springs) m
    force: list[np.ndarray] = field(default_factory=list)  # (frames, springs) N
    state: list[np.ndarray] = field(default_factory=list)


class Motion:
    """Writes the moving masses of all estimators into one recording."""

    def __init__(self, pen: Pen):
        self.pen = pen
        self.lanes: dict[str, Lane] = {}
        self.scale: Scale | None = None
        self.drawn_again = 0
        self.limits = Limits()
        self.reach: Range = (0.0, 0.0)  # of the bodies' edges, in the drawing

    def set_cast(self, cast: Cast) -> None:
        """Make room for all; what has been drawn moves to its new place."""
        before, self.lanes = self.lanes, {}
        for member in cast.members:
            if not member.elements:
                continue
            lane = before.get(member.name)
            if lane is None or lane.member != member:
                lane = _lane(member)
            self.lanes[member.name] = lane
        for k, member in enumerate(cast.newest):
            if lane := self.lanes.get(member.name):
                lane.top = sum(lane_height(m) for m in cast.newest[:k])
                self._figure(cast, lane)
        if self.scale:
            self._rescale(cast, self.scale)

    def write(self, cast: Cast, block: ForceBlock) -> None:
        lane = self.lanes.get(block.estimator)
        if lane is None:  # a model without springs
            return
        ends = frame_ends(block.time_ns, cast.span)
        crush, force = (np.nan_to_num(values[ends], posinf=0.0, neginf=0.0) for values in (block.crush, block.force))
        new = (block.time_ns[ends], crush, force, block.state[ends])
        for column, rows in zip((lane.time_ns, lane.crush, lane.force, lane.state), new, strict=True):
            column.append(rows)
        scale = self._grown(cast, block, crush, force)
        if scale == self.scale:
            if cast.is_newest(block.estimator):
                self._frames(cast, lane, *new)
        else:
            self._rescale(cast, scale)

    def finish(self, cast: Cast) -> None:
        """Draw everything to the scale of the largest crush, now that it is known."""
        largest = max((float(np.max(np.abs(c))) for lane in self.lanes.values() for c in lane.crush), default=0.0)
        if self.scale and largest > 0:
            self._rescale(cast, self.scale._replace(length=1.25 * largest))

    def frame(self, besides: Range = (0.0, 0.0)) -> Range:
        """What the view has to hold from the left to the right, in steps so that it seldom changes; and `besides`."""
        low, high = min(self.reach[0], besides[0]), max(self.reach[1], besides[1])
        return np.floor(low / STEP) * STEP, np.ceil(high / STEP) * STEP

    def _grown(self, cast: Cast, block: ForceBlock, crush: np.ndarray, force: np.ndarray) -> Scale:
        length, strength = self.scale or (_expected_crush(cast, block), 1.0)
        deepest, strongest = float(np.max(np.abs(crush))), min(float(np.max(np.abs(force))), self.limits.force(block))
        if deepest > 0.9 * length:
            length = 1.5 * deepest
        return Scale(length, max(strength, shapes.force_scale(max(strongest, 1.0))))

    def _rescale(self, cast: Cast, scale: Scale) -> None:
        """Draw all frames again. Each goes 1 ns after its former self, which Rerun shows no longer then."""
        self.scale, self.reach = scale, (0.0, 0.0)
        self.drawn_again += 1
        shapes.legend(self.pen, cast, *scale)
        for lane in self.lanes.values():
            if lane.time_ns and cast.is_newest(lane.member.name):
                self._frames(
                    cast, lane, *(np.concatenate(c) for c in (lane.time_ns, lane.crush, lane.force, lane.state))
                )

    def _figure(self, cast: Cast, lane: Lane) -> None:
        """What stays the same: shapes, names, masses."""
        member, figure = lane.member, lane.figure
        name, title = estimator_of(member.name), [(0.25, lane.top)]
        self.pen.labels(path("motion", name, "title"), title, [cast.label(member.name)], cast.color(member.name))
        for body, mass in zip(member.bodies, member.masses):
            if body not in figure.columns:
                continue
            half, plate = half_size(figure, body, mass), mass is None
            color = PLATE if plate else BODY
            label = body if plate else f"{body}, {mass:.4g} kg"
            root = path("motion", name, "body", body)
            self.pen.static(f"{root}/fill", shapes.filled(half, color))
            self.pen.static(f"{root}/box", rr.Boxes2D(half_sizes=[half], colors=[EDGE], radii=points(0.8)))
            self.pen.labels(f"{root}/label", [(0.0, half[1])], [label], EDGE)
        for spring in member.elements:
            zigzag = rr.LineStrips2D.from_fields(strips=[shapes.zigzag()], radii=[points(1.6)], show_labels=True)
            self.pen.static(path("motion", name, "spring", spring), zigzag)

    def _frames(
        self, cast: Cast, lane: Lane, time_ns: np.ndarray, crush: np.ndarray, force: np.ndarray, state: np.ndarray
    ) -> None:
        member, figure, scale = lane.member, lane.figure, self.scale
        name, before = estimator_of(member.name), self._before(cast, lane, time_ns)
        time_ns = time_ns + self.drawn_again
        shift = REST * crush @ lane.positions.T / scale.length  # (frames, bodies)
        at = {}
        for k, (body, mass) in enumerate(zip(member.bodies, member.masses)):
            if body not in figure.columns:
                continue
            x = figure.columns[body] * PITCH + shift[:, k]
            y = row_y(lane.top, sum(figure.heights[body]) / 2)
            at[body] = (x, half_size(figure, body, mass)[0])
            place = rr.Transform3D.columns(translation=np.column_stack([x, np.full_like(x, y), np.zeros_like(x)]))
            self.pen.columns(path("motion", name, "body", body), time_ns, place)
            low, high = self.reach
            self.reach = min(low, float(np.min(x)) - at[body][1]), max(high, float(np.max(x)) + at[body][1])
        colors = shapes.force_colors(force / scale.force, state == ElementState.APART)
        for k, (spring, (a, b)) in enumerate(zip(member.elements, member.between)):
            entity = path("motion", name, "spring", spring)
            left, right = at[a][0] + at[a][1], at[b][0] - at[b][1]
            ones = np.ones_like(left)
            start = np.column_stack([left, row_y(lane.top, figure.rows[k]) * ones, 0 * ones])
            stretch = np.column_stack([right - left, ones, ones])
            labels = [self._force_text(cast, f, s) for f, s in zip(force[:, k], state[:, k])]
            if spring in before:
                was = [self._force_text(cast, *one) for one in before[spring]]
                labels = [now if now == then else f"{now}, was {then}" for now, then in zip(labels, was)]
            place = rr.Transform3D.columns(translation=start, scale=stretch)
            self.pen.columns(entity, time_ns, [*place, *rr.LineStrips2D.columns(colors=colors[:, k], labels=labels)])

    def _before(self, cast: Cast, lane: Lane, time_ns: np.ndarray) -> dict[str, list[tuple[float, int]]]:
        """Force and state of each spring at these times by the revision before; none where there is none."""
        old = self.lanes.get(cast.before(lane.member.name) or "")
        if old is None or not old.time_ns:
            return {}
        times, force, state = (np.concatenate(rows) for rows in (old.time_ns, old.force, old.state))
        rows = np.minimum(np.searchsorted(times, time_ns), len(times) - 1)
        springs = enumerate(old.member.elements)
        return {spring: list(zip(force[rows, k].tolist(), state[rows, k].tolist())) for k, spring in springs}

    def _force_text(self, cast: Cast, force: float, state: int) -> str:
        if state == ElementState.APART:
            return "apart"
        unit, factor = cast.shown("N")
        return f"{text(force * factor, self.scale.force * factor / 100)} {unit}"


def _expected_crush(cast: Cast, block: ForceBlock) -> float:
    """A first guess of the length scale, m: the closing speed for part of the recording, at most a crash's 50 ms."""
    speed = np.nan_to_num(block.velocity[0])
    at = {body: float(v) for body, v in zip(block.body, speed, strict=True)}
    closing = max(abs(at[a] - at[b]) for a, b in cast.member(block.estimator).between)
    return max(1.25 * closing * min(0.05, 0.3 * cast.span[1]), 0.02)


def _lane(member: Member) -> Lane:
    figure = schematic(member.between)
    difference = np.array([[(k == a) - (k == b) for k in member.bodies] for a, b in member.between], dtype=float)
    positions = np.linalg.pinv(difference)  # least squares, for crushes measured rather than integrated
    positions -= positions[member.bodies.index(figure.reference)]
    return Lane(member, figure, 0.0, positions)


def motion_view(cast: Cast) -> rrb.View:
    columns = max((schematic(m.between).last_column for m in cast.members if m.elements), default=1)
    left, right = cast.reach
    bounds = rrb.VisualBounds2D(
        x_range=[min(-0.5, left - 0.2), max(columns * PITCH + 0.35, 2.95, right + 0.1)],
        y_range=[-0.05, shapes.lanes_height(cast) + shapes.LEGEND_ROOM],
    )
    return rrb.Spatial2DView(
        origin="motion",
        name=f"moving masses, springs coloured by force, {cast.shown('N').unit}",
        visual_bounds=bounds,
    )
