"""What a page is made of, before anybody decides whether it becomes HTML or Markdown.

All texts are plain: whoever writes a page escapes them.
"""

from collections.abc import Sequence
from typing import NamedTuple

from .figures import Panel


class Heading(NamedTuple):
    text: str


class Paragraph(NamedTuple):
    text: str


class Bullets(NamedTuple):
    items: Sequence[str]


class Lines(NamedTuple):
    """A terminal table: shown as it is, in letters of one width."""

    text: str


class Table(NamedTuple):
    head: Sequence[str]
    rows: Sequence[Sequence[str]]  # the first column to the left, numbers to the right


class Figure(NamedTuple):
    name: str  # of its file, where it has one
    panels: Sequence[Panel]
    columns: int = 2
    height: float = 2.6  # inches a row


Block = Heading | Paragraph | Bullets | Lines | Table | Figure


class Page(NamedTuple):
    title: str
    blocks: Sequence[Block]
