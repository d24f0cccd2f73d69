"""A page as Markdown, its figures as PNG files beside it."""

from pathlib import Path

from crash_replay.foreign_text import code_block, markdown, markdown_cells

from .figures import draw, markdown_table, wrapped
from .page_blocks import Block, Bullets, Figure, Heading, Lines, Page, Paragraph, Table


def write_markdown_page(page: Page, folder: Path) -> None:
    """Write `report.md` and its figures; the folder is one of `output.written_into`."""
    lines = [f"# {markdown(page.title)}", ""]
    for block in page.blocks:
        lines += [_block(block, folder), ""]
    (folder / "report.md").write_text(wrapped(lines), encoding="utf-8")


def _block(block: Block, folder: Path) -> str:
    match block:
        case Heading(text):
            return f"## {markdown(text)}"
        case Paragraph(text):
            return markdown(text)
        case Bullets(items):
            return "\n".join(f"- {markdown(item)}" for item in items)
        case Lines(text):
            return code_block(text)
        case Table(head, rows):
            (titles,) = markdown_cells([head])
            return markdown_table(titles, markdown_cells(rows))
        case Figure(name, panels, columns, height):
            draw(folder / f"{name}.png", panels, columns, height)
            return f"![{name}]({name}.png)"
    raise TypeError(f"no block of a page: {block!r}")
