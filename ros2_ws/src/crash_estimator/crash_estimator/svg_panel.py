"""A panel as SVG text: lines, bands, levels and marks on axes with round numbers. Text goes in escaped."""

from collections.abc import Iterable, Sequence
from html import escape
from typing import Any

import numpy as np

from crash_replay.foreign_text import visible

from .figures import COLOURS, Line, Panel

WIDTH = 460
LEFT, RIGHT, TOP, BOTTOM = 56, 10, 26, 38  # px around the axes
MOST_POINTS = 400
"""Bins of a line: in each its lowest and highest value are drawn, so that no peak is lost."""
TICKS = 5
ROW, LETTER = 13, 5
"""px of a legend: a row's height, and the width of a letter at most."""


def svg_panel(panel: Panel, height: int) -> str:
    x_range, y_range = _ranges(panel)
    right, bottom = WIDTH - RIGHT, height - BOTTOM

    def at(x: Any, y: Any) -> tuple[Any, Any]:
        across = LEFT + (np.asarray(x) - x_range[0]) / (x_range[1] - x_range[0]) * (right - LEFT)
        up = bottom - (np.asarray(y) - y_range[0]) / (y_range[1] - y_range[0]) * (bottom - TOP)
        return across, np.clip(up, -1e4, 1e4)

    colours = _colours(panel.lines)
    legend, rows = _legend(panel.lines, colours, height)
    parts = [f'<svg viewBox="0 0 {WIDTH} {height + ROW * rows}" role="img" aria-label="{_shown(panel.title)}">']
    parts += _axes(panel, x_range, y_range, at, right, bottom)
    inside = f'<rect x="{LEFT}" y="{TOP}" width="{right - LEFT}" height="{bottom - TOP}"/>'
    parts.append(f'<clipPath id="inside{height}">{inside}</clipPath>')
    parts.append(f'<g clip-path="url(#inside{height})">')
    for line, colour in zip(panel.lines, colours):
        if line.spread is not None:
            parts.append(_band(line, colour, at))
    parts += [_line(line, colour, at) for line, colour in zip(panel.lines, colours, strict=False)]
    for value, _ in panel.levels:
        _, y = at(0.0, value)
        parts.append(f'<path class="level" d="M{LEFT} {y:.1f}H{right}"/>')
    for value, _ in panel.marks:
        x, _ = at(value, 0.0)
        parts.append(f'<path class="mark" d="M{x:.1f} {TOP}V{bottom}"/>')
    parts.append("</g>")
    for value, label in panel.levels:
        _, y = at(0.0, value)
        if label and TOP <= y <= bottom:
            parts.append(_text(right - 2, y - 2, label, "end", "small"))
    for value, label in panel.marks:
        if label:
            x, _ = at(value, 0.0)
            parts.append(_text(x + 2, TOP + 9, label, "start", "small"))
    return "".join([*parts, *legend, "</svg>"])


