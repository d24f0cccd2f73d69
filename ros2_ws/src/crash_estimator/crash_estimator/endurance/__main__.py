"""`endurance`: long runs through every method and every node, and docs/endurance.md about them."""

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from crash_replay.fault import guarded
from crash_replay.said import say
from crash_replay.starting import begin, held

from ..figures import markdown_table, write_markdown
from .methods import METHODS, Endured, endure
from .nodes import Grown, Size, passes_in_a_row, tests_in_a_row

PARTS = ["methods", "tests", "passes"]
RESULTS = "results.jsonl"
"""In the folder of results: an array of JSON for each method and each node."""
MEGABYTE = 1e6
GROWTH = 0.05
"""Share by which memory may grow after the first tenth: allocators keep what they once had, at most so much of it."""
FEW = 2
"""Open files and threads that may come and go."""


def main() -> int:
    parser = argparse.ArgumentParser(prog="endurance", description=__doc__.partition(": ")[2])
    parser.add_argument("--samples", type=int, default=1_000_000, metavar="N", help="default %(default)s")
    parser.add_argument("--times", type=int, default=500, metavar="N", help="tests, and passes; default %(default)s")
    parser.add_argument("--only", choices=PARTS, help="only this part; the page keeps what is known of the others")
    parser.add_argument("--methods", nargs="+", choices=METHODS, default=METHODS, help="default: all")
    parser.add_argument(
        "--out", type=Path, default=Path("out/endurance"), help="for logs and results, default %(default)s"
    )
    parser.add_argument("--to", type=Path, default=Path("docs/endurance.md"), metavar="PAGE.md")
    arguments = parser.parse_args()
    return guarded(lambda: _run(arguments))


def _run(arguments: argparse.Namespace) -> int:
    parts = [arguments.only] if arguments.only else PARTS
    arguments.out.mkdir(parents=True, exist_ok=True)
    results, sound = arguments.out / RESULTS, True
    if not arguments.only:
        results.unlink(missing_ok=True)
    for one in _results(parts, arguments):
        with results.open("a", encoding="utf-8") as file:
            file.write(json.dumps(one) + "\n")
        say(" ".join(method_row(one) if isinstance(one, Endured) else node_row(one)))
        sound &= is_sound(one) if isinstance(one, Endured) else is_flat(one)
    write_markdown(arguments.to, [page(*kept(results))])
    return 0 if sound else 1


def _results(parts: Sequence[str], arguments: argparse.Namespace) -> Iterator[Endured | Grown]:
    if "methods" in parts:
        for method in arguments.methods:  # each in a fresh process: its memory is its own
            with ProcessPoolExecutor(1, mp_context=get_context("spawn"), initializer=begin) as pool:
                with held():
                    task = pool.submit(endure, method, arguments.samples)
                yield task.result()
    for part, function in (("tests", tests_in_a_row), ("passes", passes_in_a_row)):
        if part in parts:
            yield from function(arguments.out, arguments.times)


def kept(results: Path) -> tuple[list[Endured], list[Grown]]:
    """What is known of each method and each node: of several results the last."""
    methods, grown = {}, {}
    for line in results.read_text(encoding="utf-8").splitlines():
        row = json.loads(line)
        if len(row) == len(Endured._fields):
            methods[row[0]] = Endured(*row)
        else:
            node, what, times, settled, end = row
            grown[node, what] = Grown(node, what, times, Size(*settled), Size(*end))
    return [methods[name] for name in METHODS if name in methods], list(grown.values())


def is_sound(one: Endured) -> bool:
    return one.finite and one.asymmetry < 1e-9 and one.least_eigenvalue > 0.0 and one.end < (1.0 + GROWTH) * one.settled


def is_flat(one: Grown) -> bool:
    more = [end - settled for settled, end in zip(one.settled[1:], one.end[1:])]
    return one.end.memory < (1.0 + GROWTH) * one.settled.memory and max(more) <= FEW


def method_row(one: Endured) -> list[str]:
    memory = f"{one.settled / MEGABYTE:.1f} -> {one.end / MEGABYTE:.1f}"
    numbers = ["yes" if one.finite else "NO", f"{one.asymmetry:.1g}", f"{one.least_eigenvalue:.2g}", memory]
    return [one.method, f"{one.samples}", *numbers, "yes" if is_sound(one) else "NO"]


def node_row(one: Grown) -> list[str]:
    pairs = [f"{one.settled.memory / MEGABYTE:.1f} -> {one.end.memory / MEGABYTE:.1f}"]
    pairs += [f"{settled} -> {end}" for settled, end in zip(one.settled[1:], one.end[1:])]
    return [one.node, f"{one.times} {one.what}", *pairs, "yes" if is_flat(one) else "NO"]


def page(methods: list[Endured], grown: list[Grown]) -> str:
    methods_head = ["method", "samples", "finite", "asymmetry of P", "least eigenvalue of scaled P", "MB", "sound"]
    nodes_head = ["node", "through", "MB", "open files", "threads", "flat"]
    return f"""# Long runs

`make endurance`: memory after a tenth of the samples, tests or passes, and at the end; a node's with that of the
processes it starts. The covariance P is looked at every 997 samples, scaled to a diagonal of one.

{markdown_table(methods_head, [method_row(one) for one in methods])}

{markdown_table(nodes_head, [node_row(one) for one in grown])}
"""


if __name__ == "__main__":
    sys.exit(main())
