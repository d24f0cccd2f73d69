"""`make benchmark`: every speed that the project promises beside its reference, measured in one run."""

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

from crash_replay.fault import guarded
from crash_replay.output import check_outputs
from crash_replay.said import Parser, say

from ..demo.domain import own_environment
from ..figures import write_markdown
from ..tables import table
from .speed_graph import start_ros
from .speed_growth import growth
from .speed_live import Effort, Live
from .speed_page import renewed_page, whole_page
from .speed_row import HEAD, Row
from .speed_start import starts
from .speed_steps import steps

QUICK = Effort(
    singles=0.1, blocks=0.5, seen=0.5, turns=1, rounds=1, hold=1.0, probe=0.5, rates=(2e3,), latency=200, jitter=0.3,
    lockstep=2,
)  # fmt: skip
PARTS = ("start", "steps", "growth", "throughput", "latency", "jitter", "viewer", "named", "real_time", "lockstep")


def main() -> None:
    sys.exit(guarded(lambda: benchmark(_parser().parse_args())))


def _parser() -> Parser:
    parser = Parser(prog="benchmark", description=__doc__.partition(": ")[2])
    parser.add_argument("--to", metavar="DIR", help="folder of benchmark.md (default: docs; with --quick: out)")
    parser.add_argument("--quick", action="store_true", help="see that it works; the figures say little")
    parser.add_argument("--hold", type=float, default=Effort.hold, help="s that the highest rate must be held")
    parser.add_argument("--only", nargs="*", choices=PARTS, default=PARTS, help="some of the rows; no page is written")
    parser.add_argument("--renew", action="store_true", help="with --only: these rows are put into the page there is")
    return parser


def benchmark(arguments: argparse.Namespace) -> None:
    page_file = Path(arguments.to or ("out" if arguments.quick else "docs")) / "benchmark.md"
    check_outputs({"--to": page_file}, [])
    load, rows, start = os.getloadavg()[0], [], time.monotonic()
    effort = QUICK if arguments.quick else Effort(hold=arguments.hold)
    with tempfile.TemporaryDirectory(prefix="benchmark.") as scratch:
        for title, part in _parts(Path(scratch), effort, arguments):
            print(f"{time.monotonic() - start:5.0f} s  {title}", file=sys.stderr, flush=True)
            rows += part()
    say(table(HEAD, [row.cells() for row in rows]))
    if tuple(arguments.only) == PARTS:
        say(write_markdown(page_file, whole_page(rows, load)))
    elif arguments.renew:
        say(write_markdown(page_file, renewed_page(page_file.read_text(encoding="utf-8"), rows, load)))


def _parts(folder: Path, effort: Effort, arguments) -> Iterator[tuple[str, Callable[[], list[Row]]]]:
    if "start" in arguments.only:
        yield "start", lambda: list(starts(folder, **({"repeats": 1} if arguments.quick else {})))
    if "steps" in arguments.only:
        yield "steps", lambda: list(steps(folder))
    if "growth" in arguments.only:
        shorter: dict[str, Any] = {"seconds": (0.1, 1.0), "parameters": (2, 6)} if arguments.quick else {}
        yield "growth", lambda: list(growth(folder, **shorter))
    live = [name for name in PARTS[3:] if name in arguments.only]
    if not live:
        return
    environment = own_environment()
    os.environ.update(environment)
    start_ros(environment)
    graph = Live(folder, environment, effort)
    for name in live:
        yield name, partial(_rows_of, getattr(graph, name))


def _rows_of(measure: Callable[[], Iterator[Row]]) -> list[Row]:
    return list(measure())


if __name__ == "__main__":
    main()