def _colours(lines: Sequence[Line]) -> list[str]:
    rest = iter(COLOURS * (1 + len(lines) // len(COLOURS)))
    return [line.colour or next(rest) for line in lines]


def _ranges(panel: Panel) -> tuple[tuple[float, float], tuple[float, float]]:
    x = _ends(line.x for line in panel.lines)
    with_bands = [line.y if line.spread is None else np.r_[line.y - line.spread, line.y + line.spread]
                  for line in panel.lines]  # fmt: skip
    y = panel.y_range or _ends([*with_bands, np.array([value for value, _ in panel.levels])])
    margin = 0.0 if panel.y_range else 0.04 * (y[1] - y[0])
    return x, (y[0] - margin, y[1] + margin)


def _ends(values: Iterable[np.ndarray]) -> tuple[float, float]:
    every = np.concatenate([np.ravel(np.asarray(v, dtype=float)) for v in values] or [np.zeros(1)])
    every = every[np.isfinite(every)]
    if not len(every):
        return 0.0, 1.0
    low, high = float(every.min()), float(every.max())
    return (low, high) if high > low else (low - 0.5 * (abs(low) or 1.0), high + 0.5 * (abs(high) or 1.0))


def round_ticks(low: float, high: float) -> np.ndarray:
    """Multiples of 1, 2 or 5 times a power of ten, about TICKS of them."""
    rough = (high - low) / TICKS
    power = 10.0 ** np.floor(np.log10(rough))
    step = next(power * factor for factor in (1.0, 2.0, 5.0, 10.0) if power * factor >= rough * 0.999)
    return np.arange(np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9) + 1) * step + 0.0


def _axes(panel: Panel, x_range, y_range, at, right: int, bottom: int) -> list[str]:
    parts = [_text(LEFT, 14, panel.title, "start", "title")]
    for tick in round_ticks(*x_range):
        x, _ = at(tick, y_range[0])
        parts.append(
            f'<path class="grid" d="M{x:.1f} {TOP}V{bottom}"/>{_text(x, bottom + 13, f"{tick:.6g}", "middle")}'
        )
    for tick in round_ticks(*y_range):
        _, y = at(x_range[0], tick)
        parts.append(f'<path class="grid" d="M{LEFT} {y:.1f}H{right}"/>{_text(LEFT - 4, y + 3, f"{tick:.6g}", "end")}')
    parts.append(f'<path class="frame" d="M{LEFT} {TOP}V{bottom}H{right}"/>')
    parts.append(_text((LEFT + right) / 2, bottom + 28, panel.x_label, "middle"))
    middle = (TOP + bottom) / 2
    turned = f'transform="rotate(-90 12 {middle:.0f})"'
    return [*parts, f'<text x="12" y="{middle:.0f}" text-anchor="middle" {turned}>{_shown(panel.y_label)}</text>']


def _text(x: float, y: float, text: str, anchor: str, kind: str = "") -> str:
    style = f' class="{kind}"' if kind else ""
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}"{style}>{_shown(text)}</text>'


def _shown(text: str) -> str:
    return escape(visible(text))


def _legend(lines: Sequence[Line], colours: Sequence[str], top: int) -> tuple[list[str], int]:
    """Below the plot, where no curve is, in as many rows as it takes."""
    parts, x, row = [], LEFT, 0
    for line, colour in zip(lines, colours):
        if line.label:
            width = 24 + LETTER * len(line.label)
            if x > LEFT and x + width > WIDTH:
                x, row = LEFT, row + 1
            y = top + ROW * row + 8
            parts.append(f'<path d="M{x} {y - 3}h12" stroke="{escape(colour)}" stroke-width="2"/>')
            parts.append(_text(x + 16, y, line.label, "start", "small"))
            x += width
    return parts, row + 1 if parts else 0


def thinned(line: Line) -> tuple[np.ndarray, np.ndarray]:
    """Its points, of long lines the lowest and the highest of each bin in the order in which they come."""
    x, y = np.asarray(line.x, dtype=float), np.asarray(line.y, dtype=float)
    if len(x) <= 2 * MOST_POINTS:
        return x, y
    kept = []
    for part in np.array_split(np.arange(len(x)), MOST_POINTS):
        valid = part[np.isfinite(y[part])]
        kept += sorted({valid[np.argmin(y[valid])], valid[np.argmax(y[valid])]}) if len(valid) else [part[0]]
    return x[kept], y[kept]


def _line(line: Line, colour: str, at) -> str:
    x, y = at(*thinned(line))
    if line.style == "o":
        dots = "".join(f"M{a:.1f} {b:.1f}h0" for a, b in zip(x, y) if np.isfinite(a + b))
        return f'<path class="dots" stroke="{escape(colour)}" d="{dots}"/>'
    path, down = [], False
    for a, b in zip(x, y):
        valid = bool(np.isfinite(a + b))
        if valid:
            path.append(f"{'L' if down else 'M'}{a:.1f} {b:.1f}")
        down = valid
    return f'<path class="line" stroke="{escape(colour)}" stroke-width="{line.width:g}" d="{"".join(path)}"/>'


def _band(line: Line, colour: str, at) -> str:
    x, low = thinned(line._replace(y=line.y - line.spread))
    other, high = thinned(line._replace(y=line.y + line.spread))
    valid, also = np.isfinite(low), np.isfinite(high)
    across, up = at(np.r_[x[valid], other[also][::-1]], np.r_[low[valid], high[also][::-1]])
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(across, up))
    return f'<polygon fill="{escape(colour)}" fill-opacity="0.15" points="{points}"/>' if points else ""
