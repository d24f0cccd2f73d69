"""What the demonstration is made of: the choice of recording and estimators, the domain, the terminal."""

import socket
import sys
from dataclasses import replace

import numpy as np
import pytest
from helpers_domain import OWN_DOMAINS
from helpers_paths import BAGS
from numpy.testing import assert_allclose

from crash_estimator.core.structure import ModelError
from crash_estimator.demo.choice import Choice, as_bag, choose, default_rate, model_beside, simplest_model
from crash_estimator.demo.domain import DOMAINS, free_domain, own_environment
from crash_estimator.demo.folder import claim
from crash_estimator.demo.terminal import Terminal, bar
from crash_estimator.ready_models import ready_models
from crash_replay.bag import read_bag
from crash_replay.recording import RecordingError

BAG = BAGS / "frontal_engine_cab.mcap"
ESTIMATORS = ("mrls", "constrained_kalman")


@pytest.fixture(scope="module")
def recording():
    return read_bag(BAG)


def test_the_bundled_recording_is_missed_with_a_line(tmp_path, monkeypatch, capsys):
    from crash_estimator.demo import choice

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(choice, "__file__", str(tmp_path / "somewhere/choice.py"))
    with pytest.raises(RecordingError, match=r"bags/hidden_effect\.mcap is not in .* start in the project's folder"):
        choice.bundled_recording()


class TestChoice:
    def test_one_model_with_two_methods_two_models_with_one(self, recording):
        models = ("frontal_engine_cab", "frontal_single")
        assert choose(recording.test) == [Choice(m, m, "constrained_kalman") for m in models]
        assert choose(recording.test, by_default=models[:1]) == [Choice(m, models[0], m) for m in ESTIMATORS]

    def test_what_is_asked_for_comes_before_the_default(self, recording):
        asked = choose(recording.test, ["frontal_single"], ["rls"], by_default=["frontal_engine_cab"])
        assert asked == [Choice("frontal_single", "frontal_single", "rls")]
        both = choose(recording.test, ["frontal_single", "frontal_engine_cab"], ["rls", "mrls"])
        assert [choice.name for choice in both] == [
            "frontal_single_rls", "frontal_single_mrls", "frontal_engine_cab_rls", "frontal_engine_cab_mrls",
        ]  # fmt: skip

    def test_every_bundled_recording_has_a_model(self):
        found = {bag.stem: [c.model for c in choose(read_bag(bag).test)] for bag in sorted(BAG.parent.glob("*.mcap"))}
        assert all(found.values())
        assert found["side_dummy_padded"][0] == "side_dummy"
        assert found["side_mdb_door_car"][0] == "side_mdb_door_car"
        assert found["impactor_single"] == ["impactor_single", "impactor_spring"]

    def test_a_search_begins_with_the_recordings_own_model_or_the_simplest(self, recording):
        assert simplest_model(recording.test) == "frontal_single"
        assert simplest_model(read_bag(BAG.with_name("impactor_single.mcap")).test) == "impactor_spring"
        assert model_beside(BAG) is None
        own = model_beside(BAG.with_name("hidden_effect.mcap"))
        assert own == str(BAG.with_name("hidden_effect.model.yaml"))
        hidden = read_bag(BAG.with_name("hidden_effect.mcap")).test
        assert [c.name for c in choose(hidden, [own], ["rls"])] == ["hidden_effect"]

    def test_no_model_fits(self, recording):
        channels = (
            tuple(replace(c, name=f"my_{c.name}") for c in recording.test.channels[:2]) + recording.test.channels[2:]
        )
        with pytest.raises(ModelError) as error:
            choose(replace(recording.test, channels=channels))
        for part in (
            "my_car_ax, my_engine_ax, barrier_fx",
            "nearest is frontal_single, which also wants car_ax",
            "--model",
        ):
            assert part in str(error.value)

    def test_names_of_model_files_become_names_of_nodes(self, recording, tmp_path):
        own, twin = tmp_path / "1 my-car.yaml", tmp_path / "other/1 my-car.yaml"
        twin.parent.mkdir()
        for path in (own, twin):
            path.write_text(ready_models()["frontal_single"].read_text())
        assert [c.name for c in choose(recording.test, [str(own)], ["rls"])] == ["model_1_my_car"]
        with pytest.raises(ModelError, match="two models are called model_1_my_car"):
            choose(recording.test, [str(own), str(twin)], ["rls"])


