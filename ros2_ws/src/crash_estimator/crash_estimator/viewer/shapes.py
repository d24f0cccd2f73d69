"""Sizes, shapes and colours of the moving masses: bodies, springs, the legend. Units of the drawing; y points down."""

import numpy as np
import rerun as rr

from .axes import round_up, text
from .cast import Cast, Member
from .colors import APART, FORCE_COLORS, INK, Color
from .pen import Pen, path, points
from .schematic import Schematic, schematic
from .units import MM

BODY, PLATE = 0.22, 0.07
"""Half the width of a body, and of one that has no mass in the model (driven or fixed)."""
REST = 1.3
"""Length of a spring at rest."""
PITCH = REST + 2 * BODY
ROW, MARGIN = 0.46, 0.12
TITLE_ROOM, LABEL_ROOM, LEGEND_ROOM = 0.2, 0.24, 0.3

FORCE_AT = np.array([-1.0, 0.0, 0.45, 1.0])
"""Where each of FORCE_COLORS stands: tension is blue, compression yellow to red."""


def force_colors(share: np.ndarray, apart: np.ndarray | bool = False) -> np.ndarray:
    """(..., 3) colours of forces given as shares of the largest one.

    By the square root, so that a tenth of the largest force is not grey: most springs carry less than one of them.
    """
    at = np.sign(share) * np.sqrt(np.abs(share))
    channels = [np.interp(at, FORCE_AT, np.array(FORCE_COLORS, dtype=float)[:, k]) for k in range(3)]
    colors = np.stack(channels, axis=-1)
    colors[np.broadcast_to(apart, share.shape)] = APART
    return colors.astype(np.uint8)


def force_scale(largest: float) -> float:
    """A round number just above the largest force."""
    power = 10.0 ** np.floor(np.log10(largest))
    return float(next(digit * power for digit in (1, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10) if digit * power >= largest))


def filled(half: tuple[float, float], color: Color) -> rr.LineStrips2D:
    """A filled rectangle of thick lines with round ends: 2D boxes are outlines only."""
    lines = 12
    radius = half[1] / lines
    x, y = half[0] - radius, half[1] - radius
    across = [[(-x, v), (x, v)] for v in np.linspace(-y, y, lines)]
    ends = [[(u, -y), (u, y)] for u in (-x, x)]
    return rr.LineStrips2D(across + ends, colors=[color], radii=1.3 * radius, draw_order=1.0)


def zigzag(turns: int = 7) -> np.ndarray:
    """A spring from (0, 0) to (1, 0) with straight ends."""
    x = np.linspace(0.12, 0.88, 2 * turns + 1)
    y = 0.06 * np.sin(np.arange(2 * turns + 1) * np.pi / 2)
    return np.vstack([(0, 0), np.column_stack([x, y]), (1, 0)])


def half_size(figure: Schematic, body: str, mass: float | None) -> tuple[float, float]:
    first, last = figure.heights[body]
    return (PLATE if mass is None else BODY), ROW * (last - first) / 2 + MARGIN


def row_y(top: float, row: float) -> float:
    """Where a row of a lane lies."""
    return top + TITLE_ROOM + MARGIN + ROW * row


def lane_height(member: Member) -> float:
    """Room for one estimator's figure; none where the model has no springs."""
    if not member.elements:
        return 0.0
    return TITLE_ROOM + 2 * MARGIN + ROW * (schematic(member.between).row_count - 1) + LABEL_ROOM


def lanes_height(cast: Cast) -> float:
    return sum(lane_height(m) for m in cast.newest)


def legend(pen: Pen, cast: Cast, length: float, force: float) -> None:
    """What colours and lengths mean: `length` m of crush take all of a spring's length, `force` N are red."""
    bottom = lanes_height(cast) + 0.08
    along = np.linspace(-1.0, 1.0, 41)
    x = 1.75 + 0.85 * along
    bar = [[(a, bottom), (b, bottom)] for a, b in zip(x[:-1], x[1:])]
    middles = 0.5 * (along[:-1] + along[1:])
    colors = force_colors(np.sign(middles) * middles**2)
    pen.static(path("motion", "legend", "force"), rr.LineStrips2D(bar, colors=colors, radii=points(3.0)))
    unit, factor = cast.shown("N")
    end = f"{force * factor:.3g}"
    texts = [f"tension −{end} {unit}", "0", f"{end} {unit} compression"]
    at = [(x[k], bottom + 0.01) for k in (0, 20, 40)]
    pen.labels(path("motion", "legend", "force", "text"), at, texts, INK)
    measure = round_up(length / 4)
    drawn = REST * measure / length
    ruler = [[(-0.2, bottom), (-0.2 + drawn, bottom)]] + [
        [(u, bottom - 0.03), (u, bottom + 0.03)] for u in (-0.2, -0.2 + drawn)
    ]
    pen.static(path("motion", "legend", "length"), rr.LineStrips2D(ruler, colors=[INK], radii=points(0.8)))
    middle = [(-0.2 + drawn / 2, bottom + 0.01)]
    pen.labels(path("motion", "legend", "length", "text"), middle, [f"{text(measure * MM, measure * MM)} mm"], INK)
