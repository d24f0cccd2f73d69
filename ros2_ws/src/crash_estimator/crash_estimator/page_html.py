"""A page as one HTML file that needs nothing else: styles and figures are in it, nothing is fetched, nothing runs."""

from html import escape

from crash_replay.foreign_text import visible, visible_lines

from .page_blocks import Block, Bullets, Figure, Heading, Lines, Page, Paragraph, Table
from .svg_panel import svg_panel

STYLE = """
:root { color-scheme: light; }
body { font: 15px/1.5 system-ui, sans-serif; color: #1b1b1b; background: #fff; max-width: 62rem; margin: 2rem auto;
  padding: 0 1rem; }
h1 { font-size: 1.6rem; line-height: 1.2; } h2 { font-size: 1.15rem; margin-top: 2rem; }
p.first { font-size: 1.15rem; border-left: 4px solid #1f77b4; padding-left: .8rem; }
pre { font: 12px/1.35 ui-monospace, monospace; background: #f5f5f5; padding: .6rem; overflow-x: auto; }
table { border-collapse: collapse; font-size: 13px; } td, th { padding: .15rem .7rem; border-bottom: 1px solid #ddd;
  text-align: right; } td:first-child, th:first-child { text-align: left; }
.figure { display: grid; gap: .4rem 1rem; } svg { width: 100%; height: auto; break-inside: avoid; }
svg text { font: 10px system-ui, sans-serif; fill: #333; } svg .title { font-size: 11.5px; font-weight: 600; }
svg .small { font-size: 9px; fill: #555; } svg path { fill: none; } svg .grid { stroke: #e6e6e6; stroke-width: .7; }
svg .frame { stroke: #888; } svg .level, svg .mark { stroke: #888; stroke-dasharray: 4 3; }
svg .dots { stroke-width: 2.5; stroke-linecap: round; } svg .line { stroke-linejoin: round; }
@media (max-width: 45rem) { .figure { grid-template-columns: 1fr !important; } }
@media print { body { font-size: 10pt; max-width: none; margin: 0; } pre { font-size: 7pt; white-space: pre-wrap; }
  h2 { break-after: avoid; } @page { size: A4; margin: 15mm; } }
"""
POLICY = "default-src 'none'; style-src 'unsafe-inline'"
"""Whatever a recording's texts may hold, the browser loads and runs nothing."""
PIXELS_PER_INCH = 88


def html_page(page: Page) -> str:
    title = _text(page.title)
    first = True
    body = []
    for block in page.blocks:
        if isinstance(block, Paragraph) and first:
            first = False
            body.append(f'<p class="first">{_text(block.text)}</p>')
        else:
            body.append(_block(block))
    head = f'<meta charset="utf-8"><meta http-equiv="Content-Security-Policy" content="{POLICY}">'
    head += '<meta name="viewport" content="width=device-width">'
    head += f"<title>{title}</title><style>{STYLE}</style>"
    return (
        f'<!doctype html>\n<html lang="en"><head>{head}</head>\n<body><h1>{title}</h1>\n'
        + "\n".join(body)
        + ("\n</body></html>\n")
    )


def _text(text: str) -> str:
    return escape(visible(text))


def _block(block: Block) -> str:
    match block:
        case Heading(text):
            return f"<h2>{_text(text)}</h2>"
        case Paragraph(text):
            return f"<p>{_text(text)}</p>"
        case Bullets(items):
            return "<ul>" + "".join(f"<li>{_text(item)}</li>" for item in items) + "</ul>"
        case Lines(text):
            return f"<pre>{escape(visible_lines(text))}</pre>"
        case Table(head, rows):
            cells = "".join(f"<th>{_text(cell)}</th>" for cell in head)
            lines = "".join("<tr>" + "".join(f"<td>{_text(cell)}</td>" for cell in row) + "</tr>" for row in rows)
            return f"<table><tr>{cells}</tr>{lines}</table>"
        case Figure(_, panels, columns, height):
            columns = max(1, min(columns, len(panels)))
            drawn = "".join(svg_panel(panel, round(height * PIXELS_PER_INCH)) for panel in panels)
            return f'<div class="figure" style="grid-template-columns: repeat({columns}, 1fr)">{drawn}</div>'
    raise TypeError(f"no block of a page: {block!r}")
