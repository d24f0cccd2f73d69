"""`make benchmark-effects`: its plan, its judgement of an answer, its interrupted runs and its page."""

import json
import subprocess
import sys

import pytest
from helpers_paths import ROOT
from numpy.testing import assert_allclose

from crash_estimator.benchmarks import effects, effects_results
from crash_estimator.benchmarks.effects_judge import WANTED, both_found, judge, kind_of, pull, right_first, rival_named
from crash_estimator.benchmarks.effects_page import page
from crash_estimator.benchmarks.effects_plan import FULL, ONE, SEEDS, TWO, Case, case_of, plan
from crash_estimator.benchmarks.effects_results import append, read
from crash_estimator.benchmarks.effects_time import timed
from crash_estimator.benchmarks.statistics import Share, median
from crash_replay.recording import RecordingError
from crash_replay.synthetic.hidden.cases import hideable
from crash_replay.synthetic.hidden.structures import STRUCTURES

CASE = Case("single", ("viscous_damping",), 1.0, 1.0, FULL, TWO, 5)
DEVELOPMENT = 7000
"""First seed of what is run here."""


DAMPER = ("viscous_damping", "car_barrier")


def row(verdict="effect_missing", first=DAMPER, rivals=(), case=CASE, steps=None, **more) -> dict:
    keys = [first] if steps is None else steps
    return {
        "case": case.name, "hidden": [{"effect": "viscous_damping", "target": "car_barrier", "coefficient": 100.0}],
        "verdict": verdict, "rms": [2.0, 1.0, 1.0],
        "ranking": [{"key": list(first), "evidence": 9.0, "rivals": list(rivals)}],
        "steps": [{"key": list(key), "coefficient": 104.0, "std": 2.0, "shape": {}} for key in keys], "seconds": 1.0,
    } | more  # fmt: skip


# --- the plan


def test_plan_has_over_a_thousand_cases_with_a_judging_seed_each():
    cases = plan()
    assert len(cases) >= 1000
    assert {case.seed for case in cases} == set(range(SEEDS, SEEDS + len(cases)))
    assert [case.name for case in plan(1)] == [case._replace(seed=n + 1).name for n, case in enumerate(cases)]


def test_every_effect_of_every_structure_is_asked_for_at_every_noise_in_one_recording_and_two():
    usual = [case for case in plan() if case.size == 1.0 and case.rate == FULL]
    asked = {(case.structure, case.effects, case.noise, case.speeds) for case in usual}
    for structure in STRUCTURES:
        for noise in (0.5, 1.0, 2.0):
            assert {(structure, (), noise, speeds) for speeds in (TWO, ONE)} <= asked
            assert {(structure, (effect,), noise, TWO) for effect in hideable(structure)} <= asked
    assert sum(len(case.effects) == 2 for case in plan()) >= 50
    assert {case.size for case in plan()} == {1.0, 0.5, 0.25, 0.125}
    assert {case.noise for case in plan()} == {0.5, 1.0, 2.0, 5.0, 10.0}
    assert {case.rate for case in plan()} == {1e3, 1e4}


def test_any_beginning_of_the_plan_is_a_sample_of_the_whole():
    kinds = [kind_of(case) for case in plan()]
    for kind in ("nothing", "one", "two", "outside"):
        share = kinds.count(kind) / len(kinds)
        assert_allclose(kinds[:300].count(kind) / 300, share, atol=0.06)  # 2 sigma of 300 draws


def test_a_name_is_its_case():
    assert all(case_of(case.name) == case for case in plan())
    like = "dummy/coulomb_friction/1/1g/10000Hz/0.75,1.1/1"
    with pytest.raises(RecordingError, match=f"name is written like {like}, got 'x'"):
        case_of("x")


# --- the judgement


