"""`chaos`: disturb the project's uses with kills, stops and the like, and judge what comes of it: docs/chaos.md."""

import argparse
import sys
from collections import Counter
from pathlib import Path

from crash_replay.fault import guarded
from crash_replay.said import say

from ..figures import write_markdown
from .case import case_of
from .judge import FAILED
from .page import FIRST_START, page
from .plan import MEMBERS, plan
from .results import RESULTS, kept, references, rows

RUNS, SEED = 200, 1


def main() -> int:
    parser = argparse.ArgumentParser(prog="chaos", description=__doc__.partition(": ")[2])
    parser.add_argument("--runs", type=int, default=RUNS, metavar="N", help="default %(default)s")
    parser.add_argument("--seed", type=int, default=SEED, metavar="S", help="of the faults, default %(default)s")
    parser.add_argument("--only", metavar="NAME", help="only cases with this in their names, such as stop:replay")
    parser.add_argument("--case", metavar="NAME", help="only this one; no page is written")
    parser.add_argument("--add", action="store_true", help="keep the results that are in --out: the page is of all")
    parser.add_argument("--first-start", action="store_true", help="only the first start of all, on a busy machine")
    parser.add_argument("--jobs", type=int, default=2, metavar="J", help="runs side by side, default %(default)s")
    parser.add_argument("--uses", nargs="+", choices=[*MEMBERS], default=[*MEMBERS], help="default: all")
    parser.add_argument("--out", type=Path, default=Path("out/chaos"), help="for logs and results, default %(default)s")
    parser.add_argument("--to", type=Path, default=Path("docs/chaos.md"), metavar="PAGE.md")
    arguments = parser.parse_args()
    return guarded(lambda: _run(arguments))


def _run(arguments: argparse.Namespace) -> int:
    if name := arguments.case or (FIRST_START if arguments.first_start else ""):
        cases = [case_of(name)]
    else:
        drawn = plan(arguments.seed, arguments.runs, arguments.uses)
        cases = [case for case in drawn if (arguments.only or "") in case.name]
    arguments.out.mkdir(parents=True, exist_ok=True)
    results = arguments.out / RESULTS
    if not arguments.add:
        results.unlink(missing_ok=True)
    found = references(cases, arguments.out, arguments.jobs)
    done = []
    for row in rows(cases, results, found, arguments.jobs, arguments.seed):
        done.append(row)
        what = f"{row['verdict']}, {row['seconds']:g} s {row['why']}"
        say(f"{len(done)}/{len(cases)} {row['case']}: {what}")
    counts = Counter(row["verdict"] for row in done)
    say(", ".join(f"{count} {verdict}" for verdict, count in counts.items()))
    if not (name or arguments.only):
        write_markdown(arguments.to, [page(kept(results))])
    return 1 if counts[FAILED] else 0


if __name__ == "__main__":
    sys.exit(main())
