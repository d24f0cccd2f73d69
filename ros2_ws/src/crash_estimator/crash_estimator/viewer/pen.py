"""Writing to one Rerun recording: columns of samples at once, styles once."""

from collections.abc import Callable, Sequence

import numpy as np
import rerun as rr

from .cast import Color

TIMELINE = "crash_time"
"""Duration, seconds since the impact."""


def path(*parts: str) -> str:
    """An entity path; what a name holds besides letters, digits, - _ and . is escaped."""
    return str(rr.new_entity_path(list(parts)))


def points(ui_points: float) -> rr.components.Radius:
    """A line's radius or a point's in pixels of the screen, whatever the zoom."""
    return rr.Radius.ui_points(ui_points)


class Pen:
    """One recording, and which of its entities have their style already."""

    def __init__(self, recording: rr.RecordingStream):
        self.recording = recording
        self._styled: set[str] = set()

    def restyle(self) -> None:
        """Styles are written again at the next use: names or colours have changed."""
        self._styled.clear()

    def once(self, entity: str, style: Callable[[], rr.AsComponents]) -> None:
        """Static data, made and written at the first call for this entity only."""
        if entity not in self._styled:
            self._styled.add(entity)
            self.static(entity, style())

    def static(self, entity: str, archetype: rr.AsComponents) -> None:
        """Data for all times; a later call takes the place of an earlier one."""
        self.recording.log(entity, archetype, static=True)

    def columns(self, entity: str, time_ns: np.ndarray, columns) -> None:
        """n rows at n times."""
        time = np.asarray(time_ns, dtype=np.int64).view("timedelta64[ns]")
        self.recording.send_columns(entity, [rr.TimeColumn(TIMELINE, duration=time)], columns)

    def curve(
        self, entity: str, time_ns: np.ndarray, values: np.ndarray, name: str, color: Color, width: float
    ) -> None:
        """A line in a time plot; NaN leaves a gap."""
        self.once(
            entity, lambda: rr.SeriesLines(colors=[color], names=[name], widths=[width], aggregation_policy="MinMax")
        )
        self.columns(entity, time_ns, rr.Scalars.columns(scalars=values))

    def band(
        self,
        entity: str,
        time_ns: np.ndarray,
        center: np.ndarray,
        half_width: np.ndarray,
        name: str,
        color: Color,
        width: float,
    ) -> None:
        """A line with a translucent band around it; the axis fits the line, so that a wide band never squashes it."""
        self.once(
            entity,
            lambda: rr.Measurements.from_fields(
                colors=[color], names=[name], widths=[width], aggregation_policy="MinMax"
            ),
        )
        self.columns(entity, time_ns, rr.Measurements.columns(values=center, variances=half_width**2))

    def labels(self, entity: str, positions: Sequence, texts: Sequence[str], color: Color) -> None:
        """Static text in a drawing, centred just below each position."""
        points_ = rr.Points2D(positions, labels=texts, colors=[color], radii=points(0.01), show_labels=True)
        self.static(entity, points_)
