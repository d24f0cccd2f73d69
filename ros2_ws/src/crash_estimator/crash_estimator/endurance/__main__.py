"""`endurance`: long runs through every method and every node, and docs/endurance.md about them."""

import argparse
import sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from ..cli.common import guarded
from ..figures import markdown_table, write_markdown
from .methods import METHODS, Endured, endure
from .nodes import Grown, passes_in_a_row, tests_in_a_row

MEGABYTE = 1e6
GROWTH = 0.05
"""Share by which memory may grow after the first tenth: allocators keep what they once had, at most so much of it."""
FEW = 2
"""Open files and threads that may come and go."""


def main() -> int:
    parser = argparse.ArgumentParser(prog="endurance", description=__doc__.partition(": ")[2])
    parser.add_argument("--samples", type=int, default=1_000_000, metavar="N", help="default %(default)s")
    parser.add_argument("--times", type=int, default=500, metavar="N", help="tests, and passes; default %(default)s")
    parser.add_argument("--only", choices=["methods", "tests", "passes"], help="only this part")
    parser.add_argument("--out", type=Path, default=Path("out/endurance"), help="for logs, default %(default)s")
    parser.add_argument("--to", type=Path, default=Path("docs/endurance.md"), metavar="PAGE.md")
    arguments = parser.parse_args()
    return guarded(lambda: _run(arguments))


def _run(arguments: argparse.Namespace) -> int:
    methods, grown = [], []
    if arguments.only in (None, "methods"):
        for method in METHODS:  # each in a fresh process: its memory is its own
            with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
                methods.append(pool.submit(endure, method, arguments.samples).result())
            print(" ".join(method_row(methods[-1])), flush=True)
    for part, function in (("tests", tests_in_a_row), ("passes", passes_in_a_row)):
        if arguments.only in (None, part):
            grown += function(arguments.out, arguments.times)
            for one in grown:
                print(" ".join(node_row(one)), flush=True)
    if arguments.only is None:
        write_markdown(arguments.to, [page(methods, grown)])
    return 0 if all(map(is_sound, methods)) and all(map(is_flat, grown)) else 1


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

`make endurance`: memory after a tenth of the samples, tests or passes, and at the end; a node's with that of the processes
it starts. The covariance P is looked at every 997 samples, scaled to a diagonal of one.

{markdown_table(methods_head, [method_row(one) for one in methods])}

{markdown_table(nodes_head, [node_row(one) for one in grown])}
"""


if __name__ == "__main__":
    sys.exit(main())
