"""docs/fuzz.md: how many spoilt inputs each way in has had, and what became of them."""

from collections.abc import Sequence

from ..figures import markdown_table
from .worker import LONGEST, MOST, Result

HEAD = """# Wrong input

Valid inputs of every kind, each spoilt in a few ways: numbers that are not finite, zero or huge, parts gone, doubled or
swapped, lengths that lie, nesting, bombs, other bytes, pipes and folders in a file's place. They go through the very
functions that commands and nodes take input by. Each is taken, or refused with one printable line by an error of the
project's own; anything else is a failure, as are a warning, more than {seconds:g} s of processor and more than
{most:.0f} MB in all (the process's libraries, a few hundred MB, counted). `make fuzz` makes this page; every failure
it ever found is a test."""


def page(results: Sequence[Result], seed: int) -> str:
    failures = sum(result.failed for result in results)
    counts = f"{len(results)} inputs, seed {seed}, failures {failures}."
    head, rows = ["way in", "inputs", "taken", "refused", "failures", "longest", "most memory"], []
    names = dict.fromkeys(sorted(result.target for result in results))
    for name in names:
        rows.append([name, *_row([result for result in results if result.target == name])])
    rows.append(["all", *_row(results)])
    return "\n\n".join([HEAD.format(seconds=LONGEST, most=MOST / 1e6), counts, markdown_table(head, rows)]) + "\n"


def _row(results: Sequence[Result]) -> list[str]:
    outcomes = [result.outcome for result in results]
    return [
        str(len(results)),
        str(outcomes.count("taken")),
        str(outcomes.count("refused")),
        str(sum(result.failed for result in results)),
        f"{max(result.seconds for result in results):.2f} s",
        f"{max(result.bytes for result in results) / 1e6:.0f} MB",
    ]
