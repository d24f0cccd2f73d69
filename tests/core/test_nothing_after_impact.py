"""A recording that ends before the impact: one clear line, and no table of what was there before it."""

import sys

import pytest
from helpers_paths import BAGS

from crash_estimator.cli import diagnose, estimate, report, simulate
from crash_replay.bag import read_bag, write_bag
from crash_replay.recording import Recording


@pytest.fixture(scope="module")
def early(tmp_path_factory):
    whole = read_bag(BAGS / "frontal_single.mcap")
    before = whole.time_ns < 0
    bag = tmp_path_factory.mktemp("early") / "early.mcap"
    write_bag(Recording(whole.test, whole.time_ns[before], whole.values[before]), bag)
    return bag


@pytest.mark.parametrize("command", [estimate, simulate, report, diagnose], ids=lambda command: command.__name__[20:])
def test_nothing_after_the_impact_is_said(command, early, tmp_path, monkeypatch, capsys):
    to = ["--to", str(tmp_path)] if command is report else []
    monkeypatch.setattr(sys, "argv", ["command", str(early), "--model", "frontal_single", *to])
    with pytest.raises(SystemExit) as status:
        command.main()
    said = capsys.readouterr()
    assert status.value.code == 1 and said.out == ""
    assert "impact" in said.err and said.err.count("\n") == 1
