"""One case of the second generator judged. What is right was written in the case before anything was asked."""

from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

from crash_replay.fault import Fault
from crash_replay.output import write_text
from crash_replay.second_generator.cases import Case, CaseError, case_of, drawn
from crash_replay.second_generator.plan import kind_of

from ..core.diagnosis import ADEQUATE, EFFECT_MISSING, diagnose, iterations_made
from ..model_file import load_model
from .effects_judge import SAME_PLACE, answer, target_of


def judge(case: Case) -> dict:
    """A row of results: the case by its name, the right answers, what was found, CPU seconds and iterations."""
    row: dict = {"case": case.name}
    try:
        it = drawn(case)
    except CaseError as error:
        return row | {"not_drawn": str(error)}
    row |= {"right": [list(one) for one in it.right], "gap": it.gap, "seen": it.seen, "target": it.target}
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"{case.structure}.model.yaml"
        write_text(path, it.model_text)
        structure = load_model(path)
    start, made = process_time(), iterations_made()
    try:
        found = diagnose(structure, it.recordings)
    except (Fault, ArithmeticError, ValueError) as error:  # a failed answer, not a failed run
        wrong = {"verdict": "error", "error": f"{type(error).__name__}: {error}"}
        return row | wrong | {"seconds": process_time() - start, "iterations": iterations_made() - made}
    took = {"seconds": process_time() - start, "iterations": iterations_made() - made}
    return row | took | {"complete": found.complete} | answer(found)


def leads(row: dict) -> bool:
    """One of the right answers is first in the ranking, whatever the verdict."""
    if not row.get("ranking"):
        return False
    first = row["ranking"][0]
    return first["key"] in row["right"] or _stop_for_gap(row, first)


def right(row: dict) -> bool:
    """A right answer leads, and the verdict is that it is missing."""
    return row["verdict"] == EFFECT_MISSING and leads(row)


def named_wrong(row: dict) -> bool:
    """Something is named, and it is not what was hidden."""
    return row["verdict"] == EFFECT_MISSING and not leads(row)


def rival_named(row: dict) -> bool:
    """A wrong leader has a right one among those that it is said not to be told from."""
    rivals = [one.partition(" on ") for one in row["ranking"][0]["rivals"]] if row.get("ranking") else []
    return any([effect, target_of(target)] in row["right"] for effect, _, target in rivals)


def _stop_for_gap(row: dict, first: dict) -> bool:
    """A stop, with no stiffness left before it, where the hidden gap closes: the same law."""
    effect, target = first["key"]
    if effect != "bottoming_out" or not row["gap"] or [*row["right"][0]] != ["clearance", target]:
        return False
    return abs(first["shape"]["stop"] / row["gap"] - 1.0) < SAME_PLACE


def wanted(row: dict) -> bool:
    """Whether a row is what is asked of its kind: outside the vocabulary, that nothing is named."""
    kind = kind_of(case_of(row["case"]))
    if kind == "nothing":
        return row["verdict"] == ADEQUATE
    return not named_wrong(row) and row["verdict"] != "error" if kind == "outside" else right(row)
