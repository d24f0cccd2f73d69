"""The commands `simulate` and `report`: what they write, and one clear line where something is at fault."""

import json
import sys
from dataclasses import replace

import numpy as np
import pytest
from helpers_paths import BAGS

from crash_estimator.cli import report, simulate
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.structure import EffectSpec
from crash_estimator.model_file import load_model
from crash_estimator.report_page import _estimated
from crash_replay.bag import read_bag


def run(monkeypatch, command, *arguments):
    monkeypatch.setattr(sys, "argv", [command.__name__, *map(str, arguments)])
    with pytest.raises(SystemExit) as status:
        command.main()
    return status.value.code


def test_simulate_rates_the_free_run_and_writes_it(monkeypatch, capsys, tmp_path):
    out = tmp_path / "free.json"
    bag = BAGS / "frontal_single.mcap"
    assert run(monkeypatch, simulate, bag, "--model", "frontal_single", "--end", "0.1", "--json", out) == 0
    printed = capsys.readouterr().out
    assert "car_barrier" in printed and "excellent" in printed and "compared at CFC 60" in printed
    found = json.loads(out.read_text())
    assert found["comparisons"]["car"]["rating"]["overall"] > 0.9
    series = found["series"]
    lengths = {len(series["time"]), len(series["simulated"]["barrier"]), len(series["velocity"]["car"])}
    assert lengths == {1001}
    assert found["characteristics"]["car_barrier"]["unloading"] > 1e7


def test_the_forces_of_another_test_predict_another_crash(monkeypatch, capsys):
    """Section 6.6: the padded door's motion with the unpadded interior hits the rib harder."""
    own, other = BAGS / "side_dummy_padded.mcap", BAGS / "side_dummy_unpadded.mcap"
    peaks = []
    for more in ([], ["--from", other]):
        assert run(monkeypatch, simulate, own, "--model", "side_dummy", "--end", "0.05", *more) == 0
        line = next(x for x in capsys.readouterr().out.splitlines() if x.startswith("rib  "))
        peaks.append(float(line.split()[3]))
    assert peaks[1] > 1.2 * peaks[0]


def test_a_fault_is_one_line_and_status_1(monkeypatch, capsys, tmp_path):
    bag = BAGS / "frontal_single.mcap"
    for command, arguments, said in (
        (simulate, [tmp_path / "none.mcap", "--model", "frontal_single"], "none.mcap"),
        (simulate, [bag, "--model", "side_dummy"], "rib_ay"),
        (simulate, [bag, "--model", "frontal_single", "--end", "-1"], "--end must be a time after the impact"),
        (report, [bag, "--model", "frontal_single", "--to", bag], "--to takes a folder"),
        (report, [bag, "--model", "frontal_single", "--to", tmp_path, "--end", "-1"], "no samples between"),
    ):
        assert run(monkeypatch, command, *arguments) == 1
        error = capsys.readouterr().err
        assert error.startswith("error: ") and error.count("\n") == 1 and said in error
    assert run(monkeypatch, report, bag, "--model", "frontal_single") == 2


def test_a_report_is_a_page_with_its_figures(monkeypatch, capsys, tmp_path):
    pytest.importorskip("matplotlib")
    arguments = ["--model", "side_mdb_door_car", "--to", tmp_path, "--methods", "rls", "mrls", "--end", "0.06"]
    assert run(monkeypatch, report, BAGS / "side_abrupt.mcap", *arguments) == 0
    page = (tmp_path / "report.md").read_text()
    for part in ("table", "Free run", "Jumps", "Effective masses", "mdb_door.stiffness", "error door", "rls"):
        assert part in page
    named = {line.split("](")[1].rstrip(")") for line in page.splitlines() if line.startswith("![")}
    assert named <= {path.name for path in tmp_path.iterdir()} and len(named) >= 5
    for name in named:
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")


def test_a_load_path_of_the_model_is_one_more_element():
    """It acts in the equations of its two bodies and in no other."""
    model = load_model("side_mdb_door_car")
    model = replace(model, effects=(EffectSpec("load_path", "mdb-car", 1e4),))
    recording = read_bag(BAGS / "side_mdb_door_car.mcap")
    found = _estimated(recording, model, "rls", np.inf, {}, EFFECTS).validation
    told = {e.equation: {name.split(".")[0] for name in e.cross} for e in found.equations}
    assert told["door"] == {"mdb_door", "door_car"} and told["car"] == {"door_car", "mdb-car"}


def test_figures_are_the_same_bytes_again(tmp_path):
    pytest.importorskip("matplotlib")
    from crash_estimator.figures import Line, Panel, draw

    x = np.linspace(0.0, 1.0, 20)
    panel = Panel("a", "x", "y", [Line(x, x**2, "one", spread=0.1 + x)], levels=[(0.5, "half")], marks=[(0.3, "here")])
    first, second = (draw(tmp_path / f"{k}.png", [panel, panel, panel]).read_bytes() for k in (1, 2))
    assert first == second
