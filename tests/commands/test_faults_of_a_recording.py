"""What is not to be estimated from a recording, each command says in one line; or what its numbers are worth."""

import sys

import numpy as np
import pytest
from helpers_paths import BAGS

from crash_estimator.cli import diagnose, estimate, report, simulate
from crash_replay.bag import read_bag, write_bag
from crash_replay.recording import Recording

BAG = BAGS / "frontal_engine_cab.mcap"


def run(monkeypatch, command, *arguments):
    monkeypatch.setattr(sys, "argv", [command.__name__, *map(str, arguments), "--model", "frontal_engine_cab"])
    with pytest.raises(SystemExit) as status:
        command.main()
    return status.value.code


@pytest.mark.parametrize("command", [estimate, simulate, report])
def test_a_channel_without_a_valid_sample_is_refused(monkeypatch, command, tmp_path, capsys):
    """A body's crush was told from it nevertheless, 824 mm for 612, with a stiffness of half the true one."""
    recording = read_bag(BAG)
    values = recording.values.copy()
    values[:, recording.test.index("car_ax")] = np.nan
    write_bag(Recording(recording.test, recording.time_ns, values), tmp_path / "empty.mcap")
    to = ("--to", tmp_path / "page") if command is report else ()
    assert run(monkeypatch, command, tmp_path / "empty.mcap", *to) == 1
    said = capsys.readouterr()
    assert "channel car_ax has no valid sample: leave it out of the model" in said.err and not said.out


def test_a_recording_that_is_given_twice_is_refused(monkeypatch, capsys):
    """As two tests its evidence would count twice."""
    assert run(monkeypatch, diagnose, BAG, BAG) == 1
    assert "is given twice: its samples are those of test" in capsys.readouterr().err


@pytest.mark.parametrize("from_zero", [True, False])
def test_that_noise_is_unknown_is_said(monkeypatch, from_zero, tmp_path, capsys):
    """A force's noise is taken for 1 N then, and a stiffness of 900 kN/m was told to 0.0 kN/m."""
    recording = read_bag(BAG)
    kept = recording.time_ns >= 0 if from_zero else np.ones(len(recording), bool)
    write_bag(Recording(recording.test, recording.time_ns[kept], recording.values[kept]), tmp_path / "cut.mcap")
    assert run(monkeypatch, estimate, tmp_path / "cut.mcap") == 0
    said = "fewer than 20 samples before time zero tell the noise, so the sigmas may be far too small"
    assert (said in capsys.readouterr().out) == from_zero