def test_right_is_the_hidden_effect_first_on_its_target_and_said_to_be_missing():
    assert right_first(row())
    assert not right_first(row(first=("viscous_damping", "other")))
    assert not right_first(row(first=("quadratic_damping", "car_barrier")))
    assert not right_first(row(verdict="adequate")) and not right_first(row(verdict="unexplained"))
    assert not right_first(row(verdict="error", ranking=[]))


def test_a_load_path_has_no_direction():
    hidden = [{"effect": "load_path", "target": "mdb-car", "coefficient": 1.0}]
    assert right_first(row(first=("load_path", "car-mdb"), hidden=hidden))


def test_a_wrong_answer_can_name_the_right_one_as_its_rival():
    wrong = ("quadratic_damping", "car_barrier")
    assert rival_named(row(first=wrong, rivals=["viscous_damping on car_barrier"]))
    assert not rival_named(row(first=wrong, rivals=["viscous_damping on other"])) and not rival_named(row(first=wrong))


@pytest.mark.parametrize(("stop", "counts"), [(0.0505, True), (0.054, False)])
def test_a_stop_where_the_hidden_gap_closes_is_that_gap(stop, counts):
    gap = {"effect": "clearance", "target": "car_barrier", "coefficient": 0.05}
    found = row(first=("bottoming_out", "car_barrier"), hidden=[gap])
    found["ranking"][0]["shape"] = {"stop": stop}
    assert right_first(found) is counts and pull(found) is None
    found["hidden"][0]["target"] = "other"
    assert not right_first(found)


def test_two_effects_are_found_in_any_order_and_nothing_beside_them():
    a, b = ("viscous_damping", "car_barrier"), ("channel_gain", "car_ax")
    hidden = [{"effect": e, "target": t, "coefficient": 1.0} for e, t in (a, b)]
    assert both_found(row(steps=[b, a], hidden=hidden))
    assert not both_found(row(steps=[a], hidden=hidden))
    assert not both_found(row(steps=[a, b, ("added_mass", "car")], hidden=hidden))


def test_pull_is_the_error_in_standard_deviations_of_a_right_answer():
    assert pull(row()) == 2.0
    assert pull(row(first=("viscous_damping", "other"))) is None


def test_each_kind_has_its_wanted_answer():
    for hidden, verdict in [((), "adequate"), (("rotation",), "unexplained")]:
        kind = kind_of(CASE._replace(effects=hidden))
        assert WANTED[kind](row(verdict)) and not WANTED[kind](row("effect_missing"))


def test_a_case_that_cannot_be_drawn_and_a_search_that_breaks_are_told_not_raised(monkeypatch):
    assert "no target" in judge(CASE._replace(effects=("load_path",)))["not_drawn"]
    monkeypatch.setattr("crash_estimator.benchmarks.effects_judge.diagnose", lambda *_: 1 / 0)
    broken = judge(CASE)
    assert (broken["verdict"], broken["error"]) == ("error", "ZeroDivisionError: division by zero")


# --- shares


def test_wilson_interval_has_its_published_values():
    """R. G. Newcombe, Statistics in Medicine 17 (1998), table I, method 3: 81 of 263, 15 of 148, 0 of 20, 1 of 29."""
    for share, interval in [
        (Share(81, 263), (0.2553, 0.3662)), (Share(15, 148), (0.0624, 0.1605)), (Share(0, 20), (0.0, 0.1611)),
        (Share(1, 29), (0.0061, 0.1718)),
    ]:  # fmt: skip
        assert_allclose(share.interval, interval, atol=5e-5)
    assert str(Share(0, 0)) == "-" and Share(0, 0).interval == (0.0, 1.0)


def test_median_of_even_and_odd():
    assert (median([3.0, 1.0, 2.0]), median([4.0, 1.0, 2.0, 3.0])) == (2.0, 2.5)


# --- results and page


