"""What each element does (loading, unloading, apart) as coloured lanes, and what happened as a list."""

from collections.abc import Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint.encodings import TimelineColumn

from ..core.estimate import ElementState
from .blocks import EventBlock, ForceBlock
from .cast import Cast
from .pen import TIMELINE, Pen, path

STATES = [state.name.lower() for state in ElementState]
STATE_COLORS = [(190, 75, 50), (50, 110, 190), (75, 75, 75)]  # loading, unloading, apart

LEVELS = {"lost": "ERROR", "dropout": "WARN", "clamped": "WARN", "rewound": "DEBUG"}
"""Rerun colours the list by level; anything else is INFO."""

STRETCH = 0.002
"""s: events of the same kind and target closer than this are one stretch."""


class States:
    """Writes state lanes and events of all estimators into one recording."""

    def __init__(self, pen: Pen):
        self.pen = pen
        self.last: dict[str, int] = {}
        self.listed: dict[tuple[str, str, str], float] = {}  # s, when an event was last seen

    def write(self, cast: Cast, block: ForceBlock) -> None:
        """A lane holds changes only."""
        for k, element in enumerate(block.element):
            lane = path("state", element, block.estimator)
            state = block.state[:, k].astype(int)
            changed = np.flatnonzero(np.diff(state, prepend=self.last.get(lane, -1)))
            self.last[lane] = int(state[-1])
            self.pen.once(lane, lambda: rr.StateConfiguration(values=STATES, colors=STATE_COLORS))
            if len(changed):
                names = [STATES[s] for s in state[changed]]
                self.pen.columns(lane, block.time_ns[changed], rr.StateChange.columns(state=names))

    def write_events(self, cast: Cast, events: Sequence[EventBlock]) -> None:
        by_estimator: dict[str, list[EventBlock]] = {}
        for event in events:
            if not self._repeats(event):
                by_estimator.setdefault(event.estimator, []).append(event)
        for estimator, own in by_estimator.items():
            time_ns = np.array([round(event.time * 1e9) for event in own], dtype=np.int64)
            levels = [LEVELS.get(event.kind, "INFO") for event in own]
            texts = [f"{1e3 * event.time:.1f} ms  {estimator}: {event.text}" for event in own]
            colors = [cast.color(estimator)] * len(own)
            columns = rr.TextLog.columns(text=texts, level=levels, color=colors)
            self.pen.columns(path("event", estimator), time_ns, columns)

    def _repeats(self, event: EventBlock) -> bool:
        """Whether it goes on from what the list says already: only the first of a stretch is news."""
        key = (event.estimator, event.kind, event.target)
        before = self.listed.get(key, -np.inf)
        self.listed[key] = event.time
        return 0.0 <= event.time - before < STRETCH


def state_view(time_view: rrb.TimeAxis | None = None) -> rrb.View:
    return rrb.StateTimelineView(
        origin="state", name="state of each element", time_view=time_view or rrb.TimeAxis(link="LinkToGlobal")
    )


def event_view() -> rrb.View:
    return rrb.TextLogView(
        origin="event",
        name="events",
        columns=rrb.TextLogColumns(
            timeline_columns=[TimelineColumn(TIMELINE, visible=False)],  # too narrow for its digits; the text has it
            text_log_columns=["Body"],
        ),
    )
