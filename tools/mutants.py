"""What share of one-line mistakes the tests catch: docs/mutants.md.

A mutant is the code with one operator, condition or number changed. First the tests are run once on the code as it is,
to learn which executes which line, and how long it takes; those that take long, or fail, judge nothing, and what a test
starts in another process is not seen. A mutant is then judged by the tests that execute its line, quickest first; the
first that fails, or takes ten times as long and 30 s more, has caught it, unless it does so on the code as it is, too,
run after the same tests. A line that is executed at import alone, as a constant's, is judged by the tests that execute
a line with its name, then by those of its file. What is not caught within a time counts as not caught. What numba
compiles, and where that takes its constants from, runs as Python (NUMBA_DISABLE_JIT): so its lines are seen, and
nothing is compiled anew or found in a cache.
"""

import argparse
import ast
import hashlib
import json
import re
import time
from collections import Counter
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import NamedTuple

import mutant_judges
import mutant_runs
from mutant_runs import KEPT, PACKAGES, ROOT, SLOW, SOURCES, shared_out

PARTS = {"core": (PACKAGES[0], 0.6), "readers": (PACKAGES[1], 0.25), "nodes": (PACKAGES[0], 0.15)}
"""Folder -> its package, and its share of the mutants: about that of the lines."""
WRITTEN_AFTER = (1,)
"""Seeds of which what survived became tests: another seed says what the tests catch that nothing was written for."""
SIGNS = {ast.Add: "+ -", ast.Sub: "- +", ast.Mult: "* /", ast.Div: "/ *", ast.Pow: "** *", ast.And: "and or",
         ast.Or: "or and", ast.Eq: "== !=", ast.NotEq: "!= ==", ast.Lt: "< >=", ast.LtE: "<= >", ast.Gt: "> <=",
         ast.GtE: ">= <"}  # fmt: skip
BOUNDARY = {"<": "<=", "<=": "<", ">": ">=", ">=": ">"}
"""Beside a whole number: there it is another one; of two measurements it hardly ever is."""
SILENT = re.compile(
    r"raise |Error\(|say\(|\.info\(|\.warn|help=|f\"|import |@|Allowed\(|TYPE_CHECKING|strict=|frozen=|__name__"
)
"""Lines of messages, declarations, imports and guards for the programmer: a changed one is no wrong result."""
FACTS = re.compile(r"readers/(units|dates|nhtsa_uds|codes/\w+)\.py|core/(rating|validation|effects/vented_gas)\.py")
"""Files whose constants are facts of a unit, a format, a standard or of physics; those of others were chosen."""

EQUAL = {
    "names.sign / (-1.0": "by 1 or -1 it is all the same",
    "values / signs": "by 1 or -1 it is all the same",
    "sign <= 0": "a sign is 1 or -1",
    "turn <= 0": "a sign is 1 or -1",
    "else at - 4": "there stands the upper half of the first sample's number, which is 0: no test has 2^32",
    "reshape(n, -2)": "numpy takes every number below 0 for the open one",
    "reshape(samples, -2)": "numpy takes every number below 0 for the open one",
    "self.run > 0 else 0": "of run 0 it is 0 either way",
    "most_common(2)[0]": "the first of two is the first",
}
"""What a mutant has that its line has not, and why it provably changes nothing; it counts as not caught."""


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
    settings = set() if FACTS.search(str(path)) else _settings(nodes)
    for node in (node for node in nodes if node not in settings):
        for line, start, stop, new, kind in _changes(node, lines):
            before = lines[line - 1]
            if line not in told and before.isascii() and not SILENT.search(before):  # columns count bytes
                after = before[:start] + new + before[stop:]
                found.append(Mutant(part, path.relative_to(SOURCES), line, kind, before, after))
    return found


def _settings(nodes: list[ast.AST]) -> set[ast.AST]:
    """Numbers that stand by themselves in a constant of a module or as the default of a class's field."""
    found = set()
    for node in nodes:
        if isinstance(node, ast.Module | ast.ClassDef):
            given = [n for n in node.body if isinstance(n, ast.Assign | ast.AnnAssign) and n.value]
            found |= {leaf for n in given for leaf in _alone(n.value) if type(leaf.value) is not bool}
    return found


def _alone(node: ast.AST) -> Iterator[ast.Constant]:
    """The constants of an expression that nothing is calculated or compared with."""
    if isinstance(node, ast.Constant):
        yield node
    elif not isinstance(node, ast.BinOp | ast.Compare | ast.BoolOp | ast.Lambda):
        for inner in ast.iter_child_nodes(node):
            yield from _alone(inner)


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
    """As many as asked for: of each part its share, one for each line at most.

    A seed puts them in an order that depends on their text alone: where the code is changed elsewhere, they stay.
    """
    in_order = partial(_place_in_order, seed=seed)
    chosen = []
    for part, (package, share) in PARTS.items():
        files = sorted((SOURCES / package / package / part).rglob("*.py"))
        of_line: dict[tuple[Path, int], Mutant] = {}
        for mutant in sorted((m for path in files for m in mutants_of(part, path)), key=in_order):
            if only in str(mutant.path):
                of_line.setdefault((mutant.path, mutant.line), mutant)
        chosen += list(of_line.values())[: round(count * share)]
    return sorted(chosen, key=in_order)


def _place_in_order(mutant: Mutant, seed: int) -> str:
    return hashlib.sha256(f"{seed} {_name(mutant)}".encode()).hexdigest()


class Verdict(NamedTuple):
    mutant: Mutant
    by: str  # the test that caught it, or nothing


