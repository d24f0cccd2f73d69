"""The tool behind docs/mutants.md: its mutants are one line each, and judged by tests that there are."""

import ast
import sys
from pathlib import Path

import pytest
from helpers_paths import PACKAGES, ROOT

sys.path.append(str(ROOT / "tools"))
import mutant_judges  # noqa: E402
import mutants  # noqa: E402


def test_a_seed_draws_the_same_of_every_part():
    drawn = mutants.drawn(40, seed=7)
    assert drawn == mutants.drawn(40, seed=7) != mutants.drawn(40, seed=8)
    assert {mutant.part for mutant in drawn} == set(mutants.PARTS)
    assert len({(mutant.path, mutant.line) for mutant in drawn}) == len(drawn) == 40


def test_a_change_elsewhere_leaves_the_draw_as_it_is(tmp_path, monkeypatch):
    """Else what survived before would be judged no more as soon as a test for it has mended a line."""
    monkeypatch.setattr(mutants, "SOURCES", tmp_path)
    monkeypatch.setattr(mutants, "PARTS", {"core": ("a", 1.0)})
    (file := tmp_path / "a" / "a" / "core" / "one.py").parent.mkdir(parents=True)
    lines = [f"    y = x * {n} + {n + 1}" for n in range(50)]
    file.write_text("\n".join(["def f(x):", *lines]))
    before = {mutant.before for mutant in mutants.drawn(20, seed=1)}
    file.write_text("\n".join(["def f(x):", "    z = x - 3", *lines]))
    assert len({mutant.before for mutant in mutants.drawn(20, seed=1)} - before) <= 1


def test_each_changes_one_line_into_code_that_can_be_read():
    for mutant in mutants.drawn(60, seed=3):
        lines = (PACKAGES / mutant.path).read_text().splitlines()
        assert lines[mutant.line - 1] == mutant.before != mutant.after
        lines[mutant.line - 1] = mutant.after
        ast.parse("\n".join(lines))


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("x = a + b", "x = a - b"),
        ("y = a < b", "y = a >= b"),
        ("y = a < 3", "y = a <= 3"),
        ("def limit():\n    return 1.96", "    return 2.45"),
        ("z = a and b", "z = a or b"),
        ("flag = True", "flag = False"),
    ],
)
def test_what_is_changed_into_what(tmp_path, before, after, monkeypatch):
    monkeypatch.setattr(mutants, "SOURCES", tmp_path)
    (tmp_path / "one.py").write_text(before + "\n")
    assert after in [mutant.after for mutant in mutants.mutants_of("core", tmp_path / "one.py")]


@pytest.mark.parametrize(
    ("line", "drawn"),
    [
        ("SHARE = 0.3", False),
        ("EDGES = (0.0, 60.0)", False),
        ("STAGES = (Stage(1.0, ramp=6.0),)", False),
        ("PER_RECORD = (512 - 4) // 4", True),  # calculated
        ("ROBUST = True", True),  # no number
        ("def f(x):\n    return 0.3 * x", True),
    ],
)
def test_a_number_that_was_chosen_is_no_mistake_in_logic(tmp_path, line, drawn, monkeypatch):
    monkeypatch.setattr(mutants, "SOURCES", tmp_path)
    for name, always in (("one.py", False), ("readers/units.py", True)):
        file = tmp_path / name
        file.parent.mkdir(exist_ok=True)
        file.write_text(line + "\n")
        assert bool(mutants.mutants_of("core", file)) == (drawn or always)


def test_messages_and_docstrings_are_left_alone(tmp_path, monkeypatch):
    monkeypatch.setattr(mutants, "SOURCES", tmp_path)
    (tmp_path / "one.py").write_text('"""Of 3 + 4."""\n\n\ndef f(x):\n    """Not 2."""\n    raise ValueError(x + 1)\n')
    assert mutants.mutants_of("core", tmp_path / "one.py") == []


CODE = """\
LIMIT = 3.0


class Ones:
    wide: int = 2

    def far(self, x):
        return x > LIMIT and (
            x
            < 9.0
        )


def near(x, most=1.0):
    return x < most
"""


@pytest.fixture
def code(tmp_path, monkeypatch):
    """A file, and tests of it: one executes `far`, one `near`, each quicker than the one before."""
    inside = tmp_path / "crash_estimator" / "crash_estimator"
    inside.mkdir(parents=True)
    (inside / "one.py").write_text(CODE)
    monkeypatch.setattr(mutant_judges, "SOURCES", tmp_path)
    path = inside.relative_to(tmp_path) / "one.py"
    tests = {
        "test_a.py::test_far": mutant_judges.Test(0.3, {str(path): 1 << 8 | 1 << 10}),
        "test_a.py::test_near": mutant_judges.Test(0.2, {str(path): 1 << 15}),
        "test_b.py::test_other": mutant_judges.Test(0.1, {}),
    }
    yield lambda line: [test.partition("::")[2] for test in mutant_judges.judges(path, line, tests)]
    mutant_judges._place.cache_clear()


@pytest.mark.parametrize(
    ("line", "judged_by"),
    [
        (15, ["test_near", "test_far"]),  # who executes it, then the others of that file
        (9, ["test_far", "test_near"]),  # a line of a statement of several
        (1, ["test_far", "test_near"]),  # a constant: who executes a line with its name, then its file
        (14, ["test_near", "test_far"]),  # what a default says is so in the function
        (5, ["test_near", "test_far"]),  # a field that no line names: its file, quickest first
    ],
)
def test_a_line_is_judged_by_the_tests_that_execute_it(code, line, judged_by):
    assert code(line) == judged_by


def test_the_page_keeps_what_other_seeds_gave():
    mutant = mutants.drawn(5, seed=1)[0]
    of_one = mutants.section([mutants.Verdict(mutant, "")], 1, 200)
    of_two = mutants.section([mutants.Verdict(mutant, "test_x.py::test_y")], 2, 200)
    both = mutants.page(of_two, mutants.page(of_one, ""))
    assert "0 of 1 caught, 0%" in both and "1 of 1 caught, 100%" in both and both.index("Seed 1") < both.index("Seed 2")
    assert mutants.page(of_one, both) == both


def test_only_what_numba_compiles_is_judged_as_python(tmp_path, monkeypatch):
    monkeypatch.setattr(mutant_judges, "SOURCES", tmp_path)
    path = Path("one.py")
    compiled = "@njit(cache=True)\ndef f(x):\n    return x\n\n\n"
    (tmp_path / path).write_text(f"LIMIT = 3\n\n\n\n{compiled}def g(x):\n    return f(x)\n")
    monkeypatch.setattr(mutant_judges, "_compiled", lambda: ({path}, set()))
    assert [mutant_judges.is_plain(path, line) for line in (1, 7, 11)] == [True, True, False]
    mutant_judges._place.cache_clear()
    mutant_judges._is_compiled.cache_clear()
