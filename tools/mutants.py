"""What share of one-line mistakes the tests catch: docs/mutants.md.

    tools/env python tools/mutants.py [--mutants 200] [--seed 1] [--only PART] [--minutes 60]

A mutant is a copy of the packages, in out/mutants, with one operator, condition or number changed. The tests that are
named like its module, import it or stand beside it judge it; the first that fails has caught it, and so has one that
takes much longer than on the code as it is. In core/compiled the readable form judges: numba is off
(NUMBA_DISABLE_JIT), the recursion runs as Python beside its readable twin, and nothing is compiled anew.
"""

import argparse
import ast
import os
import random
import re
import shutil
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent
SOURCES, TREE = ROOT / "ros2_ws" / "src", ROOT / "out" / "mutants"
PACKAGES = ("crash_estimator", "crash_replay")
PARTS = {"core": (PACKAGES[0], 0.6), "readers": (PACKAGES[1], 0.25), "nodes": (PACKAGES[0], 0.15)}
"""Folder -> its package, and its share of the mutants: about that of the lines."""
BESIDE = {  # folder -> tests of what it computes that neither bear the name of a module nor import it
    "core/estimators": "core/test_printed_recursions core/test_estimators core/test_zero_offsets core/test_coverage",
    "core/compiled": "core/test_factors core/test_compiled",
    "core/diagnosis": "diagnosis/test_diagnosis_oracles diagnosis/test_diagnosis_propagation diagnosis/test_diagnosis",
    "core/effects": "core/test_effects core/test_effects_in_estimators core/test_effects_of_a_model",
    "core": "core/test_motion_and_contact core/test_estimators core/test_further_parameters core/test_validation",
    "readers": "replay/test_import_isomme replay/test_import_nhtsa replay/test_import_lab replay/test_import_command",
    "nodes": "nodes/test_in_order nodes/test_named_estimates nodes/test_estimator_node nodes/test_diagnosis_node",
}
LONGEST, PATIENCE = 60.0, (30.0, 3.0)  # s that the judges take together; s, and times that, until one takes too long
SIGNS = {ast.Add: "+ -", ast.Sub: "- +", ast.Mult: "* /", ast.Div: "/ *", ast.Pow: "** *", ast.And: "and or",
         ast.Or: "or and", ast.Eq: "== !=", ast.NotEq: "!= ==", ast.Lt: "< >=", ast.LtE: "<= >", ast.Gt: "> <=",
         ast.GtE: ">= <"}  # fmt: skip
BOUNDARY = {"<": "<=", "<=": "<", ">": ">=", ">=": ">"}
"""Beside a whole number: there it is another one; of two measurements it hardly ever is."""
SILENT = re.compile(r"raise |Error\(|say\(|\.info\(|\.warn|help=|f\"|import |@|Allowed\(|TYPE_CHECKING")
"""Lines of messages, declarations and imports: a changed one is no wrong result."""


class Mutant(NamedTuple):
    part: str
    path: Path  # below SOURCES
    line: int
    kind: str
    before: str
    after: str


def mutants_of(part: str, path: Path) -> list[Mutant]:
    """Every one-line change of a file."""
    tree, lines, found, silent = ast.parse(path.read_text()), path.read_text().splitlines(), [], set()
    for node in ast.walk(tree):
        text = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
        if text or isinstance(node, ast.JoinedStr | ast.Raise):
            silent |= set(range(node.lineno, node.end_lineno + 1))
    for node in ast.walk(tree):
        for line, start, stop, new, kind in _changes(node, lines):
            before = lines[line - 1]
            if line not in silent and before.isascii() and not SILENT.search(before):  # columns count bytes
                after = before[:start] + new + before[stop:]
                found.append(Mutant(part, path.relative_to(SOURCES), line, kind, before, after))
    return found


