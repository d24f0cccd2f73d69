"""When a search ends though not everything was tried: after so many iterations, or a stated time."""

import numpy as np
import pytest
from helpers_paths import ROOT

from crash_estimator.cli import diagnose as command
from crash_estimator.core.diagnosis import diagnose
from crash_estimator.core.diagnosis.selection import search_limit
from crash_estimator.model_file import load_model
from crash_replay.bag import read_bag
from crash_replay.gravity import G
from crash_replay.recording import Recording, RecordingError

FRONTAL = ROOT / "bags" / "frontal_single.mcap"


def test_a_search_ends_after_a_number_of_iterations_unless_a_time_is_stated(monkeypatch):
    structure, recordings = load_model("frontal_single"), [read_bag(FRONTAL)]
    for most in (120, 300):  # those of the search before do not count
        monkeypatch.setattr(search_limit, "LONGEST_SEARCH", most)
        hurried = diagnose(structure, recordings)
        assert hurried.stopped and f"stopped after {most} iterations" in hurried.text
        fitted = [one.fitted for one in hurried.ranking]
        assert any(fitted) and not all(fitted)
    whole = diagnose(structure, recordings, seconds=float("inf"))
    assert not whole.stopped and "stopped" not in whole.text


def test_a_wrong_unit_is_named_though_the_search_has_ended_after_its_iterations(monkeypatch):
    recording = read_bag(FRONTAL)
    values = recording.values.copy()
    values[:, recording.test.index("barrier_fx")] *= G
    monkeypatch.setattr(search_limit, "LONGEST_SEARCH", 20)
    with pytest.raises(RecordingError, match="channel barrier_fx is 9.807 times too large"):
        diagnose(load_model("frontal_single"), [Recording(recording.test, recording.time_ns, values)])


def test_a_time_limit_is_above_zero(monkeypatch, capsys):
    for wrong in ("0", "-1", "nan", "soon"):
        monkeypatch.setattr("sys.argv", ["diagnose", str(FRONTAL), "--model", "frontal_single", "--time-limit", wrong])
        with pytest.raises(SystemExit) as ended:
            command.main()
        assert ended.value.code == 2 and "seconds above 0" in capsys.readouterr().err


def test_a_search_within_another_has_half_of_what_that_has_left(monkeypatch):
    made = [100]
    monkeypatch.setattr(search_limit, "iterations_made", lambda: made[0])
    monkeypatch.setattr(search_limit, "LONGEST_SEARCH", 1000)
    with search_limit.search_limit(None):
        made[0] = 500  # 600 are left
        with search_limit.half_of_what_is_left():
            made[0] = 800
            assert not search_limit.search_is_over()
            made[0] = 801
            assert search_limit.search_is_over()
        assert not search_limit.search_is_over()
        made[0] = 1101
        assert search_limit.search_is_over()
    with search_limit.search_limit(np.inf), search_limit.half_of_what_is_left():
        assert not search_limit.search_is_over()
