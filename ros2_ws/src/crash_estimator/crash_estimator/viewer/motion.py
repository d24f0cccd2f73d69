"""The bodies moving, with springs coloured by their force: one lane for each estimator, all to one scale.

Crush is true to scale: a spring at rest is REST long in the drawing, which stands for `Scale.length` metres. Bodies stand where the crush of their springs puts them, the last one struck stands still.
"""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from ..core.estimate import ElementState
from .axes import round_up, text
from .blocks import ForceBlock
from .cast import Cast, Color, Member
from .frames import frame_ends
from .loops import BACKGROUND, INK
from .pen import Pen, path, points
from .plausible import Limits
from .schematic import Schematic, schematic
from .units import MM

BODY, PLATE = 0.22, 0.07
"""Half the width of a body, and of one that has no mass in the model (driven or fixed)."""
REST = 1.3
"""Length of a spring at rest."""
PITCH = REST + 2 * BODY
ROW, MARGIN = 0.46, 0.12
TITLE_ROOM, LABEL_ROOM, LEGEND_ROOM = 0.2, 0.24, 0.3

BODY_COLOR: Color = (62, 74, 92)
PLATE_COLOR: Color = (70, 70, 72)
EDGE: Color = (150, 165, 190)
APART: Color = (85, 85, 85)
FORCE_COLORS = np.array([(70, 140, 255), (165, 165, 165), (250, 205, 70), (255, 60, 45)], dtype=float)
FORCE_AT = np.array([-1.0, 0.0, 0.45, 1.0])
"""Share of the largest force at which each colour stands: tension is blue, compression yellow to red."""


class Scale(NamedTuple):
    """What the drawing's sizes and colours mean."""

    length: float  # m of crush that would take all of a spring's length
    force: float  # N at the ends of the colour scale


