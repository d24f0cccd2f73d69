"""docs/chaos.md: how often what happened, by use and fault."""

from collections.abc import Sequence

from ..benchmarks.statistics import median
from ..figures import markdown_table
from .case import Case, case_of
from .judge import COMPLETE, FAILED, SAID

HEAD = """# Faults on purpose

`make chaos` disturbs the project's uses while a short recording is replayed: processes are killed, stopped, started again,
their terminals closed, cores and caches taken away. A run must end **complete**, with every estimate and every answer
equal to those of an undisturbed run to the last bit and every exit status 0, or incomplete, **said** in a line that names
who lacks what, with an exit status that is not 0. All else is FAILED: other numbers, silence, a traceback, a wait that
does not end.

A case's name is all that decides it: use, recording, and each fault as `kind:member@moment:duration`, the moment in s since
the member's start, in % of the samples sent, or in s after the last sample."""


def page(rows: Sequence[dict], seed: int) -> str:
    counted = f"Seed {seed}, {len(rows)} runs: {_counts(rows)}."
    parts = [HEAD, counted, _table(rows), _failed(rows)]
    return "\n\n".join(part for part in parts if part) + "\n"


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
    return " + ".join(sorted(f"{fault.kind} {fault.member}".strip() for fault in case.faults))


def _failed(rows: Sequence[dict]) -> str:
    failed = [row for row in rows if row["verdict"] == FAILED]
    return "\n".join(f'- {row["why"]}: `make chaos ARGS="--case {row["case"]}"`' for row in failed)
