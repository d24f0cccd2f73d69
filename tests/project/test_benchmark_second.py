"""`make benchmark-second`: its judgement of an answer, its interrupted runs and its page."""

import subprocess
import sys

import pytest
from helpers_paths import ROOT

from crash_estimator.benchmarks import second
from crash_estimator.benchmarks.second_judge import judge, leads, named_wrong, right, rival_named, wanted
from crash_estimator.benchmarks.second_page import page
from crash_replay.second_generator.cases import CaseError
from crash_replay.second_generator.plan import DEVELOPMENT, plan

FRICTION = "side/friction.dahl/1g/clean/5"
NAMES = [["coulomb_friction", "rib_spine"], ["hysteresis", "rib_spine"]]


def row(
    case=FRICTION, verdict="effect_missing", first=("coulomb_friction", "rib_spine"), expected=NAMES, **more
) -> dict:
    return {
        "case": case, "right": expected, "gap": 0.0, "seen": 99.0, "target": "rib_spine",
        "verdict": verdict, "seconds": 2.0, "iterations": 300 if verdict == "effect_missing" else 900,
        "ranking": [{"key": list(first), "rivals": more.pop("rivals", []), "shape": more.pop("shape", {})}],
        "steps": [{"key": list(first)}] if verdict == "effect_missing" else [],
    } | more  # fmt: skip


def test_every_name_of_the_hidden_law_is_right_and_no_other():
    assert right(row()) and right(row(first=("hysteresis", "rib_spine")))
    assert named_wrong(row(first=("viscous_damping", "rib_spine")))
    assert named_wrong(row(first=("coulomb_friction", "door_rib")))
    unsure = row(verdict="unexplained")
    assert leads(unsure) and not right(unsure) and not named_wrong(unsure)


def test_a_wrong_answer_can_name_the_right_one_as_its_rival():
    wrong = row(first=("viscous_damping", "rib_spine"), rivals=["hysteresis on rib_spine"])
    assert named_wrong(wrong) and rival_named(wrong)
    assert not rival_named(row(first=("viscous_damping", "rib_spine"), rivals=["hysteresis on door_rib"]))


@pytest.mark.parametrize(("stop", "counts"), [(0.0505, True), (0.054, False)])
def test_a_stop_where_the_hidden_gap_closes_is_that_gap(stop, counts):
    gap = [["clearance", "door_rib"]]
    found = row("side/gap.one/1g/clean/5", first=("bottoming_out", "door_rib"), expected=gap, shape={"stop": stop})
    assert right(found | {"gap": 0.05}) is counts
    assert not right(found)  # a play to both sides has no such other name


def test_each_kind_has_its_wanted_answer():
    nothing, outside = "side/nothing/1g/ringing/5", "side/outside.losing/1g/clean/5"
    assert wanted(row(nothing, "adequate", expected=[])) and not wanted(row(nothing, "unexplained", expected=[]))
    assert wanted(row(outside, "adequate", expected=[])) and wanted(row(outside, "unexplained", expected=[]))
    assert not wanted(row(outside, expected=[])) and not wanted(row(outside, "error", expected=[]))
    assert wanted(row()) and not wanted(row(verdict="adequate"))


def test_a_case_that_cannot_be_drawn_and_a_search_that_breaks_are_told_not_raised(monkeypatch):
    case = plan(DEVELOPMENT)[0]._replace(structure="wall", form="nothing", nuisance="clean")
    monkeypatch.setattr("crash_estimator.benchmarks.second_judge.diagnose", lambda *_: 1 / 0)
    broken = judge(case)
    assert (broken["verdict"], broken["error"]) == ("error", "ZeroDivisionError: division by zero")

    def refuse(_):
        raise CaseError("not seen")

    monkeypatch.setattr("crash_estimator.benchmarks.second_judge.drawn", refuse)
    assert judge(case)["not_drawn"] == "not seen"


def test_page_counts_what_the_rows_say():
    rows = [
        row(), row("side/friction.dahl/2g/clean/6", first=("viscous_damping", "rib_spine")),
        row("side/nothing/1g/ringing/7", "adequate", expected=[]),
        row("side/outside.losing/1g/clean/8", first=("rate_hardening", "door_rib"), expected=[]),
        row("side/friction.dahl/1g/clipped/9", "adequate"),
        row("side/friction.dahl/1g/clipped/11", "unexplained"),
        {"case": "wall/mass.rigid/1g/clean/10", "not_drawn": "not seen"},
    ]  # fmt: skip
    text = page(rows, 7, "abc")
    assert "6 cases judged of 7 planned, 1 could not be drawn; code abc" in text
    assert "| right effect and target first, 0.5 to 2 g, all forms | 95 % | 50 % (9 to 91) of 2 |" in text
    assert "| wrong without its rival named | at most 1 % | 50 % (9 to 91) of 2 |" in text
    assert "| `adequate` where nothing is hidden | 97 % | 100 % (21 to 100) of 1 |" in text
    assert "| sensors in trouble: wrong `adequate` | none | 1/2 |" in text
    assert "of an answer, median |  | 300, most 300 |" in text
    assert "| of `unexplained`, median: times as many | 3 | 3 |" in text
    assert "| `outside.losing` | 1/1 | 0/1 | 0/1 | 0/1 | rate_hardening on door_rib |" in text
    assert "0 cases judged" in page([], 0, "abc")


def run(monkeypatch, *arguments) -> int:
    monkeypatch.setattr(sys, "argv", ["second", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        second.main()
    return ended.value.code


def test_a_run_is_resumed_where_it_was_and_a_part_never_writes_to_docs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)

    def rows(function, cases, processes, mark):
        return [row(case.name) | {"code": mark} for case in cases]

    monkeypatch.setattr(second, "in_processes", rows)
    assert run(monkeypatch, "--cases", 3, "--seed", DEVELOPMENT) == 0
    assert (tmp_path / "out" / "second-generator.md").exists() and not (tmp_path / "docs").exists()
    kept = (tmp_path / "out" / "second-generator.jsonl").read_text()
    capsys.readouterr()
    assert run(monkeypatch, "--cases", 3, "--seed", DEVELOPMENT) == 0
    assert (tmp_path / "out" / "second-generator.jsonl").read_text() == kept
    assert "3 cases, 3 of them in" in capsys.readouterr().out


def test_make_help_shows_it():
    shown = subprocess.run(["make", "help"], cwd=ROOT, capture_output=True, text=True, check=True)
    assert "make benchmark-second\t" in shown.stdout
