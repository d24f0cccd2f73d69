"""Bars that grow with the samples: which effect is missing, and how the error falls with each revision of the model."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import rerun.blueprint as rrb

from .axes import axis_for
from .colors import (
    CONFOUNDED,
    FLOOR,
    INK,
    MEASURED,
    REVISION_COLORS,
    STATE_COLORS,
    TITLE,
    TOLD,
    WEAK,
    Color,
)
from .drawing import Drawing, Frame, view
from .findings import FOUND, Candidate, RankingBlock
from .states import STATES
from .units import Shown, with_std

CANDIDATES = 6
REVISIONS = 5
"""Rows that are shown."""
LEFT, RIGHT = 0.04, 0.8
"""Where the bars begin and where their axis ends; the drawing is 1 wide."""
ROW = 0.14
LINE = 0.065
"""Height of a line of text."""
BELOW = 0.17
"""Room for the axis."""


class Bar(NamedTuple):
    """One row of a bar chart."""

    name: str  # above the bar
    value: float
    label: str  # at the bar's end
    color: Color


def ranking_drawing(block: RankingBlock) -> Drawing:
    """The best candidates with their evidence, and what the colours mean."""
    bars = [
        Bar(
            f"{one.name}: {_coefficient(one)}", max(one.evidence, 0.0),
            f"{_plain(one.evidence)}; {100 * one.explained:.0f} %", color_of(one),
        )
        for one in block.ranking[:CANDIDATES]
    ]  # fmt: skip
    drawing = bar_chart(bars, "evidence, nats; share of the residual explained", rows=CANDIDATES)
    top = ROW * CANDIDATES
    moment = "all samples" if block.final else f"up to {1e3 * block.time:.1f} ms"
    drawing.text((0.5, top + 3.0 * LINE), f"{moment}: {block.said}", TITLE)
    meanings = (("told apart", TOLD), ("a rival fits as well", CONFOUNDED), (f"weak, below {FOUND:g}", WEAK))
    for at, (meaning, color) in zip((0.13, 0.48, 0.84), meanings, strict=False):
        drawing.text((at, top + 1.7 * LINE), meaning, color)
    return drawing


def color_of(one: Candidate) -> Color:
    if one.evidence < FOUND:
        return WEAK
    return CONFOUNDED if one.confounded_with else TOLD


def _plain(value: float) -> str:
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.3g}"


def _coefficient(one: Candidate) -> str:
    known = math.isfinite(one.std) and one.std > 0
    value = with_std(one.coefficient, one.std) if known else f"about {one.coefficient:.3g}"
    return f"{value} {one.unit}"


class Step(NamedTuple):
    """One revision's error."""

    label: str
    rms: float  # m/s^2
    white: bool


def error_drawing(steps: Sequence[Step], floor: float, shown: Shown) -> Drawing:
    """RMS of what each revision leaves, the sensors' noise as a line; and the key to the plots' other colours."""
    bars = [
        Bar(
            f"{k} {step.label}", shown.factor * step.rms,
            f"{shown.factor * step.rms:.3g}{', white' if step.white else ''}", revision_color(k),
        )
        for k, step in enumerate(steps)
    ]  # fmt: skip
    shown_bars = bars[:1] + bars[1:][1 - REVISIONS :]  # the first and the newest
    title = f"RMS residual of this test, {shown.unit}; noise floor {shown.factor * floor:.3g}"
    drawing = bar_chart(shown_bars, title, rows=REVISIONS, line=shown.factor * floor)
    keys = [("measured", MEASURED), *((f"fails {state}", color) for state, color in zip(STATES, STATE_COLORS))]
    for at, (key, color) in zip((0.1, 0.34, 0.62, 0.88), keys):
        drawing.text((at, ROW * REVISIONS + 1.5 * LINE), key, color)
    return drawing


def revision_color(revision: int) -> Color:
    return REVISION_COLORS[revision if revision < len(REVISION_COLORS) else 1 + (revision - 1) % 4]


def bar_chart(bars: Sequence[Bar], axis_title: str, rows: int, line: float | None = None) -> Drawing:
    """Horizontal bars from the top, each below its name; `line` marks a value across all rows."""
    drawing = Drawing()
    axis = axis_for(0.0, max([bar.value for bar in bars] + [line or 0.0, 1e-9]), intervals=4)
    height = ROW * rows
    frame = Frame((LEFT, 0.0, RIGHT, height), axis, axis_for(0.0, 1.0))
    frame.draw(drawing, axis_title, y_ticks=False)
    drawing.line([frame.at(0.0, 0.0), frame.at(0.0, 1.0)], INK, 0.6)
    if line is not None:
        drawing.line([frame.at(line, 0.0), frame.at(line, 1.0)], FLOOR, 0.8)
    for k, bar in enumerate(bars):
        y = height - ROW * (k + 0.75)
        end = frame.at(min(bar.value, axis.high), 0.0)[0]
        drawing.bar((LEFT + 0.02, y), (max(end - 0.02, LEFT + 0.0201), y), bar.color, 0.02)
        drawing.text((end + 0.04 + 0.0095 * len(bar.label), y + LINE / 2), bar.label, bar.color)
        drawing.text((0.46, y + 0.02 + LINE), bar.name, TITLE if k == 0 else INK)
    return drawing


def ranking_path(revision: int) -> str:
    return f"ranking/{revision}"


def ranking_view(revision: int) -> rrb.View:
    name = f"what is missing after {revision}" if revision else "which effect is missing"
    return view(ranking_path(revision), name, 1.0, ROW * CANDIDATES + 3.2 * LINE, -BELOW)


def error_view() -> rrb.View:
    return view("error", "error against revision", 1.0, ROW * REVISIONS + 1.6 * LINE, -BELOW)
