"""One case judged: the model file that lacks the effect and its recordings in, what `diagnose` says of them out."""

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

from crash_replay.recording import Recording, RecordingError
from crash_replay.synthetic.hidden.cases import HiddenCase, draw_case
from crash_replay.synthetic.hidden.outside import OUTSIDE

from ..core.diagnosis import Diagnosis, diagnose
from ..core.structure import ModelError, Structure
from ..model_file import load_model
from .effects_plan import Case

SAME_PLACE = 0.05
"""Of the gap: how far a stop may be from where it closes to count as the gap."""


def drawn(case: Case) -> tuple[HiddenCase, Structure, list[Recording]]:
    """What a case stands for; raises RecordingError where it cannot be drawn."""
    hidden = draw_case(case.structure, case.effects, case.seed, case.size)
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"{case.structure}.model.yaml"
        path.write_text(hidden.model_text, encoding="utf-8")
        structure = load_model(path)
    return hidden, structure, [hidden.record(speed, case.noise, case.rate)[0] for speed in case.speeds]


def judge(case: Case) -> dict:
    """A row of results: the case by its name, what was hidden, what was found, and CPU seconds."""
    row: dict = {"case": case.name}
    try:
        hidden, structure, recordings = drawn(case)
    except RecordingError as error:
        return row | {"not_drawn": str(error)}
    row["hidden"] = [one.described() for one in hidden.hidden]
    start = process_time()
    try:
        found = diagnose(structure, recordings)
    except (ModelError, RecordingError, ArithmeticError, ValueError) as error:  # a failed answer, not a failed run
        return row | {
            "verdict": "error",
            "error": f"{type(error).__name__}: {error}",
            "seconds": process_time() - start,
        }
    return row | {"seconds": process_time() - start} | answer(found)


def answer(found: Diagnosis) -> dict:
    """What a row keeps of it."""
    rms = found.residual_rms
    return {
        "verdict": found.verdict,
        "rms": [rms.before, rms.after, rms.noise_floor],
        "ranking": [
            {
                "key": [r.effect, target_of(r.target)], "evidence": r.evidence, "rivals": list(r.confounded_with),
                "coefficient": r.coefficient, "shape": r.shape,
            }
            for r in found.ranking[:5]
        ],
        "steps": [
            {"key": [s.effect, target_of(s.target)], "coefficient": s.coefficient, "std": s.std, "shape": s.shape}
            for s in found.steps
        ],
        "left": [r.name for r in found.remaining[:3]],
    }  # fmt: skip


def target_of(target: str) -> str:
    """Two bodies in one order: a load path from a to b is one from b to a."""
    return "-".join(sorted(target.split("-")))


def expected(row: dict) -> set[tuple[str, str]]:
    """Effects and targets that were hidden, of the vocabulary."""
    return {(h["effect"], target_of(h["target"])) for h in row["hidden"] if h["effect"] not in OUTSIDE}


def right_first(row: dict) -> bool:
    """One effect was hidden: it, on its target, leads the ranking, and the answer is that something is missing."""
    if not _found(row) or row["verdict"] != "effect_missing":
        return False
    return tuple(row["ranking"][0]["key"]) in expected(row) or a_stop_for_a_gap(row)


def a_stop_for_a_gap(row: dict) -> bool:
    """The same law under its other name: a stop, with no stiffness left below it, where the hidden gap closes."""
    first: dict = row["ranking"][0] if _found(row) else {"key": [""]}
    if first["key"][0] != "bottoming_out":
        return False
    gaps = [h["coefficient"] for h in row["hidden"] if (h["effect"], h["target"]) == ("clearance", first["key"][1])]
    return any(abs(first["shape"]["stop"] / gap - 1.0) < SAME_PLACE for gap in gaps)


def rival_named(row: dict) -> bool:
    """A wrong leader has the right one among those that it cannot be told from."""
    named = [_rival(rival) for rival in row["ranking"][0]["rivals"]] if _found(row) else []
    return any(key in expected(row) for key in named)


def both_found(row: dict) -> bool:
    """All that was hidden was added, in any order, and nothing else."""
    return {tuple(step["key"]) for step in row.get("steps", [])} == expected(row)


def verdict_is(which: str) -> Callable[[dict], bool]:
    return lambda row: row["verdict"] == which


def kind_of(case: Case) -> str:
    """What was hidden: nothing, one or two of the vocabulary, or outside of it."""
    effects = case.effects
    return "nothing" if not effects else "outside" if effects[0] in OUTSIDE else "one" if len(effects) == 1 else "two"


WANTED = {
    "nothing": verdict_is("adequate"),
    "one": right_first,
    "two": both_found,
    "outside": verdict_is("unexplained"),
}
"""Kind -> whether a row is what is asked for."""


def pull(row: dict) -> float | None:
    """(coefficient - true) / std of a right first step."""
    if not right_first(row) or a_stop_for_a_gap(row) or len(row["hidden"]) != 1 or not row["steps"]:
        return None
    step, true = row["steps"][0], row["hidden"][0]["coefficient"]
    return (step["coefficient"] - true) / step["std"] if step["std"] else None


def _found(row: dict) -> bool:
    return bool(row.get("ranking"))


def _rival(name: str) -> tuple[str, str]:
    effect, _, target = name.partition(" on ")
    return effect, target_of(target)
