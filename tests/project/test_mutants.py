"""The tool behind docs/mutants.md: its mutants are one line each, and judged by tests that there are."""

import ast
import importlib.util

import pytest
from helpers_paths import PACKAGES, ROOT

SPEC = importlib.util.spec_from_file_location("mutants", ROOT / "tools" / "mutants.py")
mutants = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(mutants)


def test_a_seed_draws_the_same_of_every_part():
    drawn = mutants.drawn(40, seed=7)
    assert drawn == mutants.drawn(40, seed=7) != mutants.drawn(40, seed=8)
    assert {mutant.part for mutant in drawn} == set(mutants.PARTS)
    assert len({(mutant.path, mutant.line) for mutant in drawn}) == len(drawn) == 40


def test_each_changes_one_line_into_code_that_can_be_read():
    for mutant in mutants.drawn(60, seed=3):
        lines = (PACKAGES / mutant.path).read_text().splitlines()
        assert lines[mutant.line - 1] == mutant.before != mutant.after
        lines[mutant.line - 1] = mutant.after
        ast.parse("\n".join(lines))
        assert mutants.judges(mutant) and all((ROOT / test).exists() for test in mutants.judges(mutant))


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("x = a + b", "x = a - b"),
        ("y = a < b", "y = a >= b"),
        ("y = a < 3", "y = a <= 3"),
        ("LIMIT = 1.96", "LIMIT = 2.45"),
        ("z = a and b", "z = a or b"),
        ("flag = True", "flag = False"),
    ],
)
def test_what_is_changed_into_what(tmp_path, before, after, monkeypatch):
    monkeypatch.setattr(mutants, "SOURCES", tmp_path)
    (tmp_path / "one.py").write_text(before + "\n")
    assert after in [mutant.after for mutant in mutants.mutants_of("core", tmp_path / "one.py")]


def test_messages_and_docstrings_are_left_alone(tmp_path, monkeypatch):
    monkeypatch.setattr(mutants, "SOURCES", tmp_path)
    (tmp_path / "one.py").write_text('"""Of 3 + 4."""\n\n\ndef f(x):\n    """Not 2."""\n    raise ValueError(x + 1)\n')
    assert mutants.mutants_of("core", tmp_path / "one.py") == []
