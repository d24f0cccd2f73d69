"""Runs side by side, each judged by a process of its own, and a file of what came of them."""

import json
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

from crash_replay.fault import Fault, one_line
from crash_replay.starting import begin, held

from .case import Case
from .judge import COMPLETE, FAILED, Content
from .recordings import bag_of
from .run import commit, run_case

RESULTS = "results.jsonl"
"""In the folder of a run's logs: a row of JSON for each case."""


class NoReference(Fault):
    """Undisturbed it is not complete either; the message is one readable line."""


def references(cases: Sequence[Case], out: Path, jobs: int = 1) -> dict[str, dict[str, Content]]:
    """What each use makes of each recording undisturbed, by the name of that case."""
    undisturbed = list(dict.fromkeys(case.undisturbed for case in cases))
    for recording in {case.recording for case in undisturbed}:
        bag_of(recording, out / "recordings")  # not by several at once
    found = {}
    for row in _in_processes(undisturbed, out, {case.name: None for case in undisturbed}, jobs):
        if row["verdict"] != COMPLETE:
            raise NoReference(f"{row['case']}: {row['verdict']}: {row['why']}; its logs are in {out / 'logs'}")
        found[row["case"]] = row["contents"]
    return found


def rows(
    cases: Sequence[Case], results: Path, found: Mapping[str, dict[str, Content]], jobs: int, seed: int
) -> Iterator[dict]:
    """In the order in which they are done; each is added to the file of results."""
    for row in _in_processes(cases, results.parent, found, jobs):
        row |= {"seed": seed}
        with results.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
        yield row


def kept(results: Path) -> list[dict]:
    return [json.loads(line) for line in results.read_text(encoding="utf-8").splitlines()]


def _in_processes(cases, out: Path, found: Mapping, jobs: int) -> Iterator[dict]:
    spawn = get_context("spawn")
    with ProcessPoolExecutor(jobs, mp_context=spawn, max_tasks_per_child=1, initializer=begin) as pool:
        with held():
            tasks = {pool.submit(run_case, case, out, found[case.undisturbed.name]): case for case in cases}
        for task in as_completed(tasks):
            error = task.exception()
            yield not_judged(tasks[task], error) if error else task.result()


def not_judged(case: Case, error: BaseException) -> dict:
    """The row of a case whose judge has failed: the others are judged all the same."""
    why = f"the judge failed: {one_line(repr(error))}"
    nothing = {"carried out": [], "not carried out": [], "statuses": {}, "contradictions": {}, "strangers": []}
    return (
        {"case": case.name, "code": commit(), "verdict": FAILED, "why": why, "seconds": 0.0}
        | nothing
        | {"contents": {}}
    )
