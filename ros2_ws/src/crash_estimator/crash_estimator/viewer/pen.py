"""Writing to one Rerun recording: columns of samples at once, styles once."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
import rerun as rr

from .blocks import estimator_of, revision_of
from .cast import Cast, Range
from .colors import Color

TIMELINE = "crash_time"
"""Duration, seconds since the impact."""


def path(*parts: str) -> str:
    """An entity path; what a name holds besides letters, digits, - _ and . is escaped."""
    return str(rr.new_entity_path(list(parts)))


def own_path(*parts: str, who: str) -> str:
    """Of what a member says: the later a path in the alphabet, the more in front, so that a newer revision is."""
    return path(*parts, f"revision {revision_of(who):02}" if revision_of(who) else "model", estimator_of(who))


def points(ui_points: float) -> Any:
    """A line's radius or a point's in pixels of the screen, whatever the zoom."""
    return rr.Radius.ui_points(ui_points)


class Look(NamedTuple):
    """How a line looks; `of` a member of the cast it has that one's name and colour, which may change."""

    name: str = ""
    color: Color = (0, 0, 0)
    of: str = ""

    def style(self, cast: Cast, width: float) -> dict:
        name, color = (cast.label(self.of), cast.color(self.of)) if self.of else (self.name, self.color)
        return dict(colors=[color], names=[name], widths=[width], aggregation_policy="MinMax")


Style = Callable[[Cast], rr.AsComponents]
"""How an entity looks among the members that there are."""


class Pen:
    """One recording, the cast of its members, and how its entities look."""

    def __init__(self, recording: rr.RecordingStream):
        self.recording = recording
        self.cast: Cast | None = None
        self._ranges: dict[str, Range] = {}  # of the lines so far
        self._styles: dict[str, Style] = {}

    def set_cast(self, cast: Cast) -> None:
        """Names or colours may have changed."""
        self.cast = cast
        for entity, style in self._styles.items():
            self.static(entity, style(self.cast))

    def once(self, entity: str, style: Style) -> None:
        """Static data, written at the first call for this entity, and again when the cast changes."""
        if entity not in self._styles:
            self._styles[entity] = style
            self.static(entity, style(self.cast))

    def static(self, entity: str, archetype: rr.AsComponents) -> None:
        """Data for all times; a later call takes the place of an earlier one."""
        self.recording.log(entity, archetype, static=True)

    def columns(self, entity: str, time_ns: np.ndarray, columns) -> None:
        """n rows at n times."""
        time = np.asarray(time_ns, dtype=np.int64).view("timedelta64[ns]")
        self.recording.send_columns(entity, [rr.TimeColumn(TIMELINE, duration=time)], columns)

    def curve(self, entity: str, time_ns: np.ndarray, values: np.ndarray, look: Look, width: float) -> None:
        """A line in a time plot; NaN leaves a gap."""
        self.once(entity, lambda cast: rr.SeriesLines(**look.style(cast, width)))
        self.columns(entity, time_ns, rr.Scalars.columns(scalars=values))
        self._grow(entity, values)

    def band(
        self, entity: str, time_ns: np.ndarray, center: np.ndarray, half_width: np.ndarray, look: Look, width: float
    ) -> None:
        """A line with a translucent band around it; the axis fits the line, so that a wide band never squashes it."""
        self.once(entity, lambda cast: rr.Measurements.from_fields(**look.style(cast, width)))
        self.columns(entity, time_ns, rr.Measurements.columns(values=center, variances=half_width**2))
        self._grow(entity, center)

    def _grow(self, entity: str, values: np.ndarray) -> None:
        values = values[np.isfinite(values)]
        low, high = self._ranges.get(entity, (np.inf, -np.inf))
        low, high = float(np.fmin.reduce(values, initial=low)), float(np.fmax.reduce(values, initial=high))
        self._ranges[entity] = low, high

    def range_under(self, origin: str) -> Range:
        """Lowest and highest value of all lines of a plot."""
        own = [range_ for entity, range_ in self._ranges.items() if entity.startswith(f"{origin}/")]
        return min((low for low, _ in own), default=np.inf), max((high for _, high in own), default=-np.inf)

    def labels(self, entity: str, positions: Sequence, texts: Sequence[str], color: Color) -> None:
        """Static text in a drawing, centred just below each position."""
        points_ = rr.Points2D(positions, labels=texts, colors=[color], radii=points(0.01), show_labels=True)
        self.static(entity, points_)
