"""`second`: judge the search for the missing effect on a second simulator's tests, and write
docs/second-generator.md."""

import argparse
import json
import os
import sys
from pathlib import Path

from crash_replay import second_generator
from crash_replay.fault import guarded
from crash_replay.output import check_outputs
from crash_replay.said import Parser, say
from crash_replay.second_generator.cases import case_of
from crash_replay.second_generator.plan import SEEDS, plan

from ..core import diagnosis, effects
from ..figures import write_markdown
from . import second_judge
from .effects_results import ONE_THREAD, add_options, add_rows, fingerprint, in_processes, read
from .second_judge import judge, wanted
from .second_page import page

PAGE = Path("second-generator.md")


def main() -> None:
    os.environ.update(ONE_THREAD)
    sys.exit(guarded(lambda: _command(_parser().parse_args())))


def _parser() -> Parser:
    parser = Parser(prog="second", description=__doc__.partition(": ")[2])
    add_options(parser, PAGE, "side/friction")
    parser.add_argument("--seed", type=int, default=SEEDS, metavar="N", help="the first; not the default: development")
    return parser


def _command(arguments: argparse.Namespace) -> None:
    if arguments.case:
        say(json.dumps(judge(case_of(arguments.case)), indent=1))
    else:
        _run(arguments)


def _run(arguments: argparse.Namespace) -> None:
    part = arguments.cases is not None or arguments.like is not None or arguments.seed != SEEDS
    to = arguments.to or Path("out" if part else "docs") / PAGE
    check_outputs({"--to": to, "--results": arguments.results}, [])
    if arguments.fresh:
        arguments.results.unlink(missing_ok=True)
    mark = fingerprint(second_judge, diagnosis, effects, second_generator)
    cases = [case for case in plan(arguments.seed)[: arguments.cases] if (arguments.like or "") in case.name]
    done = read(arguments.results, mark)
    left = [] if arguments.page else [case for case in cases if case.name not in done]
    say(f"{len(cases)} cases, {sum(case.name in done for case in cases)} of them in {arguments.results}")
    if left:
        add_rows(in_processes(judge, left, arguments.processes, mark), len(left), arguments.results, done, _outcome)
    rows = [done[case.name] for case in cases if case.name in done]
    write_markdown(to, [page(rows, len(cases), mark)])
    say(f"{to}: {len(rows)} of {len(cases)} cases")


def _outcome(row: dict) -> str:
    if "not_drawn" in row:
        return row["not_drawn"]
    first = " on ".join(row["ranking"][0]["key"]) if row.get("ranking") else row.get("error", "")
    return f"{row['verdict']}, {first}{'' if wanted(row) else ' (not right)'}"


if __name__ == "__main__":
    main()