@dataclass
class Lane:
    """One estimator's figure and its frames so far."""

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

    def set_cast(self, cast: Cast) -> None:
        """Make room for all; what has been drawn moves to its new place."""
        before, self.lanes = self.lanes, {}
        for member in cast.members:
            lane = before.get(member.name)
            if lane is None or lane.member != member:
                lane = _lane(member)
            lane.top = sum(_lane_height(m) for m in cast.members[: cast.members.index(member)])
            self.lanes[member.name] = lane
            self._figure(cast, lane)
        if self.scale:
            self._rescale(cast, self.scale)

    def write(self, cast: Cast, block: ForceBlock) -> None:
        lane = self.lanes[block.estimator]
        ends = frame_ends(block.time_ns, cast.span)
        crush, force = (np.nan_to_num(values[ends], posinf=0.0, neginf=0.0) for values in (block.crush, block.force))
        new = (block.time_ns[ends], crush, force, block.state[ends])
        for column, rows in zip((lane.time_ns, lane.crush, lane.force, lane.state), new):
            column.append(rows)
        scale = self._grown(cast, block, crush, force)
        if scale == self.scale:
            self._frames(cast, lane, *new)
        else:
            self._rescale(cast, scale)

    def finish(self, cast: Cast) -> None:
        """Draw everything to the scale of the largest crush, now that it is known."""
        largest = max((float(np.max(np.abs(c))) for lane in self.lanes.values() for c in lane.crush), default=0.0)
        if self.scale and largest > 0:
            self._rescale(cast, self.scale._replace(length=1.25 * largest))

    def _grown(self, cast: Cast, block: ForceBlock, crush: np.ndarray, force: np.ndarray) -> Scale:
        length, strength = self.scale or (_expected_crush(cast, block), 1.0)
        deepest, strongest = float(np.max(np.abs(crush))), min(float(np.max(np.abs(force))), self.limits.force(block))
        if deepest > 0.9 * length:
            length = 1.5 * deepest
        return Scale(length, max(strength, round_up(max(strongest, 1.0))))

    def _rescale(self, cast: Cast, scale: Scale) -> None:
        """Draw all frames again. Each goes 1 ns after its former self, which Rerun shows no longer then."""
        self.scale = scale
        self.drawn_again += 1
        self._legend(cast, scale)
        for lane in self.lanes.values():
            if lane.time_ns:
                self._frames(cast, lane, *(np.concatenate(c) for c in (lane.time_ns, lane.crush, lane.force, lane.state)))

    def _figure(self, cast: Cast, lane: Lane) -> None:
        """What stays the same: shapes, names, masses."""
        member, figure = lane.member, lane.figure
        name = member.name
        title = [(0.25, lane.top)]
        self.pen.labels(path("motion", name, "title"), title, [cast.label(name)], cast.color(name))
        for body, mass in zip(member.bodies, member.masses):
            if body not in figure.columns:
                continue
            half, plate = _half_size(figure, body, mass), mass is None
            color = PLATE_COLOR if plate else BODY_COLOR
            label = body if plate else f"{body}, {mass:.4g} kg"
            root = path("motion", name, "body", body)
            self.pen.static(f"{root}/fill", _filled(half, color))
            self.pen.static(f"{root}/box", rr.Boxes2D(half_sizes=[half], colors=[EDGE], radii=points(0.8)))
            self.pen.labels(f"{root}/label", [(0.0, half[1])], [label], EDGE)
        for spring in member.elements:
            zigzag = rr.LineStrips2D.from_fields(strips=[_zigzag()], radii=[points(1.6)], show_labels=True)
            self.pen.static(path("motion", name, "spring", spring), zigzag)

    def _frames(
        self, cast: Cast, lane: Lane, time_ns: np.ndarray, crush: np.ndarray, force: np.ndarray, state: np.ndarray
    ) -> None:
        member, figure, scale = lane.member, lane.figure, self.scale
        time_ns = time_ns + self.drawn_again
        shift = REST * crush @ lane.positions.T / scale.length  # (frames, bodies)
        at = {}
        for k, (body, mass) in enumerate(zip(member.bodies, member.masses)):
            if body not in figure.columns:
                continue
            x = figure.columns[body] * PITCH + shift[:, k]
            y = _row_y(lane, sum(figure.heights[body]) / 2)
            at[body] = (x, _half_size(figure, body, mass)[0])
            place = rr.Transform3D.columns(translation=np.column_stack([x, np.full_like(x, y), np.zeros_like(x)]))
            self.pen.columns(path("motion", member.name, "body", body), time_ns, place)
        colors = force_colors(force / scale.force, state == ElementState.APART)
        for k, (spring, (a, b)) in enumerate(zip(member.elements, member.between)):
            entity = path("motion", member.name, "spring", spring)
            left, right = at[a][0] + at[a][1], at[b][0] - at[b][1]
            ones = np.ones_like(left)
            start = np.column_stack([left, _row_y(lane, figure.rows[k]) * ones, 0 * ones])
            stretch = np.column_stack([right - left, ones, ones])
            labels = [self._force_text(cast, f, s) for f, s in zip(force[:, k], state[:, k])]
            place = rr.Transform3D.columns(translation=start, scale=stretch)
            self.pen.columns(entity, time_ns, [*place, *rr.LineStrips2D.columns(colors=colors[:, k], labels=labels)])

    def _force_text(self, cast: Cast, force: float, state: int) -> str:
        if state == ElementState.APART:
            return "apart"
        unit, factor = cast.shown("N")
        return f"{text(force * factor, self.scale.force * factor / 100)} {unit}"

    def _legend(self, cast: Cast, scale: Scale) -> None:
        bottom = _height(cast) + 0.08
        shares = np.linspace(-1.0, 1.0, 41)
        x = 1.75 + 0.85 * shares
        bar = [[(a, bottom), (b, bottom)] for a, b in zip(x[:-1], x[1:])]
        colors = force_colors(0.5 * (shares[:-1] + shares[1:]))
        self.pen.static(path("motion", "legend", "force"), rr.LineStrips2D(bar, colors=colors, radii=points(3.0)))
        unit, factor = cast.shown("N")
        end = text(scale.force * factor, scale.force * factor)
        texts = [f"tension −{end} {unit}", "0", f"{end} {unit} compression"]
        at = [(x[0], bottom + 0.01), (x[20], bottom + 0.01), (x[-1], bottom + 0.01)]
        self.pen.labels(path("motion", "legend", "force", "text"), at, texts, INK)
        length = round_up(scale.length / 4) * MM
        drawn = REST * length / MM / scale.length
        ruler = [[(-0.2, bottom), (-0.2 + drawn, bottom)]] + [
            [(u, bottom - 0.03), (u, bottom + 0.03)] for u in (-0.2, -0.2 + drawn)
        ]
        self.pen.static(path("motion", "legend", "length"), rr.LineStrips2D(ruler, colors=[INK], radii=points(0.8)))
        middle = [(-0.2 + drawn / 2, bottom + 0.01)]
        self.pen.labels(path("motion", "legend", "length", "text"), middle, [f"{text(length, length)} mm"], INK)


