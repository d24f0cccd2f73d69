"""The final answer in about ten lines: where the model fails most, what may be missing, the errors of all revisions."""

from importlib import import_module
from pkgutil import iter_modules
from types import SimpleNamespace

import pytest

import crash_estimator.nodes
from crash_estimator.nodes.diagnosis_story import Told, story
from crash_replay.gravity import G


def window(body: str, start: float, end: float, rms: float) -> SimpleNamespace:
    return SimpleNamespace(body=body, state="loading", start=start, end=end, rms=rms * G)


def candidate(name: str, rivals: tuple[str, ...] = ()) -> SimpleNamespace:
    return SimpleNamespace(
        name=name, coefficient=1810.0, std=190.0, unit="N", evidence=60.0, explained=0.5, confounded_with=rivals
    )


def told(name: str, white: bool, found: bool, **more) -> Told:
    pair = SimpleNamespace(before=4.0 * G)
    answer = dict(text="one line", misfit=(), ranking=(), found=found, rms=pair, free_run=pair, noise_floor=G)
    return Told(name, SimpleNamespace(**answer | {"white": [SimpleNamespace(white=white)]} | more))


def test_the_worst_windows_are_told_in_their_order():
    """What lasts counts more: the squares of a residual add up over time."""
    short, long, little = window("a", 0.03, 0.031, 3.0), window("b", 0.01, 0.02, 2.0), window("c", 0.0, 0.01, 1.5)
    lines = story([told("model", False, False, misfit=(little, short, long))])
    assert [line.split()[2].rstrip(",") for line in lines if "fails at" in line] == ["c", "b"]
    assert "fails at b, loading, 10.0 to 20.0 ms: residual RMS 2 g" in "\n".join(lines)


@pytest.mark.parametrize("found", [True, False])
def test_candidates_are_told_where_something_is_missing(found):
    ranking = [candidate(f"effect {k}", ("rival",) * (k == 1)) for k in range(9)]
    lines = story([told("before", False, True), told("model", True, found, ranking=ranking)])
    numbered = [line for line in lines if line.strip()[1:3] == ". "]
    assert [line.split(":")[0].strip() for line in numbered] == [f"{k + 1}. effect {k}" for k in range(3)] * found
    assert not found or [", not told from rival" in line for line in numbered] == [False, True, False]
    assert lines[0] == "model: one line" and lines[-2].startswith("  error of before: fit 4, free run 4 g")
    assert [line.rpartition(" is ")[2] for line in lines[-2:]] == ["not white", "white"]


@pytest.mark.parametrize("name", sorted(module.name for module in iter_modules(crash_estimator.nodes.__path__)))
def test_what_is_imported_does_not_run(name):
    import_module(f"crash_estimator.nodes.{name}")
