"""Every kind of wrong input that once ended in a traceback, a hang, gigabytes or silence: one line now."""

import os
import struct
from dataclasses import replace

import numpy as np
import pytest
from helpers_refusals import BOMB, changed, refused

from crash_estimator.fuzz.bags import MAGIC, _record, _text, bomb
from crash_estimator.fuzz.valid import CSV, CURVES, EV5, MME, RECORDING
from crash_estimator.fuzz.worker import laid_out
from crash_replay.bag import read_bag, write_bag
from crash_replay.readers import read_source
from crash_replay.readers.ev5 import NUMERIC, Curve

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
    recording = read_source(changed(EV5, tmp_path, "v1.EV5", CURVES[0], "|".join(fields)))
    [said] = [note for note in recording.test.notes if note.endswith("line 8 of v1.EV5")]
    assert said.startswith(f"left out, {field} must be a number")


@pytest.mark.parametrize("field", NUMERIC)
def test_ev5_fields_that_are_zero(tmp_path, field):
    """May be so, or make their curve useless: the others are read."""
    fields = CURVES[0].split("|")
    fields[Curve._fields.index(field)] = "0"
    recording = read_source(changed(EV5, tmp_path, "v1.EV5", CURVES[0], "|".join(fields)))
    assert np.isfinite(recording.time).all()


@pytest.mark.parametrize(
    "old, new", [("|57.09|0|0|0|634", "|nan|0|0|0|634"), ("1|16|03", "inf|16|03"), ("|AF|1719", "|AF|nan")]
)
def test_ev5_test_and_vehicle_fields_that_are_no_number(tmp_path, old, new):
    assert "v1.EV5:" in refused(read_source, changed(EV5, tmp_path, "v1.EV5", old, new))


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
