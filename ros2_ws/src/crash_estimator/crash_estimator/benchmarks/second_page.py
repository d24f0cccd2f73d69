"""docs/second-generator.md: what is found in tests of a simulator that nothing was built on."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from crash_replay.second_generator.cases import Case, case_of
from crash_replay.second_generator.forms import FORMS
from crash_replay.second_generator.plan import DEVELOPMENT, LOOKED_AT, MILD, NOISES, SEEDS, TROUBLE, kind_of
from crash_replay.second_generator.structures import STRUCTURES

from ..core.diagnosis import ADEQUATE, EFFECT_MISSING, UNEXPLAINED
from ..figures import markdown_table
from .second_judge import leads, named_wrong, right, rival_named, wanted
from .statistics import Share, median, share

VERDICTS = (EFFECT_MISSING, ADEQUATE, UNEXPLAINED, "error")

HEAD = """\
# What is found in tests of a second simulator

Written without a look at the first simulator or at the search: the same physics as other engineers write it, with
located events, internal states and sensors that ring, drift and clip. Made by `make benchmark-second`, which can be
stopped and goes on where it was; one case by its name with `make benchmark-second ARGS="--case NAME"`. Two recordings a
case, at 0.7 and 1.0 of the nominal speed. *Right* means: the verdict is `effect_missing`, and the hidden effect, or
another name of the same law, leads the ranking on its target; which names count is written in the case
([`forms.py`](../ros2_ws/src/crash_replay/crash_replay/second_generator/forms.py)). Shares have Wilson's 95 %
interval."""

HOW = f"""\
By [`crash_replay.second_generator`](../ros2_ws/src/crash_replay/crash_replay/second_generator), which shares nothing
with the search and nothing with the first simulator: four structures (`wall`, `cab`, `side`, `sled`) drawn anew from
every seed, an integrator that locates contact, unloading, slip and break, and a chain of sensors. An effect makes 15
to 35 % of its target's peak force (a stop or a cubic term up to 60 %), a body's mass is off by 8 to 20 %, a channel's
gain by 4 to 9 %, its offset by 1.5 to 4.8 g, its delay by 0.3 to 0.8 ms, a stated speed by 2 to 6 %. Drawn anew is
what cannot be asked: a target that carries less than 15 % of the largest force, and an effect of which less than 25
standard deviations of 1 g of noise are left, over both recordings, when the model's stiffnesses have taken what they
can to first order. This is decided by the simulated physics alone.

