"""Which tests execute which line, and which of them fail on a changed one: what `mutants.py` judges with."""

import ast
import hashlib
import json
import re
import time
from functools import cache
from pathlib import Path
from typing import NamedTuple

import coverage
from mutant_runs import (
    AMID_OTHERS,
    KEPT,
    PACKAGES,
    ROOT,
    SLOW_FILE,
    SOURCES,
    Watch,
    change,
    file_of,
    forked,
    run_pytest,
    shared_out,
)

JUDGES = ("replay", "nodes", "core", "diagnosis", "viewer")  # folders of tests
PLAIN_JUDGES = re.compile(r"tests/core/|oracles|\b(core\.compiled|mechanics|output_error|observation)\b")
"""Of what numba compiles: what a file of tests is called or imports. Of the others few end in time without it."""
PATIENCE, SHORT = 40.0, (2.0, 8.0)  # s, to catch one; of tests that are tried first, and then, before all others


class Test(NamedTuple):
    took: float  # s
    lines: dict[str, int]  # path below SOURCES -> bit n is set where line n is executed


@cache
def _place(path: Path, line: int) -> tuple[set[int], set[str] | None]:
    """The lines of the statement that a line is of; the names it has for others, or None if not executed at import."""
    within, inner = [ast.parse((SOURCES / path).read_text())], None
    while inner := next((n for n in ast.iter_child_nodes(within[-1]) if line in _extent(n)), None):
        within.append(inner)
    statement = next((n for n in reversed(within) if isinstance(n, ast.stmt)), within[0])
    head = getattr(statement, "body", [])
    last = head[0].lineno - 1 if isinstance(head, list) and head else getattr(statement, "end_lineno", line)
    lines = set(range(getattr(statement, "lineno", line), last + 1)) | {line}
    above = within[: within.index(statement)]
    if any(isinstance(n, ast.FunctionDef | ast.AsyncFunctionDef) for n in above):
        return lines, None
    targets = [*getattr(statement, "targets", []), getattr(statement, "target", None)]
    names = {n.id for target in targets if target for n in ast.walk(target) if isinstance(n, ast.Name)}
    return lines, names | {n.name for n in [*above, statement] if hasattr(n, "name")}


def _extent(node: ast.AST) -> range:
    if not hasattr(node, "lineno"):  # what has no place of its own, such as the arguments of a function
        inner = [_extent(n) for n in ast.iter_child_nodes(node)]
        return range(min((r.start for r in inner if r), default=0), max((r.stop for r in inner), default=0))
    return range(min([node.lineno, *(n.lineno for n in getattr(node, "decorator_list", []))]), node.end_lineno + 1)


def judges(path: Path, line: int, tests: dict[str, Test]) -> list[str]:
    """Who judges: what executes the line, what executes what it names, what may by its place; each quickest first."""
    lines, names = _place(path, line)
    masks = {str(path): sum(1 << n for n in lines)}
    direct = _executing(masks, tests)
    if names is not None:
        asked = re.compile(rf"\b({'|'.join(sorted(names)) or '(?!)'})\b")
        for file in (file for package in PACKAGES for file in (SOURCES / package / package).rglob("*.py")):
            named = sum(1 << n for n, text in enumerate(file.read_text().splitlines(), 1) if asked.search(text))
            masks[str(file.relative_to(SOURCES))] = named
        direct += _executing(masks, tests)
        direct += _executing({str(path): -1}, tests)
        direct += _executing({p: -1 for p in masks if Path(p).parent == path.parent}, tests)
    files = {file_of(test) for test in direct}  # what a file's helpers keep is made by its first test alone
    beside = sorted((test for test in tests if file_of(test) in files), key=lambda test: tests[test].took)
    return list(dict.fromkeys([*direct, *beside]))


def _executing(masks: dict[str, int], tests: dict[str, Test]) -> list[str]:
    found = [t for t, test in tests.items() if any(test.lines.get(path, 0) & mask for path, mask in masks.items())]
    return sorted(found, key=lambda test: tests[test].took)


def learn(file: str, plain: bool) -> dict:
    """Run a file of tests on the code as it is -> its tests that pass and what they execute."""

    def work(note: Path) -> None:
        lines = coverage.Coverage(data_file=None, config_file=False, include=[f"{SOURCES}/*"], messages=False)
        watch = Watch(note, lines=lines)
        lines.start()
        run_pytest([file], watch)
        lines.stop()
        watch.learnt()

    return forked(plain, AMID_OTHERS * (2.0 * SLOW_FILE + 10.0), work) or {}


def failed(
    limits: dict[str, float], plain: bool, patience: float, changed: tuple[Path, str] | None = None
) -> list[str]:
    """Run tests, each for so many s -> those that failed; the first of them if a file of the code is changed."""
    files = list(dict.fromkeys(map(file_of, limits)))

    def work(note: Path) -> None:
        if changed:
            change(*changed)
        run_pytest(files, Watch(note, limits), *["-x"][: changed is not None])

    return forked(plain, patience, work) or []


