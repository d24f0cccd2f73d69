"""`coverage`: whether the stated sigmas hold, method by method: docs/coverage.md.

python -m crash_estimator.benchmarks.coverage_page [--seeds 40] [--slow 40] [--first 87000000] [--methods rls,kalman]
    [--to FILE]
"""

import sys
from pathlib import Path

import numpy as np

from crash_replay.fault import guarded
from crash_replay.said import Parser, say

from ..figures import markdown_table, write_markdown
from .coverage import INSTANTS, LEAST_CRUSH, LIMIT, METHODS, NOISES, Row, rows

SLOW = ("gauss_newton", "afmm")
"""Methods that are not compiled: a sample takes a millisecond, all 40 seeds an hour."""

HEAD = f"""# Do the stated sigmas hold?

`make benchmark-coverage`: the share of seeds and instants at which the true parameter lies within {LIMIT:g} stated
standard deviations; 95 % where the sigmas are right. The tests are simulated. Crush is integrated from accelerometers
with {", ".join(f"{n:g}" for n in NOISES)} g of noise, one after the other, and a zero offset that is known from 500
noisy samples before the impact (of `impactor_single` it is measured). Each parameter is looked at {INSTANTS} times,
evenly from {1e3 * LEAST_CRUSH:g} mm of crush (or 30 % of the largest, where that is less) to the end of its element's
loading.

The springs unload and pull as the ready model has it, which for `kalman` knows no unloading lines: a sigma speaks of
the noise and of the errors of the integrated motion, not of what a model has wrong. *Constant* is one stiffness for
each spring, and a model that says so (`shape: constant`). *Drifting* is the curves of the recordings in `bags/`, abrupt
changes included, and the ready models as they are.

Where a method is late by much more than noise, 95 % is all that its sigma promises: the error is then known to be near
the edge, most of the time one and a half sigmas off, to the same side.

What is in a sigma: `core/regressor_errors.py`; [methods.md](methods.md) says what it means for each method.
"""


def page(constant: list[Row], drifting: list[Row], said: str) -> list[str]:
    """The page's lines."""
    lines = [HEAD, said, "", "## Summary", ""]
    head = ("method", "constant: median", "least parameter", "drifting: median", "least parameter")
    methods = [m for m in METHODS if any(row.method == m for row in constant)]
    lines += [markdown_table(head, [(f"`{m}`", *_summary(constant, m), *_summary(drifting, m)) for m in methods])]
    for title, found in (("Constant stiffness", constant), ("Drifting stiffness", drifting)):
        lines += ["", f"## {title}", "", "Share inside, and the median sigma as a share of the true value:", ""]
        names = list(dict.fromkeys((row.model, row.parameter) for row in found))
        cells = {(row.model, row.parameter, row.method): f"{row.inside:.0%}, {row.relative:.2g}" for row in found}
        cell = [(f"{a} {b}", *(cells.get((a, b, m), "") for m in methods)) for a, b in names]
        lines += [markdown_table(("parameter", *methods), cell)]
    return lines


def _summary(found: list[Row], method: str) -> tuple[str, str]:
    of = [row for row in found if row.method == method]
    least = min(of, key=lambda row: row.inside)
    return f"{np.median([row.inside for row in of]):.1%}", f"{least.inside:.1%} ({least.parameter})"


def main() -> None:
    sys.exit(guarded(_command))


def _command() -> None:
    parser = Parser(prog="coverage", description=__doc__.partition(":")[0])
    parser.add_argument("--seeds", type=int, default=40, help="how many for each model")
    parser.add_argument(
        "--first", type=int, default=87_000_000, help="the first seed; development used those below 10000"
    )
    parser.add_argument("--slow", type=int, default=40, help=f"how many for {' and '.join(SLOW)}, at most")
    parser.add_argument("--methods", default=",".join(METHODS), help="with commas between")
    parser.add_argument("--to", type=Path, default=Path("docs/coverage.md"))
    given = parser.parse_args()
    seeds, methods = range(given.first, given.first + given.seeds), given.methods.split(",")
    fewer = seeds[: given.slow]
    constant, drifting = (
        [row for m in methods for row in rows(fewer if m in SLOW else seeds, drifts, [m])] for drifts in (False, True)
    )
    said = f"Seeds {seeds.start} to {seeds.stop - 1}"
    if fewer != seeds:
        said += f"; of {' and '.join(f'`{m}`' for m in methods if m in SLOW)} the first {len(fewer)} of them"
    said += ". Some 400 seeds below 10000 were looked at while it was built, on the same models."
    say(str(write_markdown(given.to, page(constant, drifting, said))))


if __name__ == "__main__":
    main()