def test_results_that_were_cut_off_or_made_by_other_code_are_not_counted(tmp_path):
    path = tmp_path / "results.jsonl"
    append(path, row(code=effects_results.code()))
    append(path, row(case=CASE._replace(seed=6), code="other"))
    path.write_text(path.read_text() + '{"case": "single/no')
    append(path, row(case=CASE._replace(seed=7), code=effects_results.code()))
    assert set(read(path)) == {CASE.name, CASE._replace(seed=7).name}


def test_page_counts_what_the_rows_say():
    none = CASE._replace(effects=())
    rows = [
        row(), row(case=CASE._replace(seed=6)), row(case=CASE._replace(seed=7), first=("channel_gain", "car_ax")),
        row("adequate", case=none, hidden=[], steps=[]),
        row(
            case=CASE._replace(speeds=ONE), first=("channel_gain", "car_ax"), rivals=["viscous_damping on car_barrier"]
        ),
        {"case": CASE._replace(seed=9).name, "not_drawn": "no target"},
    ]  # fmt: skip
    text = page(rows, [{"time": {"wall": 2.0, "cpu": 1.9, "updates": [0.1, 0.2]}}], 6, "abc")
    assert "5 cases judged of 6 planned, 1 could not be drawn; code abc" in text
    assert "| right effect and target first, two recordings, 0.5 to 2 g | 98 % | 67 % (21 to 94) of 3 |" in text
    assert "| `adequate` where nothing is hidden, two recordings | 98 % | 100 % (21 to 100) of 1 |" in text
    assert "| one recording: wrong, and its rival not named | none | 0 of 1 |" in text
    assert "| `viscous_damping` | - | 2/3 | - | 67 % (21 to 94) of 3 | 0 % (0 to 79) of 1 |" in text
    wrong = "viscous_damping on car_barrier | effect_missing | channel_gain on car_ax"
    assert f"| {CASE._replace(seed=7).name} | {wrong} |" in text


def test_page_of_nothing_is_a_page():
    assert "0 cases judged of 6 planned" in page([], [], 6, "abc")


def run(monkeypatch, *arguments) -> int:
    monkeypatch.setattr(sys, "argv", ["effects", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        effects.main()
    return ended.value.code


def test_a_run_is_resumed_where_it_was_and_writes_its_page(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(effects, "TIMED", ())
    results, to = tmp_path / "results.jsonl", tmp_path / "docs" / "page.md"
    arguments = ["--seeds-from", DEVELOPMENT, "--like", "impactor/", "--processes", 1, "--results", results, "--to", to]
    assert run(monkeypatch, "--cases", 4, *arguments) == 0
    kept = results.read_text()
    rows = [json.loads(line) for line in kept.splitlines()]
    asked = [case.name for case in plan(DEVELOPMENT)[:4] if case.structure == "impactor"]
    assert [line["case"] for line in rows] == asked and len(asked) == 2
    assert all("verdict" in line for line in rows)
    assert "2 cases judged of 2 planned" in to.read_text()
    capsys.readouterr()
    assert run(monkeypatch, "--cases", 4, *arguments) == 0
    assert results.read_text() == kept and f"2 cases, 2 of them in {results}" in capsys.readouterr().out


def test_time_is_taken_of_the_search_and_of_every_live_update():
    taken = timed(CASE)
    assert taken["case"] == f"time {CASE.name}"
    assert taken["time"]["wall"] > 0.0 and taken["time"]["cpu"] > 0.0
    assert 40 < len(taken["time"]["updates"]) < 56 and min(taken["time"]["updates"]) > 0.0  # 110 ms in steps of 2 ms


def test_make_help_shows_it():
    root = ROOT
    shown = subprocess.run(["make", "help"], cwd=root, capture_output=True, text=True, check=True)
    assert "make benchmark-effects\t" in shown.stdout


def test_one_case_by_its_name_shows_its_row(monkeypatch, capsys):
    assert run(monkeypatch, "--case", CASE.name) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["case"] == CASE.name and right_first(shown)
    assert run(monkeypatch, "--case", "single") == 1
    assert capsys.readouterr().err.startswith("error: a case's name is written like")
