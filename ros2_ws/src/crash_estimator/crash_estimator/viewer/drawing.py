"""A picture made of lines, bars and texts at one moment, for what Rerun has no plot of. y points up here.

A drawing is logged anew with each change, so that the time cursor shows it as it was.
"""

from collections.abc import Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from .axes import Axis, text
from .colors import GRID, INK, TITLE, Color, Shaded
from .loops import GRID_WIDTH
from .pen import TIMELINE, Pen, points

Point = tuple[float, float]


class Drawing:
    """Collects shapes and texts; `write` logs them together."""

    def __init__(self) -> None:
        self.strips: list[Sequence[Point]] = []
        self.strip_colors: list[Color | Shaded] = []
        self.radii: list[float] = []
        self.at: list[Point] = []
        self.texts: list[str] = []
        self.text_colors: list[Color] = []

    def line(self, strip: Sequence[Point], color: Color | Shaded, width: float = 1.0) -> None:
        """width: of its half, in pixels of the screen."""
        self._strip(strip, color, -width)  # Rerun's sign for pixels

    def bar(self, start: Point, end: Point, color: Color, half_height: float) -> None:
        """A thick line, in units of the drawing."""
        self._strip([start, end], color, half_height)

    def _strip(self, strip: Sequence[Point], color: Color | Shaded, radius: float) -> None:
        self.strips.append([(x, -y) for x, y in strip])
        self.strip_colors.append(color)
        self.radii.append(radius)

    def text(self, at: Point, words: str, color: Color = INK) -> None:
        """Centred at and just below a point."""
        self.at.append((at[0], -at[1]))
        self.texts.append(words)
        self.text_colors.append(color)

    def write(self, pen: Pen, entity: str, time_ns: int | None) -> None:
        """time_ns: from when on it is seen; None: always."""
        if time_ns is not None:
            pen.recording.set_time(TIMELINE, duration=np.timedelta64(time_ns, "ns"))
        labels = rr.Points2D(
            self.at, labels=self.texts, colors=self.text_colors, radii=points(0.01), show_labels=True, draw_order=50.0
        )
        lines = rr.LineStrips2D(self.strips, colors=self.strip_colors, radii=self.radii)
        for part, shapes in (("lines", lines), ("texts", labels)):
            pen.recording.log(f"{entity}/{part}", shapes, static=time_ns is None)


class Frame:
    """Axes from (left, bottom) to (right, top) of a drawing; `at` places data in it."""

    def __init__(self, box: tuple[float, float, float, float], x: Axis, y: Axis):
        self.box, self.x, self.y = box, x, y

    def at(self, x: float, y: float) -> Point:
        left, bottom, right, top = self.box
        across = (x - self.x.low) / (self.x.high - self.x.low)
        up = (y - self.y.low) / (self.y.high - self.y.low)
        return left + across * (right - left), bottom + up * (top - bottom)

    def draw(self, drawing: Drawing, x_title: str = "", y_ticks: bool = True) -> None:
        for value in self.x.ticks:
            drawing.line([self.at(value, self.y.low), self.at(value, self.y.high)], GRID, GRID_WIDTH)
            drawing.text(self.at(value, self.y.low), text(value, self.x.step))
        for value in self.y.ticks if y_ticks else ():
            drawing.line([self.at(self.x.low, value), self.at(self.x.high, value)], GRID, GRID_WIDTH)
            x, y = self.at(self.x.low, value)
            drawing.text((x - 0.085, y + 0.06), text(value, self.y.step))
        if x_title:
            drawing.text(((self.box[0] + self.box[2]) / 2, self.box[1] - 0.09), x_title, TITLE)


def view(origin: str, name: str, width: float, height: float, bottom: float = 0.0) -> rrb.View:
    """Of a drawing from x = 0 to `width` and y = `bottom` to `height`."""
    bounds = rrb.VisualBounds2D(x_range=[0.0, width], y_range=[-height, -bottom])
    return rrb.Spatial2DView(origin=origin, name=name, visual_bounds=bounds)
