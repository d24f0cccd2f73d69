"""`effects`: judge the search for the missing effect on simulated recordings, and write docs/missing-effects.md."""

import argparse
import json
import os
import sys
from pathlib import Path

from crash_replay.fault import guarded
from crash_replay.output import check_outputs
from crash_replay.said import Parser, say

from ..figures import write_markdown
from .effects_judge import WANTED, judge, kind_of
from .effects_page import page
from .effects_plan import FULL, SEEDS, TWO, Case, case_of, plan
from .effects_results import ONE_THREAD, add_options, add_rows, code, in_processes, judged, read
from .effects_time import timed

TIMED = ("coulomb_friction", "viscous_damping", "plastic_unloading", "added_mass", "load_path", "unmodelled_body",
         "channel_delay", "channel_gain", "constant_force", "rate_hardening")  # fmt: skip
"""Hidden in the dummy, one at a time, where the time is taken."""


PAGE = Path("missing-effects.md")


def main() -> None:
    os.environ.update(ONE_THREAD)
    sys.exit(guarded(lambda: _command(_parser().parse_args())))


def _parser() -> Parser:
    parser = Parser(prog="effects", description=__doc__.partition(": ")[2])
    add_options(parser, PAGE, "dummy/clearance")
    parser.add_argument("--seeds-from", type=int, default=SEEDS, metavar="N", help="below the default for development")
    return parser


def _command(arguments: argparse.Namespace) -> None:
    if arguments.case:
        say(json.dumps(judge(case_of(arguments.case)), indent=1))
    else:
        _run(arguments)


def _run(arguments: argparse.Namespace) -> None:
    part = arguments.cases is not None or arguments.like is not None
    to = arguments.to or Path("out" if part else "docs") / PAGE
    check_outputs({"--to": to, "--results": arguments.results}, [])
    if arguments.fresh:
        arguments.results.unlink(missing_ok=True)
    cases = [c for c in plan(arguments.seeds_from)[: arguments.cases] if (arguments.like or "") in c.name]
    times = _timed_cases(arguments.seeds_from, 1 if arguments.cases else len(TIMED))
    done = read(arguments.results)
    if not arguments.page:
        left = [c for c in cases if c.name not in done]
        say(f"{len(cases)} cases, {len(cases) - len(left)} of them in {arguments.results}")
        add_rows(judged(left, arguments.processes), len(left), arguments.results, done, _outcome)
        clocked = [c for c in times if f"time {c.name}" not in done]
        if clocked:  # one after the other, with nothing beside them
            add_rows(in_processes(timed, clocked, 1), len(clocked), arguments.results, done, _outcome)
    rows = [done[c.name] for c in cases if c.name in done]
    timings = [done[f"time {c.name}"] for c in times if f"time {c.name}" in done]
    write_markdown(to, [page(rows, timings, len(cases), code())])
    say(f"{to}: {len(rows)} of {len(cases)} cases")


def _outcome(row: dict) -> str:
    if "time" in row:
        return f"{row['time']['wall']:.2f} s"
    if "not_drawn" in row:
        return row["not_drawn"]
    first = " on ".join(row["ranking"][0]["key"]) if row.get("ranking") else row.get("error", "")
    good = WANTED[kind_of(case_of(row["case"]))](row)
    return f"{row['verdict']}, {first}{'' if good else ' (not right)'}"


def _timed_cases(first_seed: int, count: int) -> list[Case]:
    seed = first_seed + len(plan(first_seed))
    return [Case("dummy", (effect,), 1.0, 1.0, FULL, TWO, seed + n) for n, effect in enumerate(TIMED[:count])]


if __name__ == "__main__":
    main()
