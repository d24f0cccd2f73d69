"""A run of many cases: its options, and the file of results. A row of JSON for a case is appended as soon as that is
judged, so that a run can be resumed."""

import argparse
import json
import os
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from hashlib import sha256
from multiprocessing import get_context
from pathlib import Path
from time import monotonic

from crash_replay.output import named
from crash_replay.said import say
from crash_replay.starting import begin, held
from crash_replay.synthetic import hidden

from ..core import diagnosis, effects
from . import effects_judge
from .effects_judge import judge
from .effects_plan import Case

ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""For every process: threads on matrices as small as these cost more than they bring."""


def add_options(parser: argparse.ArgumentParser, page: Path, example: str) -> None:
    """Which cases of a plan, and where to; example: a part of a case's name."""
    parser.add_argument("--cases", type=int, metavar="N", help="only the first N of the plan, which is mixed")
    parser.add_argument("--case", metavar="NAME", help="only this one, with its row of results, and write nothing")
    parser.add_argument("--like", metavar="TEXT", help=f"only cases with this in their names, such as {example}")
    results = Path("out") / page.with_suffix(".jsonl")
    parser.add_argument("--results", type=Path, default=results, help="resumed where it exists")
    parser.add_argument("--to", type=Path, metavar="PAGE.md", help=f"default: docs/{page}; of a part: out/{page}")
    parser.add_argument("--processes", type=int, default=os.cpu_count(), metavar="N")
    parser.add_argument("--fresh", action="store_true", help="drop the results there are")
    parser.add_argument("--page", action="store_true", help="judge nothing more, only write the page")


def add_rows(
    rows: Iterable[dict], count: int, results: Path, done: dict[str, dict], outcome: Callable[[dict], str]
) -> None:
    """Take rows into `done` and the file as they come, and say each, with the time that the rest of `count` takes."""
    start = monotonic()
    for n, row in enumerate(rows, 1):
        append(results, row)
        done[row["case"]] = row
        ahead = (monotonic() - start) / n * (count - n) / 60.0
        say(f"{n}/{count}, {ahead:.0f} min to go: {row['case']}: {outcome(row)}")


@cache
def code() -> str:
    """A fingerprint of the search, of the cases and of a row: rows made by other code are not counted.

    The online diagnosis judges no case: it ends in the same search.
    """
    return fingerprint(effects_judge, diagnosis, effects, hidden)


def fingerprint(judge, *packages) -> str:
    """Of a module that judges, and of the packages that it asks and draws from."""
    folders = [Path(package.__file__).parent for package in packages]
    paths = [path for folder in folders for path in sorted(folder.rglob("*.py")) if path.parent.name != "online"]
    digest = sha256()
    for path in (Path(judge.__file__), *paths):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def read(path: Path, mark: str = "") -> dict[str, dict]:
    """Case -> row, of this code, or of that whose fingerprint is `mark`; a last row that was cut off is left out."""
    rows = {}
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
        try:
            row = json.loads(line)
        except json.JSONDecodeError:
            continue
        if row.get("code") == (mark or code()):
            rows[row["case"]] = row
    return rows


def append(path: Path, row: dict) -> None:
    """At the file's end: a log may be cut off, and is read all the same."""
    with named(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        cut_off = path.exists() and path.read_bytes()[-1:] not in (b"", b"\n")
        with path.open("a", encoding="utf-8") as file:
            file.write(("\n" if cut_off else "") + json.dumps(row) + "\n")


def judged(cases: Iterable[Case], processes: int) -> Iterator[dict]:
    """Rows in the order in which they are done; `ONE_THREAD` must be in the environment."""
    yield from in_processes(judge, list(cases), processes)


def in_processes(function: Callable[..., dict], cases: list, processes: int, mark: str = "") -> Iterator[dict]:
    """Fresh processes: each reads its number of threads as it starts. Rows are marked with the code's fingerprint."""
    mark = mark or code()
    with held():
        pool = get_context("spawn").Pool(processes, initializer=begin)
    with pool:
        for row in pool.imap_unordered(function, cases):
            yield row | {"code": mark}
        pool.close()
        pool.join()  # where they are through they end by themselves: told to, they would say that they were interrupted
