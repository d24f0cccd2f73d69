"""What each element does (loading, unloading, apart) as coloured lanes, and what happened as a list.

Rerun's own view of states labels its lanes with the paths of entities, so the lanes are a drawing.
"""

from collections.abc import Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint.encodings import TextLogColumn, TimelineColumn

from ..core.estimate import ElementState
from .axes import axis_for, text
from .blocks import EventBlock, ForceBlock
from .cast import Cast, Member
from .colors import GRID, STATE_COLORS
from .drawing import Drawing, view
from .frames import frame_ends
from .loops import GRID_WIDTH
from .pen import TIMELINE, Pen, path, points

STATES = [state.name.lower() for state in ElementState]

LEVELS = {"lost": "ERROR", "dropout": "WARN", "clamped": "WARN", "rewound": "DEBUG"}
"""Severity of an event, by which Rerun colours the list; anything else is INFO."""

STRETCH = 0.002
"""s: events of the same kind and target closer than this are one stretch."""


WIDTH, NAMES = 7.0, 1.3
"""Of the lanes, and of the room for their names; units of the drawing, as the following."""
ROW, BAR, BELOW = 0.13, 0.045, 0.2
"""A row, half a bar, and the room for the time axis."""
MOST_ROWS = 12
"""Beyond it only the newest revisions have lanes."""
READABLE = 0.5
"""Length of a bar from which its state is written on it."""
LANES = "state"


class States:
    """Writes state lanes and events of all estimators into one recording."""

    def __init__(self, pen: Pen):
        self.pen = pen
        self.changes: dict[tuple[str, str], list[tuple[float, int]]] = {}  # s and state, by element and member
        self.until: dict[str, float] = {}  # s, by member
        self.listed: dict[tuple[str, str, str], float] = {}  # s, when an event was last seen
        self.drawn_until = -np.inf

    def write(self, cast: Cast, block: ForceBlock) -> None:
        """A lane holds changes only; the lanes are drawn anew with what is new in them."""
        for k, element in enumerate(block.element):
            changes = self.changes.setdefault((element, block.estimator), [])
            state = block.state[:, k].astype(int)
            changed = np.flatnonzero(np.diff(state, prepend=changes[-1][1] if changes else -1))
            changes += [(float(block.time_ns[row]) * 1e-9, int(state[row])) for row in changed]
        self.until[block.estimator] = float(block.time_ns[-1]) * 1e-9
        self.draw(cast)
        ends = block.time_ns[frame_ends(block.time_ns, cast.span)]
        place = np.zeros((len(ends), 3))
        place[:, 0] = [_across(cast, time) for time in ends * 1e-9]
        self.pen.once(f"{LANES}/now", lambda cast: rr.LineStrips2D(
            [[(0.0, 0.0), (0.0, -_height(cast))]], colors=[GRID], radii=points(0.6), draw_order=60.0
        ))  # fmt: skip
        self.pen.columns(f"{LANES}/now", ends, rr.Transform3D.columns(translation=place))

    def draw(self, cast: Cast) -> None:
        lanes_drawing(cast, self.changes, self.until).write(self.pen, f"{LANES}/lanes", None)

    def write_events(self, events: Sequence[EventBlock]) -> None:
        by_estimator: dict[str, list[EventBlock]] = {}
        for event in events:
            if not self._repeats(event):
                by_estimator.setdefault(event.estimator, []).append(event)
        for estimator, own in by_estimator.items():
            time_ns = np.array([round(event.time * 1e9) for event in own], dtype=np.int64)
            levels = [LEVELS.get(event.kind, "INFO") for event in own]
            texts = [f"{1e3 * event.time:.1f} ms  {estimator}: {event.text}" for event in own]
            columns = rr.TextLog.columns(text=texts, level=levels)
            self.pen.columns(path("event", estimator), time_ns, columns)

    def _repeats(self, event: EventBlock) -> bool:
        """Whether it goes on from what the list says already: only the first of a stretch is news."""
        key = (event.estimator, event.kind, event.target)
        before = self.listed.get(key, -np.inf)
        self.listed[key] = event.time
        return 0.0 <= event.time - before < STRETCH


def lanes(cast: Cast) -> list[tuple[str, Member]]:
    """Rows from the top: each element, and whose it is."""
    every = [(element, m) for element in cast.elements for m in cast.members if element in m.elements]
    return every if len(every) <= MOST_ROWS else [(element, m) for element, m in every if cast.is_newest(m.name)]


def _height(cast: Cast) -> float:
    return ROW * max(len(lanes(cast)), 1)


def _across(cast: Cast, time: float) -> float:
    start, end = shown_span(cast)
    return NAMES + WIDTH * (min(max(time, start), end) - start) / (end - start)


def shown_span(cast: Cast) -> tuple[float, float]:
    """s: from a little before the impact on, as in the time plots."""
    start, end = cast.span
    start = max(start, -0.1 * end) if end > 0 else start
    return start, max(end, start + 1e-6)


def lanes_drawing(
    cast: Cast, changes: dict[tuple[str, str], list[tuple[float, int]]], until: dict[str, float]
) -> Drawing:
    """changes: s and state, by element and member; until: s, by member."""
    drawing, rows, height = Drawing(), lanes(cast), _height(cast)
    several = len(cast.members) > 1
    start, end = (1e3 * time for time in shown_span(cast))
    axis = axis_for(start, end, intervals=10)
    for time in (tick for tick in axis.ticks if start <= tick <= end):
        x = _across(cast, 1e-3 * time)
        drawing.line([(x, -0.02), (x, height)], GRID, GRID_WIDTH)
        drawing.text((x, -0.03), f"{text(time, axis.step)} ms")
    for k, (element, member) in enumerate(rows):
        y = height - ROW * (k + 0.5)
        name = f"{element}, {cast.label(member.name)}" if several else element
        drawing.text((0.5 * NAMES, y + 0.055), name, cast.color(member.name))
        own = changes.get((element, member.name), [])
        for (since, state), (then, _) in zip(own, [*own[1:], (until.get(member.name, -np.inf), -1)]):
            left, right = _across(cast, since), _across(cast, then)
            if right > left:
                drawing.bar((left, y), (right, y), STATE_COLORS[state], BAR)
            if right - left > READABLE:
                drawing.text(((left + right) / 2, y + 0.055), STATES[state], STATE_COLORS[state])
    return drawing


def state_view(cast: Cast) -> rrb.View:
    return view(LANES, "state of each element", NAMES + WIDTH + 0.1, _height(cast), -BELOW)


def event_view() -> rrb.View:
    return rrb.TextLogView(
        origin="event",
        name="events",
        columns=rrb.TextLogColumns(
            timeline_columns=[TimelineColumn(TIMELINE, visible=False)],  # too narrow for its digits; the text has it
            text_log_columns=[TextLogColumn("LogLevel"), TextLogColumn("Body")],
        ),
    )
