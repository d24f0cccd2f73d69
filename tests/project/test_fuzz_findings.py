"""Every kind of wrong input that once ended in a traceback, a hang, gigabytes or silence: one line now."""

import os
import struct
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from crash_msgs import msg
from helpers_paths import ROOT

from crash_estimator.cli import diagnose
from crash_estimator.cli.common import parse_settings
from crash_estimator.core.effects import EFFECTS
from crash_estimator.core.effects.base import ElementMotion
from crash_estimator.core.effects.user import load_effects
from crash_estimator.core.structure import ModelError
from crash_estimator.fuzz.bags import MAGIC, _record, _text, bomb
from crash_estimator.fuzz.valid import CSV, CURVES, EFFECT, EV5, MME, MODEL, OUTPUT, RECORDING, TEST_INFO, cdr
from crash_estimator.fuzz.worker import laid_out
from crash_estimator.model_file import load_model
from crash_estimator.nodes.viewer_messages import parameter_block
from crash_replay.bag import read_bag, write_bag
from crash_replay.readers import read_source
from crash_replay.readers.ev5 import NUMERIC, Curve
from crash_replay.recording import RecordingError
from crash_replay.ros_messages import decoded, test_from_msg

ERRORS = (RecordingError, ModelError)


def refused(take, *arguments) -> str:
    with pytest.raises(ERRORS) as caught:
        take(*arguments)
    line = str(caught.value)
    assert line.isprintable() and len(line) < 1200
    return line


def changed(files: dict[str, bytes], folder: Path, name: str, old: str, new: str) -> Path:
    text = files[name].decode()
    assert old in text
    laid_out(files | {name: text.replace(old, new, 1).encode()}, folder)
    return folder


# ---- CSV and YAML


@pytest.mark.parametrize("time", ["1e10", "-1e10", "1e300", "1e309"])
def test_csv_times_that_no_crash_has(tmp_path, time):
    laid_out(CSV | {"rib.csv": f"time,rib_ay,barrier_fx\n0,1,2\n{time},1,2\n".encode()}, tmp_path)
    line = refused(read_source, tmp_path / "rib.csv")
    assert "rib.csv: sample 1: time" in line


@pytest.mark.parametrize(
    "content", [b"", b"\x00" * 100, b"\xff\xfe\x00", b"time," + b"x" * 200_000, b"time\n", b"time,a\n"]
)
def test_csv_that_is_no_table(tmp_path, content):
    laid_out(CSV | {"rib.csv": content}, tmp_path)
    assert "rib.csv" in refused(read_source, tmp_path / "rib.csv")


def test_csv_with_no_valid_value(tmp_path):
    laid_out(CSV | {"rib.csv": b"time,rib_ay,barrier_fx\n0,nan,\n1e-4,inf,1e300\n"}, tmp_path)
    assert "no channel has a valid value" in refused(read_source, tmp_path / "rib.csv")


@pytest.mark.parametrize("kind", ["/", "|", "@"])
@pytest.mark.parametrize("name", ["rib.csv", "rib.yaml"])
def test_what_is_no_file(tmp_path, name, kind):
    files = {other: content for other, content in CSV.items() if other != name}
    laid_out(files | {name + kind: b""}, tmp_path)
    assert "rib." in refused(read_source, tmp_path / "rib.csv")


BOMB = "X0: &X0 [1,1,1,1,1,1,1,1,1]\n" + "".join(
    f"X{k}: &X{k} [{','.join([f'*X{k - 1}'] * 9)}]\n" for k in range(1, 10)
)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (BOMB, "parts, more than"),
        ("a: " + "[" * 3000 + "]" * 3000, "nested deeper"),
        ("- " * 3000, "nested deeper"),
        ("a: &a [*a]", "contains itself"),
        ("a: 2001-99-99", "not valid YAML"),
        ("a: " + "1" * 5000, "not valid YAML"),
        ("a: " + "x" * 300_000, "more than the 200000 allowed"),
        ("channels:\n" + "  a: {b: c, d: e}\n" * 2000, ":3: not valid YAML: key 'a' appears more than once"),
        ("", "found nothing"),
    ],
)
def test_yaml_bombs(tmp_path, text, said):
    laid_out(CSV | {"rib.yaml": text.encode()}, tmp_path)
    assert said in refused(read_source, tmp_path / "rib.csv")


