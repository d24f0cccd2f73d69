"""`import` as it is typed: exit status, what it says, what it writes; and its doubts about sensors."""

import json
import subprocess
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from crash_replay.bag import read_bag, write_bag
from crash_replay.conditioning import cfc_filter
from crash_replay.import_command import main
from crash_replay.recording import Channel, Recording, Test
from crash_replay.sensor_checks import doubtful_channels, gaps_in_time

T = np.arange(-500, 1500) * 1e-4  # s


@pytest.fixture
def source(tmp_path):
    """A half-sine pulse of 30 g with an offset and noise, and its barrier force."""
    rng = np.random.default_rng(3)
    pulse = (
        np.where((T >= 0) & (T < 0.08), -30.0 * np.sin(np.pi * T / 0.08), 0.0)
        + 0.2
        + rng.normal(scale=0.5, size=len(T))
    )
    lines = (f"{t:.4f},{a:.4f},{-a * 14.7:.4f},1" for t, a in zip(T, pulse))
    (tmp_path / "s.csv").write_text("time,car_ax,barrier_fx,trigger\n" + "\n".join(lines) + "\n")
    (tmp_path / "s.yaml").write_text(
        "test: {id: S1, title: Half sine}\n"
        "channels:\n"
        "  car_ax: {quantity: acceleration, unit: g, body: car, axis: x}\n"
        "  barrier_fx: {quantity: force, unit: kN, body: barrier, axis: x}\n"
        "initial_velocity: {car: 15.0}\n"
    )
    return tmp_path / "s.csv"


def run(*arguments):
    return main([str(argument) for argument in arguments])


def test_import_says_what_it_did_and_left_out(source, tmp_path, capsys):
    assert run(source, "--to", tmp_path / "bag", "--offset", "--cfc", 60, "--json", tmp_path / "f.json") == 0
    said = capsys.readouterr()
    assert said.err == ""
    for line in (
        "S1: Half sine",
        "2000 samples, 10 kHz, -0.0500 to 0.1499 s, 2 channels",
        "initial velocity 15 m/s: car",
        "  left out  why",
        "  trigger   not described in s.yaml",
        "- filtered with CFC 60 (SAE J211-1), all channels",
    ):
        assert line in said.out.splitlines()
    assert "- pre-impact mean removed: car_ax " in said.out
    found = json.loads((tmp_path / "f.json").read_text())
    assert found["samples"] == 2000 and found["test"]["id"] == "S1" and found["notes"][0].endswith("trigger")
    peak = found["channels"][0]["peak"]
    assert_allclose(peak["value"], -30 * 9.80665, rtol=0.02)
    assert_allclose(peak["time"], 0.04, atol=2e-3)

    bag = read_bag(tmp_path / "bag")
    before = bag.values[bag.time_ns < 0]
    assert_allclose(before.mean(axis=0) / np.abs(bag.values).max(axis=0), 0.0, atol=1e-3)
    assert list(bag.test.notes) == found["notes"]


def test_nothing_is_changed_unasked(source, tmp_path, capsys):
    assert run(source, "--to", tmp_path / "raw.mcap") == 0
    assert capsys.readouterr().out.splitlines()[-1] == "as recorded: zero offset kept (--offset), no filter (--cfc)"
    raw = np.loadtxt(source, delimiter=",", skiprows=1)
    assert_allclose(read_bag(tmp_path / "raw.mcap").column("car_ax"), raw[:, 1] * 9.80665, rtol=1e-14)


def test_a_bag_is_a_source_too(source, tmp_path):
    assert run(source, "--to", tmp_path / "raw") == 0
    assert run(tmp_path / "raw", "--to", tmp_path / "cfc180", "--cfc", 180, "--channels", "car_*") == 0
    raw, filtered = read_bag(tmp_path / "raw"), read_bag(tmp_path / "cfc180")
    assert filtered.test.channel_names == ("car_ax",)
    assert_array_equal(filtered.column("car_ax"), cfc_filter(raw.column("car_ax"), raw.sample_period, 180))