def limit(took: float) -> float:
    """s after which a test that took so long has failed; it may be the first to ask for what its file takes long to
    make."""
    return 10.0 * took + 10.0 + SLOW_FILE


def known_tests() -> dict[bool, dict[str, Test]]:
    """What each test executes, as it is compiled (False) and as plain Python (True); of files that changed anew."""
    helpers, known, new = sorted((ROOT / "tests").glob("*.py")), {False: {}, True: {}}, []
    code = [file for package in PACKAGES for file in sorted((SOURCES / package).rglob("*.py"))]
    state = "".join(file.read_text() for file in [*code, *helpers])
    for file in (file for folder in JUDGES for file in sorted((ROOT / "tests" / folder).glob("test_*.py"))):
        name, text = str(file.relative_to(ROOT)), file.read_text()
        key = hashlib.sha256((state + text).encode()).hexdigest()
        for plain in (False, True)[: 2 if PLAIN_JUDGES.search(name + text) else 1]:
            new.append((name, plain, KEPT / "known" / f"{file.stem}-{plain}-{key[:16]}.json"))
    new.sort(key=lambda task: task[1])
    missing = [task for task in new if not task[2].exists()]
    (KEPT / "known").mkdir(parents=True, exist_ok=True)
    for k, said in enumerate(shared_out(_learn, missing), 1):
        print(f"{k}/{len(missing)} {said}", flush=True)
    for _, plain, path in new:
        for test, (took, lines) in json.loads(path.read_text()).items():
            known[plain][test] = Test(took, {of: int(mask, 16) for of, mask in lines.items()})
    return known


def _learn(task: tuple[str, bool, Path]) -> str:
    file, plain, path = task
    found = learn(file, plain)
    path.write_text(json.dumps(found))
    took = sum(took for took, _ in found.values())
    return f"{file}{', plain' if plain else ''}: {len(found)} tests, {took:.0f} s"


@cache
def _compiled() -> tuple[set[Path], set[Path]]:
    """The files that numba compiles, and those that they import from."""
    of = [file for package in PACKAGES for file in (SOURCES / package / package).rglob("*.py")]
    compiled = {file for file in of if re.search(r"^from numba import .*njit", file.read_text(), re.MULTILINE)}
    beside = set()
    for file in compiled:
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.ImportFrom) and node.level:
                base = file.parents[node.level - 1].joinpath(*(node.module or "").split("."))
                beside |= {base.with_suffix(".py"), *(base / f"{alias.name}.py" for alias in node.names)}
    return {file.relative_to(SOURCES) for file in compiled}, {file.relative_to(SOURCES) for file in beside}


def is_plain(path: Path, line: int) -> bool:
    """Whether a line is judged as Python: numba compiles it, or takes it as a constant from where it stands."""
    compiled, beside = _compiled()
    if path in compiled | beside and _place(path, line)[1] is not None:
        return True
    return path in compiled and _is_compiled(path, line)


@cache
def _is_compiled(path: Path, line: int) -> bool:
    """Whether a line of a file is one of a function that numba compiles."""
    functions = (n for n in ast.walk(ast.parse((SOURCES / path).read_text())) if isinstance(n, ast.FunctionDef))
    return any(line in _extent(n) and "njit" in map(_called, n.decorator_list) for n in functions)


def _called(decorator: ast.expr) -> str:
    """The name of a decorator."""
    return getattr(getattr(decorator, "func", decorator), "id", "")


def caught_by(path: Path, line: int, after: str, known: dict[bool, dict[str, Test]]) -> str:
    """The test that fails when a line reads differently, or nothing."""
    plain, end = is_plain(path, line), time.monotonic() + AMID_OTHERS * PATIENCE
    tests = known[plain]
    order, lines = judges(path, line, tests), (SOURCES / path).read_text().splitlines()
    text = "\n".join([*lines[: line - 1], after, *lines[line:]]) + "\n"
    for most in (*SHORT, PATIENCE):
        limits, spent = {}, 0.0
        while order and spent < most:
            test = order.pop(0)
            spent += tests[test].took + (0.0 if file_of(test) in map(file_of, limits) else 0.2)
            limits[test] = limit(tests[test].took)
        while limits and (left := end - time.monotonic()) > 0.0:
            found = failed(limits, plain, left, (SOURCES / path, text))
            if not found:
                break
            if found[0] not in failed(_up_to(found[0], limits), plain, left):
                return found[0]
            if not limits.pop(found[0], None):
                break
    return ""


def _up_to(test: str, limits: dict[str, float]) -> dict[str, float]:
    """With it and those before it: run so on the code as it is, it fails too where it judges nothing. It may be the
    first that asks for what takes its file long to make."""
    names = list(limits)
    return {name: limits[name] for name in names[: names.index(test) + 1 if test in limits else len(names)]}