def _changes(node: ast.AST, lines: list[str]) -> list[tuple[int, int, int, str, str]]:
    """(line, first column, last, what stands there instead, of what kind) of one node."""
    if isinstance(node, ast.Constant):
        value, place = node.value, (node.lineno, node.col_offset, node.end_col_offset)
        if isinstance(value, bool):
            return [(*place, str(not value), "condition")]
        if isinstance(value, int | float) and abs(value) > 1e-9:
            return [(*place, repr(value + 1) if isinstance(value, int) else repr(1.25 * value), "number")]
        return []
    if isinstance(node, ast.BinOp):
        op, left, right = node.op, node.left, node.right
    elif isinstance(node, ast.Compare):
        op, left, right = node.ops[0], node.left, node.comparators[0]
    elif isinstance(node, ast.BoolOp):
        op, left, right = node.op, node.values[0], node.values[1]
    else:
        return []
    if type(op) not in SIGNS or left.end_lineno != right.lineno:
        return []
    old, new = SIGNS[type(op)].split()
    whole = isinstance(right, ast.Constant) and isinstance(right.value, int)
    new = BOUNDARY.get(old, new) if whole else new
    at = lines[right.lineno - 1][left.end_col_offset : right.col_offset].find(old)
    start = left.end_col_offset + at
    kind = "operator" if isinstance(node, ast.BinOp) else "condition"
    return [(right.lineno, start, start + len(old), new, kind)] if at >= 0 else []


def drawn(count: int, seed: int, only: str = "") -> list[Mutant]:
    """As many as asked for, the same for the same seed: of each part its share, one for each line at most."""
    rng, chosen = random.Random(seed), []
    for part, (package, share) in PARTS.items():
        files = sorted((SOURCES / package / package / part).rglob("*.py"))
        every = [m for path in files for m in mutants_of(part, path) if only in str(m.path)]
        rng.shuffle(every)
        chosen += list({(m.path, m.line): m for m in every}.values())[: round(count * share)]
    rng.shuffle(chosen)
    return chosen


def judges(mutant: Mutant) -> list[str]:
    """Files of tests: those that have a word of the module's name, those that import it, those beside it."""
    stem, parent = mutant.path.stem, mutant.path.parent.name
    inner = "/".join(mutant.path.parts[2:])
    tests = sorted((ROOT / "tests").rglob("test_*.py"))
    asked = re.compile(rf"\b{parent}\.{stem} import|\b{parent} import [^\n]*\b{stem}\b")
    importing = [t for t in tests if asked.search(t.read_text())]
    words = {word for word in stem.split("_") if len(word) > 2} - {"nhtsa", "diagnosis", "estimator", "viewer"}
    near = {"readers": "replay", "nodes": "nodes"}.get(mutant.part, "diagnosis" if "/diagnosis/" in inner else "core")
    named = [t for t in tests if t.parent.name == near and words & set(t.stem.split("_"))]
    folder = max((folder for folder in BESIDE if inner.startswith(folder)), key=len)
    beside = [ROOT / "tests" / f"{name}.py" for name in BESIDE[folder].split()]
    return list(dict.fromkeys(str(t.relative_to(ROOT)) for t in [*named, *importing, *beside]))


def judged(tests: list[str], mutant: Mutant, patience: float | None) -> tuple[bool, str, float]:
    """Run the tests on the copy as it stands -> whether one failed, which, and the seconds that it took."""
    path = os.pathsep.join([*(str(TREE / package) for package in PACKAGES), os.environ.get("PYTHONPATH", "")])
    fixed = {"PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1", "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
             "OMP_NUM_THREADS": "1", "NUMBA_CACHE_DIR": str(TREE / "numba")}  # fmt: skip
    off = {"NUMBA_DISABLE_JIT": "1"} if "compiled" in mutant.path.parts else {}
    command = [sys.executable, "-m", "pytest", "-p", "_hypothesis_pytestplugin", "-p", "no:cacheprovider", "-x", "-q",
               "--tb=no", *tests]  # fmt: skip
    start = time.monotonic()
    try:
        done = subprocess.run(
            command, cwd=ROOT, env=os.environ | fixed | off, capture_output=True, text=True, timeout=patience
        )
    except subprocess.TimeoutExpired:
        return True, "took too long", time.monotonic() - start
    failed = re.search(r"^(?:FAILED|ERROR) (\S+)", done.stdout, re.MULTILINE)
    return done.returncode != 0, failed[1] if failed else f"exit {done.returncode}", time.monotonic() - start


