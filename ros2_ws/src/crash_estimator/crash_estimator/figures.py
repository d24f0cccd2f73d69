"""Figures for pages: panels of lines, drawn to PNG without a display. The only file that knows matplotlib."""

from collections.abc import Sequence
from pathlib import Path
from textwrap import wrap
from typing import NamedTuple

import numpy as np

from crash_replay.output import write_text

from .core.structure import ModelError

COLOURS = ("#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e", "#17becf", "#8c564b")
GREY = "#888888"


class Line(NamedTuple):
    x: np.ndarray
    y: np.ndarray
    label: str = ""
    colour: str = ""  # "": the next one
    style: str = "-"  # matplotlib's; "o" for points only
    width: float = 1.2
    spread: np.ndarray | None = None  # a band of +- this around y


class Panel(NamedTuple):
    title: str
    x_label: str
    y_label: str
    lines: Sequence[Line]
    levels: Sequence[tuple[float, str]] = ()  # horizontal lines: value, label
    marks: Sequence[tuple[float, str]] = ()  # vertical lines: value, label
    y_range: tuple[float, float] | None = None


def draw(path: str | Path, panels: Sequence[Panel], columns: int = 2, height: float = 2.6) -> Path:
    """Draw the panels, `columns` to a row, into the PNG file `path`; the same panels give the same bytes.

    The file belongs to a page's others: its folder is one of `output.written_into`.
    """
    try:
        from matplotlib.figure import Figure  # late: a terminal table needs no drawing library
    except ModuleNotFoundError:
        raise ModelError("figures need matplotlib, which is not installed: run tools/setup") from None
    columns = min(columns, len(panels))
    rows = -(-len(panels) // columns)
    figure = Figure(figsize=(5.2 * columns, height * rows), dpi=100, layout="constrained")
    for k, panel in enumerate(panels):
        _panel(figure.add_subplot(rows, columns, k + 1), panel)
    path = Path(path)
    figure.savefig(path, metadata={"Software": None})
    return path


def _panel(axes, panel: Panel) -> None:
    colours = iter(COLOURS * (1 + len(panel.lines) // len(COLOURS)))
    for line in panel.lines:
        colour = line.colour or next(colours)
        style = dict(linestyle="", marker=".", markersize=2.5) if line.style == "o" else dict(linestyle=line.style)
        axes.plot(line.x, line.y, color=colour, linewidth=line.width, label=_plain(line.label) or None, **style)
        if line.spread is not None:
            axes.fill_between(line.x, line.y - line.spread, line.y + line.spread, color=colour, alpha=0.2, linewidth=0)
    for value, label in panel.levels:
        axes.axhline(value, color=GREY, linewidth=0.7, linestyle="--")
        axes.annotate(
            _plain(label),
            (1.0, value),
            xycoords=("axes fraction", "data"),
            fontsize=6,
            color=GREY,
            ha="right",
            va="bottom",
        )
    for value, label in panel.marks:
        axes.axvline(value, color=GREY, linewidth=0.7, linestyle=":")
        axes.annotate(
            _plain(label),
            (value, 0.98),
            xycoords=("data", "axes fraction"),
            fontsize=6,
            color=GREY,
            rotation=90,
            va="top",
        )
    axes.set_title(_plain(panel.title), fontsize=9, loc="left")
    axes.set_xlabel(panel.x_label, fontsize=8)
    axes.set_ylabel(_plain(panel.y_label), fontsize=8)
    axes.tick_params(labelsize=7)
    axes.grid(True, linewidth=0.3, alpha=0.6)
    if panel.y_range:
        axes.set_ylim(panel.y_range)
    if any(line.label for line in panel.lines):
        axes.legend(fontsize=6.5, frameon=False)


def _plain(text: str) -> str:
    """A name is no formula."""
    return text.replace("$", r"\$")


def markdown_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Columns of numbers to the right, the first one to the left."""
    lines = [head, [":--", *["--:"] * (len(head) - 1)], *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def write_markdown(path: Path, lines: Sequence[str]) -> Path:
    """Write a page, wrapped."""
    write_text(path, wrapped(lines))
    return path


def wrapped(lines: Sequence[str]) -> str:
    """A page whose paragraphs are wrapped at 120 columns; tables, lists, headings and code are left as they are."""
    text, code = [], False
    for line in "\n".join(lines).splitlines():
        code ^= line.startswith("```")
        prose = not code and len(line) > 120 and line[0] not in "|!#-`"
        text += wrap(line, 120, break_long_words=False, break_on_hyphens=False) if prose else [line]
    return "\n".join(text).rstrip() + "\n"
