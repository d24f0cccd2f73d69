"""A page as one HTML file that needs nothing else: styles and figures are in it, nothing is fetched, nothing runs.

`templates/page.html` is the page; it escapes every text that is put in. Only the SVG of a panel, which escapes its own,
comes as markup.
"""

from collections.abc import Sequence
from functools import cache
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template
from markupsafe import Markup

from crash_replay.foreign_text import visible, visible_lines

from .figures import Panel
from .page_blocks import Block, Bullets, Figure, Heading, Lines, Page, Paragraph, Table
from .svg_panel import svg_panel

TEMPLATES = Path(__file__).with_name("templates")
PIXELS_PER_INCH = 88
KINDS = (Heading, Paragraph, Bullets, Lines, Table, Figure)


def html_page(page: Page) -> str:
    return _template().render(page=page, blocks=_kinds(page.blocks))


def _kinds(blocks: Sequence[Block]) -> list[tuple[str, Block]]:
    """Each block with what the template calls its kind; the first paragraph says what the page is about."""
    for block in blocks:
        if not isinstance(block, KINDS):
            raise TypeError(f"no block of a page: {block!r}")
    first = next((k for k, block in enumerate(blocks) if isinstance(block, Paragraph)), None)
    return [("First" if k == first else type(block).__name__, block) for k, block in enumerate(blocks)]


@cache
def _template() -> Template:
    environment = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {"visible": visible, "visible_lines": visible_lines, "columns": _columns, "svg": _svg}
    return environment.get_template("page.html")


def _columns(figure: Figure) -> int:
    return max(1, min(figure.columns, len(figure.panels)))


def _svg(panel: Panel, inches: float) -> Markup:
    return Markup(svg_panel(panel, round(inches * PIXELS_PER_INCH)))  # noqa: S704 - it escapes what it writes
