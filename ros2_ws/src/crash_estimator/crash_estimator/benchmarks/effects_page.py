"""docs/missing-effects.md: what the search for the missing effect finds, and where it ends."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

from crash_replay.synthetic.hidden.outside import OUTSIDE
from crash_replay.synthetic.hidden.structures import STRUCTURES
from crash_replay.synthetic.hidden.vocabulary import VOCABULARY

from ..core.effects import EFFECTS
from ..figures import markdown_table
from .effects_judge import WANTED, a_stop_for_a_gap, both_found, kind_of, pull, right_first, rival_named, verdict_is
from .effects_plan import FULL, HARD_NOISES, NOISES, SIZES, SLOW, Case, case_of
from .effects_text import HEAD, HOW, NOT_RIGHT
from .statistics import Share, median, share

VERDICTS = ("effect_missing", "adequate", "unexplained", "error")


class Judged(NamedTuple):
    case: Case
    row: dict

    @property
    def kind(self) -> str:
        return kind_of(self.case)

    @property
    def nominal(self) -> bool:
        return self.case.size == 1.0 and self.case.noise in NOISES and self.case.rate == FULL


def page(rows: Sequence[dict], times: Sequence[dict], planned: int, code: str) -> str:
    drawn = [Judged(case_of(row["case"]), row) for row in rows if "not_drawn" not in row]
    counts = (
        f"{len(drawn)} cases judged of {planned} planned, {len(rows) - len(drawn)} could not be drawn; code {code}."
    )
    gaps = sum(j.kind == "one" and right_first(j.row) and a_stop_for_a_gap(j.row) for j in drawn)
    counts += f" A stop named for a gap (see below) counts as right in {gaps} of them."
    parts = [
        HEAD, counts, "## Asked and reached", _asked(drawn, times), "## By effect", _by_effect(drawn),
        "## By structure", _by_structure(drawn), "## Verdicts", _verdicts(drawn), "## Coefficients",
        _coefficients(drawn),
        "## Two effects at once", _two(drawn), "## Where it gets hard", _hard(drawn), "## Time", _time(times),
        "## How the cases are made", HOW,
        "## Cases that were not right", _not_right(drawn),
    ]  # fmt: skip
    return "\n\n".join(parts) + "\n"


def _pick(drawn: Sequence[Judged], kind: str, recordings: int, nominal: bool = True) -> list[Judged]:
    return [j for j in drawn if j.kind == kind and len(j.case.speeds) == recordings and (j.nominal or not nominal)]


def _share(chosen: Sequence[Judged], hit: Callable[[dict], bool]) -> Share:
    return share([j.row for j in chosen], hit)


def _wrong(row: dict) -> bool:
    """Something is named, and it is not what was hidden."""
    return row["verdict"] == "effect_missing" and not right_first(row)


def _asked(drawn: Sequence[Judged], times: Sequence[dict]) -> str:
    two, one = _pick(drawn, "one", 2), _pick(drawn, "one", 1)
    right = [j.row for j in two if right_first(j.row)]
    ratios = [row["rms"][1] / row["rms"][2] for row in right]
    pulls = [abs(p) for row in right if (p := pull(row)) is not None]
    wrong = [j for j in one if _wrong(j.row)]
    rows: list[tuple[str, str, Share | str]] = [
        ("right effect and target first, two recordings, 0.5 to 2 g", "98 %", _share(two, right_first))
    ]
    rows += [
        (f"at {noise:g} g", "98 %", _share([j for j in two if j.case.noise == noise], right_first)) for noise in NOISES
    ]
    rows += [
        (
            "`adequate` where nothing is hidden, two recordings",
            "98 %",
            _share(_pick(drawn, "nothing", 2), verdict_is("adequate")),
        ),
        ("`unexplained` outside the vocabulary", "98 %", _share(_pick(drawn, "outside", 2), verdict_is("unexplained"))),
        ("RMS over noise floor after adding, median", "1.05", f"{median(ratios):.3f}"),
        ("coefficient within 3 sigma", "95 %", Share(sum(p <= 3.0 for p in pulls), len(pulls))),
        ("one recording: right first", "85 %", _share(one, right_first)),
        (
            "one recording: wrong, and its rival not named",
            "none",
            f"{sum(not rival_named(j.row) for j in wrong)} of {len(one)}",
        ),
        (
            "one recording: `adequate` where nothing is hidden",
            "",
            _share(_pick(drawn, "nothing", 1), verdict_is("adequate")),
        ),
        ("two effects at once, 1 g: both found, nothing else", "80 %", _share(_pick(drawn, "two", 2), both_found)),
        ("dummy, two recordings, all candidates, median", "2 s", _seconds([t["time"]["wall"] for t in times])),
        ("one update of the live ranking, median", "0.1 s", _seconds([u for t in times for u in t["time"]["updates"]])),
    ]
    return markdown_table(
        ("", "asked", "reached (95 % interval)"), [(what, asked, str(got)) for what, asked, got in rows]
    )


def _seconds(values: Sequence[float]) -> str:
    return f"{median(values):.3g} s of {len(values)}" if values else "-"


def _by_effect(drawn: Sequence[Judged]) -> str:
    two, one = _pick(drawn, "one", 2), _pick(drawn, "one", 1)
    return _grid("effect", list(VOCABULARY), two, one, lambda j: j.case.effects[0])


def _by_structure(drawn: Sequence[Judged]) -> str:
    two, one = _pick(drawn, "one", 2), _pick(drawn, "one", 1)
    return _grid("structure", list(STRUCTURES), two, one, lambda j: j.case.structure)


def _grid(
    name: str, keys: Sequence[str], two: Sequence[Judged], one: Sequence[Judged], key: Callable[[Judged], str]
) -> str:
    head = (name, *(f"{noise:g} g" for noise in NOISES), "two recordings, in all", "one recording")
    rows = []
    for this in (*keys, "all"):
        both, single = ([j for j in some if this in ("all", key(j))] for some in (two, one))
        by_noise = [_share([j for j in both if j.case.noise == noise], right_first).short for noise in NOISES]
        rows.append((_code(this), *by_noise, str(_share(both, right_first)), str(_share(single, right_first))))
    return markdown_table(head, rows)


def _code(name: str) -> str:
    return name if name == "all" else f"`{name}`"


def _verdicts(drawn: Sequence[Judged]) -> str:
    kinds = [("nothing", "nothing"), ("one", "one effect of the vocabulary"), ("two", "two of them"), ("outside", "")]
    rows = []
    for recordings in (2, 1):
        for kind, hidden in kinds:
            chosen = _pick(drawn, kind, recordings)
            groups = (
                {hidden: chosen} if hidden else {f"`{e}`": [j for j in chosen if e in j.case.effects] for e in OUTSIDE}
            )
            for name, group in groups.items():
                if group:
                    rows.append((name, str(recordings), *(_share(group, verdict_is(v)).short for v in VERDICTS)))
    return markdown_table(("hidden", "recordings", *(f"`{v}`" for v in VERDICTS)), rows)


def _coefficients(drawn: Sequence[Judged]) -> str:
    """Of cases that were right."""
    rows = []
    for effect in (*VOCABULARY, "all"):
        right = [j.row for j in _pick(drawn, "one", 2) if effect in ("all", j.case.effects[0]) and right_first(j.row)]
        right = [row for row in right if pull(row) is not None]
        if not right:
            continue
        off = [abs(row["steps"][0]["coefficient"] / row["hidden"][0]["coefficient"] - 1.0) for row in right]
        pulls = [abs(pull(row)) for row in right]
        floor = median([row["rms"][1] / row["rms"][2] for row in right])
        within = Share(sum(p <= 3.0 for p in pulls), len(pulls))
        rows.append((_code(effect), f"{100 * median(off):.2g} %", f"{median(pulls):.2f}", str(within), f"{floor:.3f}"))
    return markdown_table(
        ("effect", "median error", "median error / sigma", "within 3 sigma", "median RMS / floor"), rows
    )


def _two(drawn: Sequence[Judged]) -> str:
    chosen = _pick(drawn, "two", 2)
    with_rare = [j for j in chosen if any(EFFECTS[effect].rare for effect in j.case.effects)]
    groups = [(_code(structure), [j for j in chosen if j.case.structure == structure]) for structure in STRUCTURES]
    groups += [("all", chosen), ("both looked for first", [j for j in chosen if j not in with_rare])]
    groups += [("one or both looked for last", with_rare)]
    rows = [
        (name, str(_share(these, both_found)), str(_share(these, verdict_is("effect_missing"))))
        for name, these in groups
    ]
    return markdown_table(("cases", "both found, nothing else", "`effect_missing`"), rows)


def _is(what: str, value: float, judged: Judged) -> bool:
    return getattr(judged.case, what) == value


def _hard(drawn: Sequence[Judged]) -> str:
    """Right first, and where it is not, whether something wrong was named."""
    columns: list[tuple[str, Callable[[Judged], bool]]] = [("as it is", lambda j: j.nominal and j.case.noise == 1.0)]
    columns += [(f"size 1/{1 / size:.0f}", partial(_is, "size", size)) for size in SIZES]
    columns += [(f"{noise:g} g", partial(_is, "noise", noise)) for noise in HARD_NOISES]
    columns += [("1 kHz", lambda j: j.case.rate == SLOW)]
    two, single = _pick(drawn, "one", 2, nominal=False), _pick(drawn, "one", 1)
    groups = [(name, [j for j in two if chosen(j)]) for name, chosen in columns]
    groups += [("one recording", [j for j in single if j.case.noise == 1.0])]
    rows = []
    for effect in VOCABULARY:
        rows.append((_code(effect), *(_share(_of(group, effect), right_first).short for _, group in groups)))
    rows.append(("all: right first", *(str(_share(group, right_first)) for _, group in groups)))
    rows.append(("all: a wrong one named", *(str(_share(group, _wrong)) for _, group in groups)))
    rows.append(("all: `adequate`", *(_share(group, verdict_is("adequate")).short for _, group in groups)))
    rows.append(("all: `unexplained`", *(_share(group, verdict_is("unexplained")).short for _, group in groups)))
    nothing = _pick(drawn, "nothing", 2, nominal=False)
    quiet = [_share([j for j in nothing if chosen(j)], verdict_is("adequate")).short for _, chosen in columns]
    lone = _share([j for j in _pick(drawn, "nothing", 1) if j.case.noise == 1.0], verdict_is("adequate")).short
    rows.append(("nothing hidden: `adequate`", *quiet, lone))
    return markdown_table(("effect", *(name for name, _ in groups)), rows)


def _of(group: Sequence[Judged], effect: str) -> list[Judged]:
    return [j for j in group if j.case.effects == (effect,)]


def _time(times: Sequence[dict]) -> str:
    if not times:
        return "Not taken."
    updates = [u for t in times for u in t["time"]["updates"]]
    worst = max((max(t["time"]["updates"], default=0.0) for t in times), default=0.0)
    return markdown_table(
        ("on one core, nothing beside it", "median", "largest", "of"),
        [
            ("`diagnose`, dummy, two recordings of 90 ms at 10 kHz, wall", *_line([t["time"]["wall"] for t in times])),
            ("the same, CPU", *_line([t["time"]["cpu"] for t in times])),
            (
                "one update of the live ranking, dummy, one other recording beside it",
                f"{median(updates):.3g} s", f"{worst:.3g} s", str(len(updates)),
            ),
        ],
    )  # fmt: skip


def _line(values: Sequence[float]) -> tuple[str, str, str]:
    return f"{median(values):.3g} s", f"{max(values):.3g} s", str(len(values))


def _not_right(drawn: Sequence[Judged]) -> str:
    """Of those for which a share is asked."""
    lines = []
    for j in drawn:
        if j.nominal and not WANTED[j.kind](j.row):
            lines.append((j.case.name, _names(j.row["hidden"]), j.row["verdict"], _first(j.row)))
    if not lines:
        return "None."
    return NOT_RIGHT + "\n\n" + markdown_table(("case", "hidden", "verdict", "what was found"), sorted(lines))


def _names(hidden: Sequence[dict]) -> str:
    return ", ".join(f"{h['effect']} on {h['target']}" for h in hidden) or "nothing"


def _first(row: dict) -> str:
    if "error" in row:
        return row["error"].replace("|", "/")[:120]
    found = ", ".join(" on ".join(step["key"]) for step in row["steps"]) or "nothing"
    rivals = ", ".join(row["ranking"][0]["rivals"]) if row["ranking"] else ""
    return found + (f" (not told from {rivals})" if rivals else "")
