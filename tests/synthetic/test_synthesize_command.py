"""The command `synthesize`: it writes a recording, its truth and its model, and refuses what it cannot make."""

import pytest
from helpers_synthetic import synthesize
from numpy.testing import assert_array_equal
from ruamel.yaml import YAML

from crash_estimator.model_file import load_model
from crash_replay.bag import read_bag
from crash_replay.synthetic.hidden.cases import draw_case
from crash_replay.synthetic.recordings import SCENARIOS


def test_command_writes_a_bag_and_its_truth(tmp_path, monkeypatch, capsys):
    bag = tmp_path / "mine.mcap"
    assert synthesize(monkeypatch, "impactor_single", "--to", str(bag), "--seed", "3") == 0
    assert_array_equal(read_bag(bag).values, SCENARIOS["impactor_single"](3)[0].values)
    assert "seed: 3" in (tmp_path / "mine.truth.yaml").read_text()
    assert "1001 samples, 3 channels; truth in mine.truth.yaml" in capsys.readouterr().out


def test_command_keeps_what_is_there_unless_forced(tmp_path, monkeypatch, capsys):
    bag = tmp_path / "mine.mcap"
    arguments = "impactor_single", "--rate", "1000", "--to", str(bag)
    assert synthesize(monkeypatch, *arguments) == 0
    capsys.readouterr()
    assert synthesize(monkeypatch, *arguments, "--noise", "2") == 1
    said = capsys.readouterr()
    assert said.out == "" and said.err.count("\n") == 1 and "exists already" in said.err and "--force" in said.err
    assert synthesize(monkeypatch, *arguments, "--noise", "2", "--force") == 0
    assert_array_equal(read_bag(bag).values, SCENARIOS["impactor_single"](rate=1000.0, noise=2.0)[0].values)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["frontal_singel", "--to", "x.mcap"], "invalid choice: 'frontal_singel'"),
        (["frontal_single"], "the argument --to is required"),
        (
            ["frontal_single", "--to", "x.mcap", "--noise", "-1"],
            "argument --noise: expected a number of 0 or more, got '-1'",
        ),
        (
            ["frontal_single", "--to", "x.mcap", "--seed", "one"],
            "argument --seed: expected a whole number of 0 or more",
        ),
        ([], "one of the arguments SCENARIO --all --list is required"),
    ],
)
def test_command_refuses_wrong_usage(arguments, complaint, monkeypatch, capsys):
    assert synthesize(monkeypatch, *arguments) == 2
    assert complaint in capsys.readouterr().err


def test_command_lists_every_scenario(monkeypatch, capsys):
    assert synthesize(monkeypatch, "--list") == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == list(SCENARIOS)


def test_command_hides_an_effect_and_writes_model_and_truth_beside(tmp_path, monkeypatch, capsys):
    bag = tmp_path / "mine.mcap"
    settings = ["--hide", "viscous_damping:door_car", "--hide", "channel_gain", "--seed", "4", "--rate", "1000"]
    assert synthesize(monkeypatch, "side", *settings, "--size", "0.5", "--to", str(bag)) == 0
    assert "model in mine.model.yaml" in capsys.readouterr().out
    case = draw_case("side", ["viscous_damping", "channel_gain"], 4, 0.5, {"viscous_damping": "door_car"})
    assert_array_equal(read_bag(bag).values, case.record(rate=1000.0)[0].values)
    load_model(tmp_path / "mine.model.yaml")
    hidden = YAML(typ="safe", pure=True).load((tmp_path / "mine.truth.yaml").read_text())["hidden"]
    assert [(h["effect"], h["target"]) for h in hidden][0] == ("viscous_damping", "door_car")


@pytest.mark.parametrize(
    ("arguments", "status", "complaint"),
    [
        (["side", "--hide", "rust"], 2, "argument --hide: expected none or one of viscous_damping"),
        (["side"], 2, "--hide goes with one of frontal, single, side, dummy, impactor"),
        (["frontal_single", "--hide", "none"], 2, "--hide goes with one of frontal"),
        (["single", "--hide", "added_mass:car"], 1, "added_mass on car cannot be told in structure single: it has no"),
        (["dummy", "--hide", "clearance:nose"], 1, "clearance on nose cannot be told in structure dummy: it can be on"),
    ],
)
def test_command_says_what_it_cannot_hide(arguments, status, complaint, tmp_path, monkeypatch, capsys):
    assert synthesize(monkeypatch, *arguments, "--to", str(tmp_path / "x.mcap")) == status
    assert complaint in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