def judge(mutants: list[Mutant], minutes: float) -> list[tuple[Mutant, bool]]:
    """One after another until the time is up, by the tests that pass on the code as it is."""
    for package in PACKAGES:
        shutil.rmtree(TREE / package, ignore_errors=True)
        shutil.copytree(SOURCES / package / package, TREE / package / package)
    taken: dict[tuple[str, bool], float] = {}  # s of each file of tests on the code as it is; inf: it fails
    verdicts, end = [], time.monotonic() + 60.0 * minutes
    for k, mutant in enumerate(mutants):
        tests, target, off = [], TREE / mutant.path, "compiled" in mutant.path.parts
        for test in judges(mutant):
            if (test, off) not in taken:
                failed, _, seconds = judged([test], mutant, 4.0 * LONGEST)
                taken[test, off] = float("inf") if failed else seconds
            if sum(taken[t, off] for t in [*tests, test]) <= LONGEST:
                tests.append(test)
        if time.monotonic() > end:
            break
        if not tests:
            print(f"not judged: {mutant.path}: no tests of at most {LONGEST:g} s pass on the code as it is", flush=True)
            continue
        text = target.read_text()
        lines = text.splitlines()
        lines[mutant.line - 1] = mutant.after
        target.write_text("\n".join(lines) + "\n")
        try:
            caught, how, seconds = judged(tests, mutant, PATIENCE[0] + PATIENCE[1] * sum(taken[t, off] for t in tests))
        finally:
            target.write_text(text)
        verdicts.append((mutant, caught))
        said = f"caught by {how}" if caught else "SURVIVED"
        print(f"{k + 1}/{len(mutants)} {mutant.path.name}:{mutant.line} {said}, {seconds:.0f} s", flush=True)
    return verdicts


def page(verdicts: list[tuple[Mutant, bool]], seed: int) -> str:
    rows = []
    for column in ("part", "kind"):
        counts = Counter((getattr(m, column), caught) for m, caught in verdicts)
        for name in dict.fromkeys(name for name, _ in counts):
            n, hit = counts[name, True] + counts[name, False], counts[name, True]
            rows.append(f"| {column}: {name} | {n} | {hit} | {hit / n:.0%} |")
    left = [
        f"- `{'/'.join(m.path.parts[1:])}:{m.line}`: `{m.before.strip()}` -> `{m.after.strip()}`"
        for m, c in verdicts
        if not c
    ]
    hit, n = sum(caught for _, caught in verdicts), max(len(verdicts), 1)
    return PAGE.format(seed=seed, hit=hit, n=n, share=hit / n, rows="\n".join(rows), left="\n".join(left) or "None.")


PAGE = """\
# What share of one-line mistakes the tests catch

Made by `make mutants`, seed {seed}: one operator, condition or number changed in a copy of the packages; the tests that
are named like the module, import it or stand beside it judge, not all of them (`tools/mutants.py`). The compiled
recursion is judged as Python beside its readable twin.

**{hit} of {n} caught, {share:.0%}.**

| | judged | caught | share |
| :-- | --: | --: | --: |
{rows}

Not caught:

{left}
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--mutants", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="part of a path, such as core/estimators")
    parser.add_argument("--minutes", type=float, default=120.0, help="no new one is begun after them")
    parser.add_argument("--to", type=Path, default=ROOT / "docs" / "mutants.md")
    given = parser.parse_args()
    verdicts = judge(drawn(given.mutants, given.seed, given.only), given.minutes)
    given.to.write_text(page(verdicts, given.seed))
    print(f"{given.to}: {sum(caught for _, caught in verdicts)} of {len(verdicts)} caught")


if __name__ == "__main__":
    main()