def test_demonstrations_of_one_recording_side_by_side_have_folders_of_their_own(tmp_path):
    with claim(tmp_path, BAG) as first, claim(tmp_path, BAG) as second, claim(tmp_path, tmp_path) as other:
        names = [folder.name for folder in (first, second, other)]
        assert names == ["frontal_engine_cab", "frontal_engine_cab-2", tmp_path.name]
        (first / "demo.rrd").touch()
    with claim(tmp_path, BAG) as again:
        assert again == first, "free again, with what the other has left"
    assert not second.exists() and first.exists(), "an empty one is not left behind"


class TestSource:
    def test_a_bag_stays_where_it_is(self, tmp_path):
        assert as_bag(BAG, tmp_path)[1:] == (BAG, [])
        assert not list(tmp_path.iterdir())

    def test_anything_else_is_imported_and_the_lines_say_how(self, tmp_path):
        csv = tmp_path / "rib.csv"
        csv.write_text("time,rib_ay,extra\n-0.001,0,0\n0.0,1,0\n0.001,2,0\n")
        csv.with_suffix(".yaml").write_text(
            "channels: {rib_ay: {quantity: acceleration, unit: g, body: rib, axis: y}}\n"
        )
        imported, bag, lines = as_bag(csv, tmp_path / "out")
        assert bag == tmp_path / "out/rib.mcap"
        assert_allclose(read_bag(bag).values[:, 0], [0.0, 9.80665, 19.6133])  # not filtered
        assert lines[0] == f"imported {csv} to {bag}:" and "extra" in lines[1]
        as_bag(csv, tmp_path / "out")  # again, over the first

    def test_a_laboratorys_folder_is_filtered_unless_told_otherwise(self, tmp_path, monkeypatch, recording):
        from crash_estimator.demo import choice

        monkeypatch.setattr(choice, "read_source", lambda path: recording)
        folder = tmp_path / "v10146"
        folder.mkdir()
        noise = {}
        for cfc in (None, 60, 1000, 0):
            filtered, _, lines = as_bag(folder, tmp_path, cfc)
            noise[cfc] = np.std(filtered.values[:400, 0])
            assert any("CFC" in line for line in lines) == (cfc != 0)
        assert noise[None] == noise[60] < noise[1000] < noise[0] == np.std(recording.values[:400, 0])


@pytest.mark.parametrize(
    ("duration", "rate"),
    [(0.15, 0.01), (0.19, 0.01), (0.35, 0.02), (0.08, 0.005), (0.06, 0.005), (15.0, 1.0), (1e-9, 1e-6)],
)
def test_a_replay_takes_about_15_s(duration, rate):
    assert default_rate(duration) == rate


def test_the_domain_is_free_and_the_users_own_is_kept(monkeypatch):
    assert free_domain() in DOMAINS
    monkeypatch.delenv("ROS_DOMAIN_ID", raising=False)
    assert int(own_environment()["ROS_DOMAIN_ID"]) in DOMAINS
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    assert own_environment()["ROS_DOMAIN_ID"] == "7"


def test_a_domain_in_use_is_passed_over():
    used, free = OWN_DOMAINS[-2:]  # no other test process takes these
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("0.0.0.0", 7400 + 250 * used + 10))
        assert {free_domain((used, free)) for _ in range(20)} == {free}


class TestTerminal:
    class Tty:
        encoding = "utf-8"

        def __init__(self):
            self.text = ""

        def isatty(self):
            return True

        def write(self, text):
            self.text += text

        def flush(self):
            pass

    def test_lines_go_above_the_progress_line(self):
        tty = self.Tty()
        terminal = Terminal(tty)
        terminal.progress("10 %")
        terminal.say("viewer: here")
        assert tty.text == "\r\x1b[K10 %\r\x1b[Kviewer: here\n10 %"
        terminal.end_progress("100 %")
        terminal.say("done")
        assert tty.text.endswith("\r\x1b[K100 %\ndone\n")

    def test_a_line_is_cut_to_the_terminals_width(self, monkeypatch):
        monkeypatch.setenv("COLUMNS", "20")
        tty = self.Tty()
        Terminal(tty).progress("x" * 50)
        assert tty.text == "\r\x1b[K" + "x" * 19

    def test_in_a_file_lines_stay_and_are_not_repeated(self, capsys):
        terminal = Terminal(sys.stdout)
        for seconds in range(3):
            terminal.wait("waiting for mrls", seconds)
        for k in range(3):
            terminal.progress(f"{k} %")
        assert capsys.readouterr().out == "waiting for mrls\n0 %\n"

    def test_the_bar_keeps_to_the_characters_there_are(self):
        assert bar(0.5, "utf-8") == "█" * 12 + "░" * 12
        assert bar(1.2, "ascii") == "#" * 24
        assert bar(-1.0, None) == "." * 24
