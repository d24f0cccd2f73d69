"""docs/chaos.md: how often what happened, by use and fault."""

from collections import Counter
from collections.abc import Sequence

from ..benchmarks.statistics import median
from ..figures import markdown_table
from .case import Case, case_of
from .judge import COMPLETE, FAILED, SAID

HEAD = """# Faults on purpose

`make chaos` disturbs the project's uses while a short recording is replayed: processes are killed, stopped,
started again, their terminals closed, disks, cores and caches taken away. A run must end **complete**, with
every estimate, every answer and the recording equal to those of an undisturbed run to the last bit and every
exit status 0, or incomplete, **said** in a line that names who lacks what, with an exit status that is not 0.
All else is FAILED: other numbers, silence, a traceback, a file that mcap's reader does not open, a wait that
does not end.

The uses: `estimators`, a replay, two estimators and `record` in terminals of their own; `terminals`, these and
the diagnosis; `shown`, the estimators and the viewer; `demo`, the demonstration without its viewer;
`demo_shown`, with it; `launch`, what `live.launch.py` describes, with diagnosis and `record`. What the viewer
writes is judged by its exit status alone. launch is not among the wheels: a stand-in of ours starts the
processes of the launch file, calls its handlers when one ends, and ends the others as launch does; `launch`
itself is only stopped, never killed. A full disk is a limit on the size of what a process writes, from that
moment on.

A case's name is all that decides it: use, recording, and each fault as `kind:member@moment:duration`, the
moment in s since the member's start, in % of the samples sent, or in s after the last sample. `make chaos
ARGS="--case NAME"` does it again."""


FIRST_START = "demo/frontal/busy+cold_caches"
"""The demonstration where nothing is compiled yet and eight other processes keep the machine busy."""


def page(rows: Sequence[dict]) -> str:
    firsts = [row for row in rows if row["case"] == FIRST_START]
    rows = [row for row in rows if row["case"] != FIRST_START]
    runs = Counter((row["seed"], row["code"]) for row in rows)
    counted = "Of them: " + "; ".join(
        f"seed {seed}, code {code}: {count} runs" for (seed, code), count in sorted(runs.items())
    )
    idle = sum(bool(row["not carried out"]) for row in rows)
    parts = [HEAD, f"In all {len(rows)} runs: {_counts(rows)}.\n\n{counted}."]
    parts += [f"In {idle} of them a fault found nobody to befall any more: the run was over before its moment."] * bool(
        idle
    )
    parts += [_table(rows), _failed(rows), _first_start(firsts)]
    return "\n\n".join(part for part in parts if part) + "\n"


def _first_start(rows: Sequence[dict]) -> str:
    said = "; ".join(f"{row['verdict']}, {row['seconds']:.0f} s (code {row['code']})" for row in rows)
    what = "The first demonstration of all, nothing compiled yet, beside eight busy processes"
    return f"{what} (`--first-start`): {said}." if rows else ""


def _counts(rows: Sequence[dict]) -> str:
    return ", ".join(f"{sum(row['verdict'] == v for row in rows)} {v}" for v in (COMPLETE, SAID, FAILED))


def _table(rows: Sequence[dict]) -> str:
    groups: dict[tuple[str, str], list[dict]] = {}
    for row in rows:
        case = case_of(row["case"])
        groups.setdefault((case.use, _faults(case)), []).append(row)
    cells = []
    for (use, faults), group in sorted(groups.items()):
        counts = [str(sum(row["verdict"] == v for row in group)) for v in (COMPLETE, SAID, FAILED)]
        cells.append([use, faults, *counts, f"{median([row['seconds'] for row in group]):.0f}"])
    return markdown_table(["use", "faults", COMPLETE, SAID, FAILED, "median s"], cells)


def _faults(case: Case) -> str:
    """The first fault, and whether more came with it."""
    first, *more = case.faults
    return f"{first.kind} {first.member}".strip() + " and more" * bool(more)


def _failed(rows: Sequence[dict]) -> str:
    failed = [row for row in rows if row["verdict"] == FAILED]
    return "\n".join(f"- {row['why']}: `{row['case']}`" for row in failed)