# ---- EV5 and ISO-MME


@pytest.mark.parametrize("value", ["nan", "inf", "-inf", "1e300", "-1e300"])
@pytest.mark.parametrize("field", NUMERIC)
def test_ev5_fields_that_are_no_number(tmp_path, field, value):
    fields = CURVES[0].split("|")
    fields[Curve._fields.index(field)] = value
    folder = changed(EV5, tmp_path, "v1.EV5", CURVES[0], "|".join(fields))
    assert f"v1.EV5:8: {field} must be a number" in refused(read_source, folder)


@pytest.mark.parametrize("field", NUMERIC)
def test_ev5_fields_that_are_zero(tmp_path, field):
    """May be so, or make their curve useless: the others are read."""
    fields = CURVES[0].split("|")
    fields[Curve._fields.index(field)] = "0"
    recording = read_source(changed(EV5, tmp_path, "v1.EV5", CURVES[0], "|".join(fields)))
    assert np.isfinite(recording.time).all()


@pytest.mark.parametrize("old", ["|57.09|0|0|0|634", "1|16|03", "|1246"])
def test_ev5_test_and_vehicle_fields_that_are_no_number(tmp_path, old):
    new = {"|57.09|0|0|0|634": "|nan|0|0|0|634", "1|16|03": "inf|16|03", "|1246": "|1246"}[old]
    folder = changed(EV5, tmp_path, "v1.EV5", old, new)
    if old != new:
        assert "v1.EV5:" in refused(read_source, folder)


@pytest.mark.parametrize("row", ["nan\t1", "1e300\t1", "inf\t1", "1e-4\tx", ""])
def test_ev5_curves_at_fault_are_left_out(tmp_path, row):
    laid_out(EV5 | {"v1.001": row.encode() + b"\n"}, tmp_path)
    assert any("curves 1" in note and "left out" in note for note in read_source(tmp_path).test.notes)


def test_ev5_curves_that_lie_far_apart_take_no_memory(tmp_path):
    far = "".join(f"{9000 + k * 1e-4:.6f}\t1\n" for k in range(40))
    laid_out(EV5 | {"v1.001": far.encode()}, tmp_path)
    assert "samples, more than" in refused(read_source, tmp_path)


def test_ev5_values_beyond_any_sensor_are_none(tmp_path):
    laid_out(EV5 | {"v1.001": b"0\t1e308\n1e-4\t1\n"}, tmp_path)
    assert np.isnan(read_source(tmp_path).values).any()


@pytest.mark.parametrize("key", ["Sampling interval           :0.0001", "Time of first sample        :-0.0002"])
@pytest.mark.parametrize("value", ["nan", "inf", "1e300", "-1e300", "word"])
def test_mme_numbers_at_fault_leave_their_channel_out(tmp_path, key, value):
    folder = changed(MME, tmp_path, "Channel/T7.001", key, f"{key.partition(':')[0]}:{value}")
    assert any("T7.001" in note for note in read_source(folder).test.notes)


def test_mme_velocity_that_is_none(tmp_path):
    folder = changed(MME, tmp_path, "T7.MME", ":15.6", ":1e999")
    assert "T7.MME: velocity test object 1: must be a number" in refused(read_source, folder)


# ---- bags


def chunk(said: int, packed: str, data: bytes) -> bytes:
    content = struct.pack("<QQQI", 0, 0, said, 0) + _text(packed) + struct.pack("<Q", len(data)) + data
    return MAGIC + _record(1, _text("ros2") + _text("x")) + _record(6, content) + _record(15, bytes(4)) + MAGIC


@pytest.mark.parametrize("said", [300_000_000, 2**40, 2**63])
def test_a_small_bag_that_unpacks_to_a_huge_one(tmp_path, said):
    (tmp_path / "bomb.mcap").write_bytes(chunk(said, "zstd", bomb(300_000_000)))
    assert "would unpack to more than" in refused(read_bag, tmp_path / "bomb.mcap")


