"""docs/benchmark.md: the page of a whole run, and one in which some rows were measured again."""

import os
import platform
import time
from collections.abc import Sequence

from ..figures import markdown_table
from .speed_row import HEAD, Row

ABOUT = """\
# Speed

Made by `make benchmark` on {machine}, {cores} cores, load {load:.1f} before it began; {when}.

Each row is measured beside its reference in the same run, in turns; a ratio holds on another machine, a time does not.
A machine that does other work makes every row worse, those with several processes most. Throughputs are medians of
six passes in turns with the reference's, their ratio is the median of the six ratios. The processor times of
commands are medians of five starts.
"""


def whole_page(rows: Sequence[Row], load: float) -> list[str]:
    """load: of the machine, before it began."""
    here = {"machine": platform.machine(), "cores": os.cpu_count()}
    about = ABOUT.format(**here, load=load, when=time.strftime("%Y-%m-%d"))
    return [about, _table(rows), ""]


def renewed_page(page: str, rows: Sequence[Row], load: float) -> list[str]:
    """The page with these rows in place of those of the same name, new ones at the end of its table."""
    lines, renewed = page.rstrip().splitlines(), set()  # rows of one name are renewed in their order
    for row, line in zip(rows, _table(rows).splitlines()[2:], strict=True):
        places = [k for k, there in enumerate(lines) if there.startswith(f"| {row.what} |") and k not in renewed]
        if places:
            lines[places[0]] = line
            renewed.add(places[0])
        else:
            lines.insert(1 + max(k for k, there in enumerate(lines) if there.startswith("|")), line)
    names = "; ".join(f"*{row.what}*" for row in rows)
    return [*lines, "", f"Measured again on {time.strftime('%Y-%m-%d')}, load {load:.1f} before it began: {names}.", ""]


def _table(rows: Sequence[Row]) -> str:
    return markdown_table(HEAD, [row.cells() for row in rows])
