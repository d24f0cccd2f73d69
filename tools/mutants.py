"""What share of one-line mistakes the tests catch: docs/mutants.md.

A mutant is a copy of the packages, in out/mutants, with one operator, condition or number changed. The tests that are
named like its module, import it or stand beside it judge it, file by file; the first that fails has caught it. What is
not caught within a time counts as not caught. At the end each test that has caught one must pass on the code as it is;
where it does not, what it has caught counts as not judged. In core/compiled the readable form judges: numba is off
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
MOST_JUDGES, PATIENCE = 4, 120.0  # files of tests, and s for all of them, to catch one
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
    nodes, lines, found = list(ast.walk(ast.parse(path.read_text()))), path.read_text().splitlines(), []
    told = {n for node in nodes if isinstance(node, ast.Raise) for n in range(node.lineno, node.end_lineno + 1)}
    for node in nodes:
        for line, start, stop, new, kind in _changes(node, lines):
            before = lines[line - 1]
            if line not in told and before.isascii() and not SILENT.search(before):  # columns count bytes
                after = before[:start] + new + before[stop:]
                found.append(Mutant(part, path.relative_to(SOURCES), line, kind, before, after))
    return found


def _changes(node: ast.AST, lines: list[str]) -> list[tuple[int, int, int, str, str]]:
    """(line, first column, last, what stands there instead, of what kind) of one node."""
    match node:
        case ast.Constant(value=bool(value)):
            return [(node.lineno, node.col_offset, node.end_col_offset, str(not value), "condition")]
        case ast.Constant(value=int(value) | float(value)) if abs(value) > 1e-9:
            new = repr(value + 1) if isinstance(value, int) else repr(1.25 * value)
            return [(node.lineno, node.col_offset, node.end_col_offset, new, "number")]
        case ast.BinOp(op=op, left=left, right=right):
            kind = "operator"
        case (
            ast.Compare(ops=[op, *_], left=left, comparators=[right, *_]) | ast.BoolOp(op=op, values=[left, right, *_])
        ):
            kind = "condition"
        case _:
            return []
    if type(op) not in SIGNS or left.end_lineno != right.lineno:
        return []
    old, new = SIGNS[type(op)].split()
    new = BOUNDARY.get(old, new) if isinstance(right, ast.Constant) and isinstance(right.value, int) else new
    at = lines[right.lineno - 1][left.end_col_offset : right.col_offset].find(old)
    start = left.end_col_offset + at
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
    return list(dict.fromkeys(str(t.relative_to(ROOT)) for t in [*named, *importing, *beside]))[:MOST_JUDGES]


def failed(tests: list[str], compiled: bool, patience: float) -> list[str]:
    """Run tests on the copy as it stands -> those that failed, at most one of a file; the file where it went wrong."""
    path = os.pathsep.join([*(str(TREE / package) for package in PACKAGES), os.environ.get("PYTHONPATH", "")])
    fixed = {"PYTHONPATH": path, "PYTHONDONTWRITEBYTECODE": "1", "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
             "OMP_NUM_THREADS": "1", "NUMBA_CACHE_DIR": str(TREE / "numba")}  # fmt: skip
    off = {"NUMBA_DISABLE_JIT": "1"} if compiled else {}
    plain = ["-p", "_hypothesis_pytestplugin", "-p", "no:cacheprovider", "-q", "--tb=no", *["-x"][len(tests) > 1 :]]
    command, environment = [sys.executable, "-m", "pytest", *plain, *tests], os.environ | fixed | off
    try:
        done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=patience)
    except subprocess.TimeoutExpired:
        return []
    found = re.findall(r"^(?:FAILED|ERROR) (\S+?)(?: - .*)?$", done.stdout, re.MULTILINE)
    return found or (tests if done.returncode else [])


def judge(mutants: list[Mutant], minutes: float) -> list[tuple[Mutant, str]]:
    """One after another until the time is up -> each with the test that caught it, or nothing."""
    for package in PACKAGES:
        shutil.rmtree(TREE / package, ignore_errors=True)
        shutil.copytree(SOURCES / package / package, TREE / package / package)
    verdicts, end = [], time.monotonic() + 60.0 * minutes
    for k, mutant in enumerate(mutants):
        if time.monotonic() > end:
            break
        target, start, by = TREE / mutant.path, time.monotonic(), []
        text = target.read_text()
        lines = text.splitlines()
        lines[mutant.line - 1] = mutant.after
        target.write_text("\n".join(lines) + "\n")
        try:
            for test in judges(mutant):
                left = PATIENCE - (time.monotonic() - start)
                by = by or (failed([test], "compiled" in mutant.path.parts, left) if left > 0.0 else [])
        finally:
            target.write_text(text)
        verdicts.append((mutant, by[0] if by else ""))
        said = f"caught by {by[0]}" if by else "SURVIVED"
        took = time.monotonic() - start
        print(f"{k + 1}/{len(mutants)} {mutant.path.name}:{mutant.line} {said}, {took:.0f} s", flush=True)
    wrong = {}
    for compiled in (False, True):
        used = sorted({by for mutant, by in verdicts if by and ("compiled" in mutant.path.parts) == compiled})
        wrong[compiled] = failed(used, compiled, 60.0 * PATIENCE) if used else []
    return [(mutant, by) for mutant, by in verdicts if by not in wrong["compiled" in mutant.path.parts]]


def page(verdicts: list[tuple[Mutant, str]], seed: int, count: int) -> str:
    rows = []
    for column in ("part", "kind"):
        counts = Counter((getattr(m, column), bool(by)) for m, by in verdicts)
        for name in dict.fromkeys(name for name, _ in counts):
            n, hit = counts[name, True] + counts[name, False], counts[name, True]
            rows.append(f"| {column}: {name} | {n} | {hit} | {hit / n:.0%} |")
    left = [
        f"- `{'/'.join(m.path.parts[1:])}:{m.line}`: `{m.before.strip()}` -> `{m.after.strip()}`"
        for m, c in verdicts
        if not c
    ]
    hit, n = sum(bool(by) for _, by in verdicts), max(len(verdicts), 1)
    return PAGE.format(
        seed=seed, count=count, hit=hit, n=n, share=hit / n, rows="\n".join(rows), left="\n".join(left) or "None."
    )


PAGE = """\
# What share of one-line mistakes the tests catch

Made by `make mutants`, seed {seed}: one operator, condition or number changed in a copy of the packages; the tests that
are named like the module, import it or stand beside it judge, not all of them (`tools/mutants.py`). The compiled
recursion is judged as Python beside its readable twin.

**{hit} of {n} caught, {share:.0%}**; {count} were drawn, the others not judged within the time.

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
    given = parser.parse_args()
    verdicts = judge(drawn(given.mutants, given.seed, given.only), given.minutes)
    (ROOT / "docs" / "mutants.md").write_text(page(verdicts, given.seed, given.mutants))
    print(f"docs/mutants.md: {sum(bool(by) for _, by in verdicts)} of {len(verdicts)} caught")


if __name__ == "__main__":
    main()