def test_a_chunk_that_unpacks_to_more_than_it_says(tmp_path):
    (tmp_path / "bomb.mcap").write_bytes(chunk(100, "zstd", bomb(300_000_000)))
    assert "damaged" in refused(read_bag, tmp_path / "bomb.mcap")


def test_a_bag_without_a_valid_value(tmp_path):
    bag = write_bag(replace(RECORDING, values=np.full_like(RECORDING.values, np.nan)), tmp_path / "nan.mcap")
    assert "no channel has a valid value" in refused(read_bag, bag)


def test_pipes_in_a_bags_folder_are_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "x.mcap")
    assert "x.mcap: is not a file" in refused(read_source, tmp_path)


# ---- messages


@pytest.mark.parametrize(
    ("field", "value", "said"),
    [
        ("samples", 10**12, "samples, more than"),
        ("samples", 2**63, "samples, more than"),
        ("sample_period", float("nan"), "sample_period must be"),
        ("sample_period", -1.0, "sample_period must be"),
        ("sample_period", 0.0, "sample_period must be"),
        ("initial_velocity", [float("nan")], "initial velocity of 'car' must be"),
        ("initial_velocity", [1.0, 2.0], "1 bodies, 2 velocities"),
        ("initial_displacement", [], "0 displacements"),
        ("bodies", ["car", "car"], "different bodies"),
        ("channels", [*TEST_INFO.channels, TEST_INFO.channels[0]], "appears more than once"),
        ("channels", [TEST_INFO.channels[0]] * 3000, "3000 channels"),
    ],
)
def test_a_test_that_cannot_be(field, value, said):
    message = decoded(cdr(TEST_INFO), msg.TestInfo)
    setattr(message, field, value)
    assert said in refused(test_from_msg, message)


def test_as_many_samples_as_may_be_take_no_memory_before_they_come():
    message = decoded(cdr(TEST_INFO), msg.TestInfo)
    message.samples = 9_000_000
    assert len(test_from_msg(message).channels) == 3


@pytest.mark.parametrize("raw", [b"", b"\x00\x01\x00\x00", b"\x00\x01\x00\x00" + b"\xff" * 100, bytes(range(256))])
def test_bytes_that_are_no_test(raw):
    assert "does not decode as TestInfo" in refused(decoded, raw, msg.TestInfo)


def test_an_output_whose_lengths_do_not_fit():
    message = decoded(cdr(OUTPUT["block/parameters"]), type(OUTPUT["block/parameters"]))
    message.value = [1.0]
    assert "value: expected 4 values" in refused(parameter_block, "mrls", message)


# ---- models, settings, effects


@pytest.mark.parametrize(
    "value", ["true", '"400"', "1e308", ".inf", ".nan", "0", "-1", "1" * 400, "[1]", "{a: 1}", "2001-01-01"]
)
@pytest.mark.parametrize("key", ["mass: 400.5", "std: 1.0e5", "noise: 2.0"])
def test_a_model_s_number_that_is_none(tmp_path, key, value):
    folder = changed(MODEL, tmp_path, "model.yaml", key, f"{key.partition(':')[0]}: {value}")
    if (key, value) in (("std: 1.0e5", "1" * 400),):
        value = "a number of 1326 bits"
    line = refused(load_model, folder / "model.yaml", EFFECTS)
    assert "model.yaml:" in line and key.partition(":")[0] in line


def test_a_bomb_in_a_mass(tmp_path):
    folder = changed(MODEL, tmp_path, "model.yaml", "name: two_mass", "name: two_mass\n" + BOMB)
    assert "parts, more than" in refused(load_model, folder / "model.yaml")


SEMANTIC = {
    "a body that is not there": ("[engine, barrier]", "[engin, barrier]", ":13: elements.engine_barrier.between: "),
    "a body without mass": ("mass: 400.5, ", "", ":4: bodies.engine: "),
    "a channel twice": ("[car_ax]", "[car_ax, car_ax]", ":3: bodies.car.acceleration: "),
    "an effect's target": ("element: car_engine", "element: car_engin", ":19: effects.0: "),
    "an effect": ("type: added_mass", "type: aded_mass", ":20: effects.1: "),
    "an effect twice": (
        "{type: added_mass, body: car}",
        "{type: coulomb_friction, element: car_engine}",
        ":20: effects.1: ",
    ),
    "a shape constant": ("speed: 0.1", "sped: 0.1", ":19: effects.0: "),
    "a coefficient": ("coefficient: 1810", "coefficient: -1", ":19: effects.0: "),
}