The judging seeds start at {SEEDS:,}; nobody had looked at them before. On others, of which {LOOKED_AT} cases were
looked at, the simulator was made and the search tuned; those from {DEVELOPMENT:,} on may be.""".replace(",0", " 0")


class Judged(NamedTuple):
    case: Case
    row: dict

    @property
    def kind(self) -> str:
        return kind_of(self.case)


def page(rows: Sequence[dict], planned: int, code: str) -> str:
    drawn = [Judged(case_of(row["case"]), row) for row in rows if "not_drawn" not in row]
    counts = (
        f"{len(drawn)} cases judged of {planned} planned, {len(rows) - len(drawn)} could not be drawn; code {code}."
    )
    parts = [
        HEAD, counts, "## Asked and reached", _asked(drawn), "## By effect and form", _by_form(drawn),
        "## By structure", _by(drawn, "structure", list(STRUCTURES), lambda j: j.case.structure),
        "## Sensors in trouble", _by_trouble(drawn), "## Nothing hidden", _nothing(drawn),
        "## Outside the vocabulary", _outside(drawn), "## How the cases are made", HOW,
        "## Cases that were not right", _not_right(drawn),
    ]  # fmt: skip
    return "\n\n".join(parts) + "\n"


def _of(drawn: Sequence[Judged], kind: str) -> list[Judged]:
    return [j for j in drawn if j.kind == kind]


def _share(chosen: Sequence[Judged], hit: Callable[[dict], bool]) -> Share:
    return share([j.row for j in chosen], hit)


def is_verdict(which: str) -> Callable[[dict], bool]:
    return lambda row: row["verdict"] == which


def silent_wrong(row: dict) -> bool:
    """A wrong effect is named, and the right one not even as its rival."""
    return named_wrong(row) and not rival_named(row)


def _asked(drawn: Sequence[Judged]) -> str:
    one, nothing, outside, trouble = (_of(drawn, kind) for kind in ("one", "nothing", "outside", "trouble"))
    seconds = [j.row["seconds"] for j in drawn]
    time = f"{median(seconds):.2g} s, the longest {max(seconds):.2g} s" if seconds else "-"
    answers, unexplained = (
        [j.row["iterations"] for j in drawn if j.row["verdict"] == word] for word in (EFFECT_MISSING, UNEXPLAINED)
    )
    of_answer = f"{median(answers):.0f}, most {max(answers)}" if answers else "-"
    times = f"{median(unexplained) / median(answers):.3g}" if answers and unexplained else "-"
    rows = [
        ("right effect and target first, 0.5 to 2 g, all forms", "95 %", _share(one, right)),
        *((f"at {noise:g} g", "95 %", _share([j for j in one if j.case.noise == noise], right)) for noise in NOISES),
        ("it leads the ranking, whatever the verdict", "", _share(one, leads)),
        ("verdict `effect_missing`", "", _share(one, is_verdict(EFFECT_MISSING))),
        ("wrong without its rival named", "at most 1 %", _share(one, silent_wrong)),
        ("`adequate` where nothing is hidden", "97 %", _share(nothing, is_verdict(ADEQUATE))),
        ("outside the vocabulary: nothing named", "97 %", _share(outside, wanted)),
        ("sensors in trouble: right", "90 %", _share(trouble, right)),
        ("sensors in trouble: wrong `adequate`", "none", _share(trouble, is_verdict(ADEQUATE)).short),
        ("CPU time of a diagnosis, median", "1 s", time),
        ("iterations of all fits, the same on every machine: of an answer, median", "", of_answer),
        ("of `unexplained`, median: times as many", "3", times),
    ]
    return markdown_table(("", "asked", "reached (95 % interval)"), [(a, b, str(c)) for a, b, c in rows])


def _row(name: str, chosen: Sequence[Judged]) -> tuple[str, ...]:
    verdicts = (_share(chosen, is_verdict(v)).short for v in VERDICTS)
    seconds = [j.row["seconds"] for j in chosen]
    time = f"{median(seconds):.2g}" if seconds else "-"
    return name, str(_share(chosen, right)), _share(chosen, leads).short, *verdicts, time


HEADINGS = ("right", "leads", *(f"`{v}`" for v in VERDICTS), "median s")


def _by(drawn: Sequence[Judged], what: str, keys: Sequence[str], key: Callable[[Judged], str]) -> str:
    one = _of(drawn, "one")
    rows = [_row(f"`{this}`", [j for j in one if key(j) == this]) for this in keys]
    return markdown_table((what, *HEADINGS), [*rows, _row("all", one)])


def _by_form(drawn: Sequence[Judged]) -> str:
    inside = [name for name, form in FORMS.items() if not form.outside]
    of_effect = {f"{FORMS[name].effect}: {name}": name for name in inside}
    names = {name: f"{FORMS[name].effect}: {name}" for name in inside}
    return _by(drawn, "effect: form", list(of_effect), lambda j: names[j.case.form])


def _by_trouble(drawn: Sequence[Judged]) -> str:
    rows = [_row(f"`{t}`", [j for j in _of(drawn, "trouble") if j.case.nuisance == t]) for t in TROUBLE]
    return markdown_table(("sensors", *HEADINGS), [*rows, _row("all", _of(drawn, "trouble"))])


def _nothing(drawn: Sequence[Judged]) -> str:
    rows = []
    for nuisance in (*MILD, "all"):
        chosen = [j for j in _of(drawn, "nothing") if nuisance in ("all", j.case.nuisance)]
        named = sorted({_said(j.row) for j in chosen if j.row["verdict"] == EFFECT_MISSING})
        rows.append((nuisance, *(_share(chosen, is_verdict(v)).short for v in VERDICTS), "; ".join(named)))
    return markdown_table(("sensors", *(f"`{v}`" for v in VERDICTS), "named"), rows)


def _outside(drawn: Sequence[Judged]) -> str:
    rows = []
    for name in (name for name, form in FORMS.items() if form.outside):
        chosen = [j for j in drawn if j.case.form == name]
        named = sorted({_said(j.row) for j in chosen if j.row["verdict"] == EFFECT_MISSING})
        rows.append((f"`{name}`", *(_share(chosen, is_verdict(v)).short for v in VERDICTS), "; ".join(named)))
    return markdown_table(("hidden", *(f"`{v}`" for v in VERDICTS), "named"), rows)


def _not_right(drawn: Sequence[Judged]) -> str:
    lines = [
        (j.case.name, _hidden(j.row), j.row["verdict"], _said(j.row)) for j in drawn if not wanted(j.row)
    ]  # fmt: skip
    if not lines:
        return "None."
    return markdown_table(("case", "hidden", "verdict", "what was found"), sorted(lines))


def _hidden(row: dict) -> str:
    if not row["right"]:
        return f"outside, on {row['target']}" if row["target"] else "nothing"
    return " on ".join(row["right"][0])


def _said(row: dict) -> str:
    """What was added; else what led."""
    if "error" in row:
        return row["error"].replace("|", "/")[:120]
    rivals = ", ".join(row["ranking"][0]["rivals"]) if row["ranking"] else ""
    found = ", ".join(" on ".join(step["key"]) for step in row["steps"])
    if not found and row["ranking"]:
        found = f"nothing ({' on '.join(row['ranking'][0]['key'])} led)"
    return (found or "nothing") + (f" (not told from {rivals})" if rivals else "")