def force_colors(share: np.ndarray, apart: np.ndarray | bool = False) -> np.ndarray:
    """(..., 3) colours of forces given as shares of the largest one."""
    channels = [np.interp(share, FORCE_AT, FORCE_COLORS[:, k]) for k in range(3)]
    colors = np.stack(channels, axis=-1)
    colors[np.broadcast_to(apart, share.shape)] = APART
    return colors.astype(np.uint8)


def _expected_crush(cast: Cast, block: ForceBlock) -> float:
    """A first guess of the length scale, m: the closing speed for part of the recording, at most a crash's 50 ms."""
    speed = np.nan_to_num(block.velocity[0])
    at = {body: float(v) for body, v in zip(block.body, speed)}
    closing = max(abs(at[a] - at[b]) for a, b in cast.member(block.estimator).between)
    return max(1.25 * closing * min(0.05, 0.3 * cast.span[1]), 0.02)


def _filled(half: tuple[float, float], color: Color) -> rr.LineStrips2D:
    """A filled rectangle of thick lines with round ends: 2D boxes are outlines only."""
    lines = 12
    radius = half[1] / lines
    x, y = half[0] - radius, half[1] - radius
    across = [[(-x, v), (x, v)] for v in np.linspace(-y, y, lines)]
    ends = [[(u, -y), (u, y)] for u in (-x, x)]
    return rr.LineStrips2D(across + ends, colors=[color], radii=1.05 * radius, draw_order=1.0)


def _zigzag(turns: int = 7) -> np.ndarray:
    """A spring from (0, 0) to (1, 0) with straight ends."""
    x = np.linspace(0.12, 0.88, 2 * turns + 1)
    y = 0.06 * np.sin(np.arange(2 * turns + 1) * np.pi / 2)
    return np.vstack([(0, 0), np.column_stack([x, y]), (1, 0)])


def _half_size(figure: Schematic, body: str, mass: float | None) -> tuple[float, float]:
    first, last = figure.heights[body]
    return (PLATE if mass is None else BODY), ROW * (last - first) / 2 + MARGIN


def _row_y(lane: Lane, row: float) -> float:
    return lane.top + TITLE_ROOM + MARGIN + ROW * row


def _lane(member: Member) -> Lane:
    figure = schematic(member.between)
    difference = np.array([[(k == a) - (k == b) for k in member.bodies] for a, b in member.between], dtype=float)
    positions = np.linalg.pinv(difference)  # least squares, for crushes measured rather than integrated
    positions -= positions[member.bodies.index(figure.reference)]
    return Lane(member, figure, 0.0, positions)


def _lane_height(member: Member) -> float:
    return TITLE_ROOM + 2 * MARGIN + ROW * (schematic(member.between).row_count - 1) + LABEL_ROOM


def _height(cast: Cast) -> float:
    return sum(_lane_height(m) for m in cast.members)


def motion_view(cast: Cast) -> rrb.View:
    columns = max((schematic(m.between).last_column for m in cast.members), default=1)
    bounds = rrb.VisualBounds2D(
        x_range=[-0.5, max(columns * PITCH + 0.35, 2.95)], y_range=[-0.05, _height(cast) + LEGEND_ROOM]
    )
    return rrb.Spatial2DView(
        origin="motion",
        name=f"moving masses, springs coloured by force, {cast.shown('N').unit}",
        background=BACKGROUND,
        visual_bounds=bounds,
    )
