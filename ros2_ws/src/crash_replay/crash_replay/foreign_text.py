"""Text that comes from outside - a recording's, a model's, another node's, a path - is shown, never obeyed.

A terminal obeys control characters, a page obeys its markup. Where text enters (`Test`, `Channel`, `load_yaml`, a
message) and where it is printed (`said.say`, `fault.tell`) it goes through `visible`; in a Markdown page through
`markdown`, or through `code` where it stands as it is.
"""

import re
import unicodedata
from collections.abc import Sequence

MARKUP = re.compile(r"[\\`*\[\]|~$#]|(?<!\w)_|_(?!\w)")
"""What Markdown obeys, beside HTML; an underscore within a name is a letter like any other."""

TAG = re.compile(r"<(?=[A-Za-z/!?])")


def visible(text: object) -> str:
    r"""On one line: what does not print (escape sequences, line ends, marks that turn the direction of writing) as an
    escape such as \x1b, another kind of space as a space."""
    text = str(text)
    return text if text.isprintable() else "".join(map(_shown, text))


def _shown(character: str) -> str:
    if character.isprintable():
        return character
    if unicodedata.category(character) == "Zs":
        return " "
    return character.encode("unicode_escape").decode("ascii")


def visible_lines(text: object) -> str:
    """The same of a text of ours that has several lines."""
    return "\n".join(map(visible, str(text).split("\n")))


def markdown(text: object) -> str:
    """In a Markdown page's prose, headings and cells: reads as it is written."""
    plain = visible(text).replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    return MARKUP.sub(lambda found: "\\" + found[0], plain)


def markdown_cells(rows: Sequence[Sequence[str]]) -> list[list[str]]:
    """The same of a table's rows."""
    return [[markdown(cell) for cell in row] for row in rows]


def code(text: object) -> str:
    """In a Markdown page, within a line, in the letters of code."""
    return f"`{_within_code(visible(text))}`"


def code_block(text: object) -> str:
    """In a Markdown page, lines as they are."""
    return f"```\n{_within_code(visible_lines(text))}\n```"


def _within_code(text: str) -> str:
    """Nothing escapes a backtick there, nor a tag where a reader takes the page for HTML: others that look alike."""
    return TAG.sub("‹", text.replace("`", "'"))