@pytest.mark.parametrize("mistake", SEMANTIC)
def test_what_a_model_means_wrongly_has_file_line_and_key(tmp_path, mistake):
    old, new, place = SEMANTIC[mistake]
    folder = changed(MODEL, tmp_path, "model.yaml", old, new)
    assert f"model.yaml{place}" in refused(load_model, folder / "model.yaml", EFFECTS)


def test_a_model_without_an_equation_has_file_line_and_key(tmp_path):
    text = (
        "name: x\nbodies:\n  a: {motion: a_ax}\n  b: {fixed: true}\nelements:\n  e: {between: [a, b], stiffness: 1}\n"
    )
    (tmp_path / "model.yaml").write_text(text)
    assert "model.yaml:2: bodies: model x: there is no equation" in refused(load_model, tmp_path / "model.yaml")


@pytest.mark.parametrize(
    "setting", ["m=" + "1" * 400, "forgetting=nan", "forgetting=inf", "forgetting", "=", "m=1e300000"]
)
def test_settings_that_are_no_number(setting):
    refused(parse_settings, [setting])


BODY = "return np.maximum(motion.crush, 0.0) * motion.rate / width"


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("import sys", "import sys\nsys.exit(0)", "calls sys.exit"),
        ("import sys", "raise KeyboardError", "NameError"),
        (BODY, "sys.exit(0)", "force of 'position_damping' fails on a motion it was tried on: calls sys.exit"),
        (BODY, "return 'x'", "force of 'position_damping' fails"),
        (BODY, "return motion.crush[:3]", "must give one number for each"),
        (BODY, "return motion.crush * np.nan", "must be finite"),
        (BODY, "return 1e308", "must be finite"),
        ("force=force", "force=5", "force must be a function"),
        ("force=force", "force=force, low=5.0, high=1.0", "low < high"),
        ("(0.1, 0.5)", "()", "needs finite low and high"),
        ("(0.1, 0.5)", "(np.nan,)", "needs finite low and high"),
        ('"position_damping"', "5", "an effect's name is a word"),
        ('{"width": Shape("m", 0.01, 1.0, (0.1, 0.5))}', '{"width": 5}', "mapping of names to Shape"),
        ("size=100.0", "size=np.inf", "size"),
    ],
)
def test_an_effects_file_at_fault(tmp_path, old, new, said):
    folder = changed(EFFECT, tmp_path, "mine.py", old, new)
    line = refused(load_effects, folder / "mine.py")
    assert "mine.py" in line and said in line


@pytest.mark.parametrize(
    ("late", "said"), [("sys.exit(0)", "calls sys.exit"), ("1 / 0", "ZeroDivisionError"), ("'x'", "fails")]
)
def test_an_effect_that_fails_late_says_who_it_is(tmp_path, late, said):
    folder = changed(EFFECT, tmp_path, "mine.py", BODY, f"return {late} if len(motion.time) > 64 else motion.crush")
    effect = load_effects(folder / "mine.py")["position_damping"]
    motion = ElementMotion(*np.ones((5, 100)))
    line = refused(lambda: effect.force(motion, width=0.1))
    assert "mine.py: force of 'position_damping'" in line and said in line


def test_an_effect_that_ends_the_program_late_is_no_success(tmp_path, monkeypatch, capsys):
    """It once ended `diagnose` with status 0 and nothing printed."""
    folder = changed(EFFECT, tmp_path, "mine.py", BODY, "return sys.exit(0) if len(motion.time) > 64 else motion.crush")
    bag, model = "bags/frontal_single.mcap", "frontal_single"
    root = ROOT
    command = ["diagnose", str(root / bag), "--model", model, "--effects", str(folder / "mine.py")]
    monkeypatch.setattr(sys, "argv", command)
    with pytest.raises(SystemExit) as ended:
        diagnose.main()
    assert ended.value.code == 1 and "force of 'position_damping'" in capsys.readouterr().err
