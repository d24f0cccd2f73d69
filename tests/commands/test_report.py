"""The commands `simulate` and `report`: what they write, and one clear line where something is at fault."""

import json
import re
import sys
from dataclasses import replace
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest
from helpers_paths import BAGS
from numpy.testing import assert_allclose

from crash_estimator.cli import report, simulate
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.structure import EffectSpec
from crash_estimator.figures import Line, Panel
from crash_estimator.first_sentence import first_sentence
from crash_estimator.model_file import load_model
from crash_estimator.page_blocks import Bullets, Figure, Heading, Lines, Page, Paragraph, Table
from crash_estimator.page_html import html_page
from crash_estimator.report_page import _estimated
from crash_estimator.svg_panel import round_ticks, thinned
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


def test_a_report_is_one_page_that_needs_nothing_else(monkeypatch, capsys, tmp_path):
    arguments = ["--model", "side_mdb_door_car", "--to", tmp_path, "--methods", "rls", "mrls", "--end", "0.06"]
    assert run(monkeypatch, report, BAGS / "side_abrupt.mcap", *arguments, "--markdown") == 0
    said = capsys.readouterr().err
    for part in ("diagnosis: ", "estimates by rls: ", "free run: ", "page: "):
        assert part in said and " s of processor" in said
    page = (tmp_path / "report.html").read_text()
    for part in ("table", "Free run", "Jumps", "Effective masses", "mdb_door.stiffness", "error door", "rls"):
        assert part in page
    first = re.search(r'<p class="first">(.*?)</p>', page)[1]
    assert first.startswith("Model side_mdb_door_car ") and "side_abrupt" in first and "may be wrong" not in first
    svgs = re.findall(r"<svg.*?</svg>", page, re.S)
    assert len(svgs) >= 8 and all(ElementTree.fromstring(svg) is not None for svg in svgs)
    assert all("<path" in svg for svg in svgs)
    assert not re.search(r"https?:|src=|<script|<link|url\((?!#)|@import", page), "nothing is fetched, nothing runs"

    markdown = (tmp_path / "report.md").read_text()
    named = {line.split("](")[1].rstrip(")") for line in markdown.splitlines() if line.startswith("![")}
    assert named <= {path.name for path in tmp_path.iterdir()} and len(named) >= 5
    for name in named:
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")


def test_nothing_of_a_recording_is_obeyed_by_the_page():
    foreign = '<script>alert(1)</script>\x1b[31m & "quoted"'
    line = Line(np.arange(3.0), np.array([0.0, np.nan, 1.0]), foreign, spread=np.ones(3))
    panel = Panel(foreign, foreign, foreign, [line], levels=[(0.5, foreign)], marks=[(1.0, foreign)])
    blocks = [Paragraph(foreign), Heading(foreign), Bullets([foreign]), Lines(foreign), Table([foreign], [[foreign]])]
    page = html_page(Page(foreign, [*blocks, Figure("f", [panel])]))
    assert "<script" not in page and "\x1b" not in page and page.count("&lt;script&gt;") >= 12
    ElementTree.fromstring(re.search(r"<svg.*?</svg>", page, re.S)[0])


def test_a_long_line_is_thinned_and_keeps_its_peaks():
    y = np.random.default_rng(1).normal(size=20_000)
    y[7777], y[12_345] = 50.0, -60.0
    x, thin = thinned(Line(np.arange(20_000.0), y))
    assert len(x) < 1000 and (thin.max(), thin.min()) == (50.0, -60.0) and (np.diff(x) > 0).all()
    assert_allclose(round_ticks(-0.3, 97.0), [0, 20, 40, 60, 80])
    assert_allclose(round_ticks(1e-3, 2e-3), [1e-3, 1.2e-3, 1.4e-3, 1.6e-3, 1.8e-3, 2e-3])


def test_the_first_sentence_says_what_matters_first():
    rms = SimpleNamespace(before=41.0, after=9.9, noise_floor=9.7)
    step = SimpleNamespace(effect="coulomb_friction", target="rib_spine", coefficient=1413.2, std=6.1, unit="N")
    missing = SimpleNamespace(verdict="effect_missing", residual_rms=rms, steps=(step,), complete=True)
    assert first_sentence(missing, "dummy", "T1") == (
        "Model dummy lacks coulomb friction on rib_spine (1413 ± 6.1 N): with it the error on test T1 falls from "
        "4.18 g to "
        "1.01 g RMS; the sensors' noise is 0.989 g."
    )
    right = SimpleNamespace(
        verdict="adequate", residual_rms=SimpleNamespace(before=9.8, after=9.8, noise_floor=9.7), steps=()
    )
    assert first_sentence(right, "dummy", "T1").startswith(
        "Model dummy reproduces test T1 to within the sensors' noise"
    )
    unknown = SimpleNamespace(verdict="unexplained", residual_rms=rms, steps=())
    assert "4.2 times the sensors' noise, and no physical effect that was tried explains it" in first_sentence(
        unknown, "dummy", "T1"
    )


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
    from crash_estimator.figures import draw

    x = np.linspace(0.0, 1.0, 20)
    panel = Panel("a", "x", "y", [Line(x, x**2, "one", spread=0.1 + x)], levels=[(0.5, "half")], marks=[(0.3, "here")])
    first, second = (draw(tmp_path / f"{k}.png", [panel, panel, panel]).read_bytes() for k in (1, 2))
    assert first == second