def judge(mutants: list[Mutant], minutes: float, keep: Callable[[list[Verdict]], object]) -> list[Verdict]:
    """Two at once until the time is up.

    keep: is given the verdicts so far, each time that there is one more.
    """
    global _known, _end
    _known, verdicts = mutant_judges.known_tests(), []
    start = time.monotonic()
    _end = start + 60.0 * minutes
    for verdict in filter(None, shared_out(_verdict, mutants)):
        verdicts.append(verdict)
        keep(verdicts)
        mutant, by = verdict
        said = f"{mutant.path.name}:{mutant.line} {f'caught by {by}' if by else 'SURVIVED'}"
        print(f"{len(verdicts)}/{len(mutants)} {said}, {(time.monotonic() - start) / 60.0:.1f} min", flush=True)
    return verdicts


def _verdict(mutant: Mutant) -> Verdict | None:
    if time.monotonic() > _end:
        return None
    return Verdict(mutant, mutant_judges.caught_by(mutant.path, mutant.line, mutant.after, _known))


def section(verdicts: list[Verdict], seed: int, count: int) -> str:
    """What the page says of one seed."""
    rows = []
    for column in ("part", "kind"):
        counts = Counter((getattr(v.mutant, column), bool(v.by)) for v in verdicts)
        for name in dict.fromkeys(name for name, _ in counts):
            n, hit = counts[name, True] + counts[name, False], counts[name, True]
            rows.append(f"| {column}: {name} | {n} | {hit} | {hit / n:.0%} |")
    left = []
    for m in (m for m, by in verdicts if not by):
        why = [f" (changes nothing: {why})" for new, why in EQUAL.items() if new in m.after and new not in m.before]
        shown = f"`{m.before.strip()}` -> `{m.after.strip()}`"
        left.append(f"- `{'/'.join(m.path.parts[1:])}:{m.line}`: {shown}{''.join(why)}")
    hit, n = sum(bool(v.by) for v in verdicts), len(verdicts)
    share = f"**{hit} of {n} caught, {hit / max(n, 1):.0%}**"
    return SECTION.format(
        seed=seed, count=count, share=share, rows="\n".join(rows), left="\n".join(left) or "None.",
        what="tests were written for what it had left" if seed in WRITTEN_AFTER else "no test was written for it",
    )  # fmt: skip


def page(sections: str, before: str) -> str:
    """The page with a seed's section anew, and those of other seeds as they were."""
    parts = {part.split(":")[0]: part.strip() for part in re.split(r"^(?=## Seed )", before, flags=re.MULTILINE)[1:]}
    parts[sections.split(":")[0]] = sections.strip()
    return (
        PAGE.format(slow=SLOW, patience=mutant_judges.PATIENCE)
        + "\n".join(f"\n{parts[name]}" for name in sorted(parts))
        + "\n"
    )


PAGE = """\
# What share of one-line mistakes the tests catch

Made by `make mutants`: one operator, condition or number changed. The tests that execute the line judge, quickest
first, for {patience:g} s of a processor at most, but for those that take {slow:g} s of it or more and for what they do
in other processes (`tools/mutant_judges.py`). What numba compiles is judged as Python.

Not drawn: numbers that stand by themselves in a constant of a module or as the default of a class's field, unless they
are facts of a unit, a format, a standard or of physics (`FACTS` of `tools/mutants.py`). Such a number was chosen, and
its reason stands beside it: a quarter more of it is another choice, no mistake in logic, and a test that finds it would
say the number again. Numbers in equations, conditions, places and steps are drawn. Nor are lines drawn of messages and
declarations, and guards that change no result (`strict=`, `frozen=`, `__name__`).

What is not caught stays so until it is judged again (`--again`), though a test was written for it since.
"""
SECTION = """\
## Seed {seed}: {what}

{share}, {count} drawn.

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
    parser.add_argument("--minutes", type=float, default=60.0, help="no new one is begun after them")
    parser.add_argument(
        "--again", action="store_true", help="judge those that the last run of this seed did not catch, or not come to"
    )
    parser.add_argument("--at-once", type=int, default=mutant_runs.AT_ONCE, help="processes that judge")
    given = parser.parse_args()
    mutant_runs.AT_ONCE = given.at_once
    mutants, kept = drawn(given.mutants, given.seed, given.only), KEPT / f"seed{given.seed}.json"
    before = dict(json.loads(kept.read_text())) if given.again else {}
    asked = [mutant for mutant in mutants if not before.get(_name(mutant))]

    def keep(verdicts: list[Verdict]) -> list[Verdict]:
        """To go on from with --again, also where this is ended -> the verdicts, and those before that stand."""
        judged = {_name(mutant) for mutant, _ in verdicts}
        again = [mutant for mutant in mutants if _name(mutant) in before and _name(mutant) not in judged]
        verdicts = verdicts + [Verdict(mutant, before[_name(mutant)]) for mutant in again]
        kept.write_text(json.dumps([(_name(mutant), by) for mutant, by in verdicts]))
        return verdicts

    asked.sort(key=lambda mutant: _name(mutant) in before)  # first those that the run before has not come to
    verdicts = keep(judge(asked, given.minutes, keep))
    target = ROOT / "docs" / "mutants.md"
    target.write_text(page(section(verdicts, given.seed, given.mutants), target.read_text()))
    print(f"docs/mutants.md: {sum(bool(v.by) for v in verdicts)} of {len(verdicts)} caught")


def _name(mutant: Mutant) -> str:
    """What tells it from others while lines above it come and go."""
    return f"{mutant.path}: {mutant.before.strip()} -> {mutant.after.strip()}"


if __name__ == "__main__":
    main()