def test_recover(source, tmp_path, capsys):
    assert run(source, "--to", tmp_path / "b.mcap") == 0
    whole = (tmp_path / "b.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[:-2000])
    assert run(tmp_path / "cut.mcap", "--to", tmp_path / "c.mcap") == 1
    assert "--recover" in capsys.readouterr().err
    assert run(tmp_path / "cut.mcap", "--to", tmp_path / "c.mcap", "--recover") == 0
    assert_array_equal(read_bag(tmp_path / "c.mcap").values, read_bag(tmp_path / "b.mcap").values)


@pytest.mark.parametrize(
    "more, said",
    [
        (["--to", "{}/there.csv"], "there.csv exists already"),
        (["--to", "{}/there.csv", "--force"], "there.csv is not a bag of this form and is not replaced"),
        (["--to", "{}/b", "--channels", "door*"], "no channel matches 'door*'; channels: car_ax, barrier_fx"),
        (["--to", "{}/b", "--names", "{}/no.yaml"], "no.yaml: cannot be read as a YAML text file"),
        (["--to", "{}/b", "--cells"], "takes no option 'cells'"),
        (["--to", "{}/s.csv/b"], "s.csv cannot be a folder: it is a file"),
    ],
)
def test_data_at_fault_is_one_line_and_status_1(source, tmp_path, capsys, more, said):
    (tmp_path / "there.csv").touch()
    assert run(source, *(argument.format(tmp_path) for argument in more)) == 1
    error = capsys.readouterr().err
    assert error.startswith("error: ") and said in error and error.count("\n") == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["s.csv", "s.yaml", "there.csv"]


def test_usage_is_status_2(source):
    for arguments in ([source], [source, "--to", "b", "--cfc", "61"], ["--to", "b"]):
        with pytest.raises(SystemExit) as raised:
            run(*arguments)
        assert raised.value.code == 2


def test_as_a_program(source, tmp_path):
    """No traceback whatever the data; warnings are errors here too."""
    command = [sys.executable, "-W", "error", "-m", "crash_replay.import_command"]
    done = subprocess.run([*command, source, "--to", tmp_path / "b"], capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (0, "") and "S1: Half sine" in done.stdout
    done = subprocess.run([*command, source, "--to", tmp_path / "b"], capture_output=True, text=True, timeout=60)
    assert done.returncode == 1 and done.stderr.count("\n") == 1 and "--force" in done.stderr


# ---- doubts


def doubts(values, quantity="acceleration"):
    recording = Recording(
        Test("T", (Channel("c", quantity),)), np.rint(T * 1e9).astype(np.int64), np.array(values)[:, None]
    )
    return doubtful_channels(recording)


PULSE = np.where((T >= 0) & (T < 0.08), -300.0 * np.sin(np.pi * T / 0.08), 0.0)
NOISE = np.random.default_rng(5).normal(size=len(T))


def test_sound_channels_raise_no_doubt():
    assert doubts(PULSE) == []  # noise-free, at rest before and after
    assert doubts(PULSE + NOISE) == []
    assert doubts(np.round(PULSE + NOISE, 0)) == []  # coarse
    smooth = cfc_filter(PULSE + NOISE, 1e-4, 60)
    assert doubts(np.round(smooth * 2) / 2) == []  # filtered and coarse: flat on top, but entered by single steps
    assert doubts(np.where(T > 0.1, np.nan, PULSE)) == []
    assert doubts(np.where(T > 0.08, 1.0, PULSE)) == []  # comes to rest one step off


def test_faulty_channels_are_named():
    assert doubts(np.full(len(T), 2.0)) == ["c: one value (2) throughout: dead sensor?"]
    assert doubts(np.full(len(T), np.nan)) == ["c: has no valid value"]
    clipped = doubts(np.clip(PULSE + NOISE, -200.0, None))
    assert (
        len(clipped) == 1
        and clipped[0].startswith("c: holds its extreme -200 for ")
        and clipped[0].endswith("clipped?")
    )
    stuck = np.where(T > 0.03, (PULSE + NOISE)[np.searchsorted(T, 0.03)], PULSE + NOISE)
    assert len(doubts(stuck)) == 1 and "from 0.03" in doubts(stuck)[0] and doubts(stuck)[0].endswith("stuck?")


def test_values_missing_in_between_are_named():
    """A channel may begin late or end early; a hole in it, and a hole in all of them, is worth a line."""
    hole = np.where((T > 0.02) & (T < 0.0205), np.nan, PULSE + NOISE)
    assert doubts(hole) == ["c: 4 samples without a value, 0.0201 to 0.0204 s"]
    recording = Recording(Test("T", (Channel("c", "force"),)), np.rint(T * 1e9).astype(np.int64), hole[:, None])
    assert gaps_in_time(recording) == []
    there = np.isfinite(hole)
    assert gaps_in_time(Recording(recording.test, recording.time_ns[there], recording.values[there])) == [
        "time: a gap of 0.5 ms after 0.0200 s"
    ]
    there[900:1000] = False
    assert gaps_in_time(Recording(recording.test, recording.time_ns[there], recording.values[there])) == [
        "time: 2 gaps, the longest of 10.1 ms after 0.0399 s"
    ]


def test_missing_initial_velocity_is_said(source, tmp_path, capsys):
    source.with_suffix(".yaml").write_text("channels: {car_ax: {quantity: acceleration, unit: g, body: car}}\n")
    assert run(source, "--to", tmp_path / "b") == 0
    assert "initial velocity not given: every body is at rest until the impact" in capsys.readouterr().out


def test_a_doubt_travels_with_the_bag(tmp_path, capsys):
    values = np.clip(PULSE + NOISE, -200.0, None)[:, None]
    recording = Recording(Test("T", (Channel("c", "acceleration"),)), np.rint(T * 1e9).astype(np.int64), values)
    write_bag(recording, tmp_path / "a")
    assert run(tmp_path / "a", "--to", tmp_path / "b", "--cfc", 60) == 0
    assert "clipped?" in capsys.readouterr().out
    assert any("clipped?" in note for note in read_bag(tmp_path / "b").test.notes)
