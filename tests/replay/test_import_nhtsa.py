"""NHTSA EV5 folders: test 10146 gives the figures of its README; a small folder written here has every trap."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from crash_replay.readers import read_source
from crash_replay.readers.ev5 import Curve
from crash_replay.readers.nhtsa_names import channel_names
from crash_replay.recording import RecordingError

G = 9.80665


# ---- names


def curve(comment, sensor="AC", occupant="NA", location="XXXX", axis="XG", unit="G'S", vehicle=1, **others):
    fields = dict.fromkeys(Curve._fields, "") | {"first": -2, "last": 2, "step": 100.0, "initial_velocity": 36.0}
    fields |= {"number": 1, "time_unit": "SEC", "status": "AM", "redundancy": "P", "prefilter": "2800"}
    fields |= {"comment": comment, "sensor": sensor, "occupant": occupant, "location": location, "axis": axis}
    return Curve(**fields | {"unit": unit, "vehicle": vehicle} | others)


@pytest.mark.parametrize(
    "given, name",
    [
        (curve("DRIVER HEAD X", occupant="01", axis="XL"), "driver_head_ax"),
        (curve("HEAD CG Z", occupant="02", axis="ZL"), "passenger_head_cg_az"),
        (curve("TOP OF ENGINE X"), "engine_top_ax"),
        (curve("LEFT REAR SEAT CROSSMEMBER XR", redundancy="R"), "left_rear_crossmember_ax_redundant"),
        (
            curve("DRIVER RIGHT FEMUR RED.", "LC", "01", axis="ZL", unit="NWT", redundancy="R"),
            "driver_right_femur_fz_redundant",
        ),
        (curve("DRIVER LEFT UPPER TIBIA MY", "LC", "01", axis="YL", unit="NWM"), "driver_left_upper_tibia_my"),
        (curve("DRIVER HEAD ANGULAR VELOCITY X", "AV", "01", unit="DPS"), "driver_head_wx"),
        (curve("DRIVER CHEST DISPLACEMENT", "DS", "01", axis="XL", unit="MM"), "driver_chest_dx"),
        (curve("DRIVER LEFT FOOT Z - FRONT", occupant="01", axis="ZL"), "driver_left_foot_front_az"),
        (curve("BARRIER K-01 Fx", "LC", location="LC1101", unit="NWT", vehicle=0), "barrier_k01_fx"),
        (curve("BOTTOM OF ENGINE X: No valid data after 67ms"), "engine_bottom_ax"),
        (
            curve("NO VALID DATA AFTER 64.6 MILLISECONDS", location="FOTL", occupant="01", axis="YL"),
            "driver_left_foot_ay",
        ),
        (
            curve("EXCEEDED FULL SCALE AT 61.4 MILLSECONDS, QUESTIONABLE DATA THEREAFTER", location="VECG"),
            "cg_ax",
        ),
        (curve("RIGHT SILL X; QUES. DATA PER VRTC'S INSTRUCTIONS", location="OTHR"), "right_sill_ax"),
        (curve("", location="VECG", axis="NA"), "cg_a"),
        (curve("3RD ROW X"), "xxxx_3rd_row_ax"),
        (curve("ACCEL. LOCATION #1, NO COMMENTS", location="DSRF", axis="YG"), "right_front_sill_ay"),
        (curve("NO COMMENTS", location="RBLU", occupant="04", axis="YL"), "rear_left_passenger_left_upper_rib_ay"),
        (curve("NO COMMENTS", "LC", "03", "LUMB", "ZL", "LBS"), "rear_right_passenger_lumbar_spine_fz"),
        (curve("NO COMMENTS", "LC", location="LCA0", unit="NWT", vehicle=0), "barrier_load_cell_a10_fx"),
    ],
)
def test_names(given, name):
    assert channel_names([given], vehicles=1) == [name]


def test_names_are_unique_and_tell_vehicles_apart():
    assert channel_names([curve("SILL X")] * 3, 1) == ["sill_ax", "sill_ax_2", "sill_ax_3"]
    assert channel_names([curve("SILL X"), curve("SILL X", vehicle=2)], 2) == ["vehicle1_sill_ax", "vehicle2_sill_ax"]


# ---- a small folder


def record(number, comment, values=None, sensor="AC", **fields):
    return curve(comment, sensor, number=number, **fields), values


SENSORS = [
    record(1, "DRIVER HEAD X", [0, 0, 0, -1, -2], occupant="01", axis="XL"),
    record(2, "FLOOR LEFT X", [0, 0, 1, -1, -2], location="FLLR"),
    record(3, "FLOOR RIGHT X", [0, 0, 3, -1, -4], location="FLRR"),
    record(4, "TOP OF ENGINE X: No valid data after 0.1 ms", [0, 0, 5, 6, 7], location="ENGN", status="CF"),
    record(5, "FENDER X: No valid data", [0, 0, 5, 6, 7], status="CF"),
    record(6, "BELT: Not installed", None, "SG", unit="NWT", status="NO"),
    record(7, "SILL TEMPERATURE", [1, 1, 1, 1, 1], "TC", unit="DGC"),
    record(8, "SILL X"),
    record(9, "SLOW X", [0, 1], step=500.0),
    record(20, "BARRIER A-01 Fx", [0, 0, -10, -20, -5], "LC", unit="NWT", vehicle=0),
    record(21, "BARRIER A-02 Fx", [0, 0, -1, 2, -5], "LC", unit="NWT", vehicle=0),
    record(22, "BARRIER A-02 Mz", [9, 9, 9, 9, 9], "LC", unit="NWM", vehicle=0),
    record(23, "BARRIER A-03 Fx: No valid data", [9, 9, 9, 9, 9], "LC", unit="NWT", vehicle=0, status="CF"),
    record(24, "BARRIER A-04 Fx", [0, 0, -1], "LC", unit="NWT", vehicle=0),
    record(25, "BARRIER A-05 Fx", None, "LC", unit="NWT", vehicle=0),
]


def write_folder(folder, sensors=SENSORS):
    test = "V5|A CAR|FRONT|03/OCT/2017|LAB|C|R|NCA|VTB|CON|DRY|22|OTH|OTH|36.0|0|0|0|9|DAS"
    lines = ["# Source: NHTSA Vehicle Database - Test Number: 99", "----- EV5 -----", "----- TEST -----", test]
    lines += ["----- VEHICLE -----", "1|16|03|2018|M|4S|V|4CIF|2.5|AF|1500|1"]
    lines += ["----- INSTRUMENTATION -----"]
    for made, values in sensors:
        lines.append("|".join(f"{field:g}" if isinstance(field, float) else str(field) for field in made))
        if values is not None:
            rows = (f"{(k - 2) * made.step * 1e-6:.6f}\t{value:.6f}\n" for k, value in enumerate(values))
            (folder / f"v99.{made.number:03d}").write_text("".join(rows))
    (folder / "v99.EV5").write_text("\r\n".join([*lines, "----- END -----"]))
    return folder


def test_small_folder_with_every_trap(tmp_path):
    recording = read_source(write_folder(tmp_path))
    assert recording.test.impact_ns == 1_506_988_800 * 10**9, "midnight of the 3rd of October 2017, UTC"
    assert_array_equal(recording.time_ns, np.arange(-2, 3) * 100_000)
    assert recording.test.channel_names == (
        "car_ax", "barrier_fx", "driver_head_ax", "floor_left_ax", "floor_right_ax", "engine_top_ax"
    )  # fmt: skip
    assert_allclose(recording.column("car_ax"), np.array([0, 0, 2, -1, -3]) * G)
    assert_allclose(recording.column("barrier_fx"), [0, 0, 11, 18, 10])
    assert_allclose(recording.column("engine_top_ax"), np.array([0, 0, 5, np.nan, np.nan]) * G)
    assert recording.test.initial_velocity == {"driver_head": 10.0, "car": 10.0, "engine": 10.0}
    assert recording.test.notes == (
        "closing speed 36 km/h, test mass 1500 kg",
        "car_ax: mean of floor_left_ax, floor_right_ax",
        "barrier_fx: sum of 2 of 5 cells, without BARRIER A-03 Fx (curve 23), BARRIER A-04 Fx (curve 24), "
        "BARRIER A-05 Fx (curve 25); the cells themselves (4 curves) are left out; "
        "positive in compression: sign turned, the cells read negative in compression",
        "engine_top_ax: valid from -0.0002 s to 0.0000 s only, NaN elsewhere",
        "left out, no valid data, says the header: curves 5, 23",
        "left out, sensor not fitted: curves 6",
        "left out, unit DGC has no ROS message: curves 7",
        "left out, no data file: curves 8, 25",
        "left out, sampled at another rate than 10000 Hz: curves 9",
    )


def test_cells_that_read_positive_stay_positive(tmp_path):
    cells = [record(20, "BARRIER A-01 Fx", [0, 0, 10, 20, -5], "LC", unit="NWT", vehicle=0)]
    recording = read_source(write_folder(tmp_path, cells))
    assert_allclose(recording.column("barrier_fx"), [0, 0, 10, 20, -5])
    assert "positive in compression: sign as recorded" in recording.test.notes[1]


def test_a_damaged_curve_costs_only_itself(tmp_path):
    folder = write_folder(tmp_path)
    (folder / "v99.001").write_text("0.0\tabc\n")
    (folder / "v99.002").write_text("0.0 1.0 2.0\n")
    (folder / "v99.003").write_text("-0.0002\t1\n-0.0001\t1\n0.00015\t1\n")
    recording = read_source(folder)
    assert recording.test.channel_names == ("barrier_fx", "engine_top_ax")
    notes = "\n".join(recording.test.notes)
    assert "left out, v99.001 is damaged (" in notes
    assert "left out, v99.002: expected the two columns time and value, or values alone: curves 2" in notes
    assert "left out, v99.003: its times are not the header's steps of 100 us: curves 3" in notes


def test_names_file_in_the_folder_renames(tmp_path):
    folder = write_folder(tmp_path)
    (folder / "import.yaml").write_text("channels: {car_ax: {name: cab_ax, body: cab}}\ninitial_velocity: {cab: 9.0}\n")
    recording = read_source(folder)
    assert recording.test.channels[0].name == "cab_ax" and recording.test.channels[0].body == "cab"
    assert recording.test.initial_velocity["cab"] == 9.0
    assert recording.test.notes[-1] == "names taken from import.yaml"


@pytest.mark.parametrize(
    "wrong, message",
    [
        (
            lambda text: text.replace("INSTRUMENTATION", "INSTR"),
            "v99.EV5: expected an EV5 header with a section `----- INSTRUMENTATION",
        ),
        (
            lambda text: text.replace("|36.0|0|0|0|9|", "|fast|0|0|0|9|"),
            "v99.EV5:4: closing speed: expected a number, found 'fast'",
        ),
        (
            lambda text: text.replace("|AM|P|", "|").replace("|CF|P|", "|").replace("|NO|P|", "|"),
            "v99.EV5: none of 15 INSTRUMENTATION records can be read: expected 20 fields in an INSTRUMENTATION record",
        ),
        (lambda text: text.replace("V5|A CAR", "V5"), "v99.EV5:4: expected 20 fields in a TEST record, found 19"),
    ],
)
def test_header_at_fault(tmp_path, wrong, message):
    file = write_folder(tmp_path) / "v99.EV5"
    text = file.read_text()
    assert wrong(text) != text
    file.write_text(wrong(text))
    with pytest.raises(RecordingError) as raised:
        read_source(tmp_path)
    assert str(raised.value).removeprefix(f"{tmp_path}/").startswith(message)


def test_folder_without_curves_or_with_two_headers(tmp_path):
    write_folder(tmp_path, SENSORS[7:8])
    with pytest.raises(RecordingError, match="none of the header's 1 curves has a file v99.NNN to use"):
        read_source(tmp_path)
    (tmp_path / "v98.ev5").write_text("")
    with pytest.raises(RecordingError, match="expected one .EV5 header, found v98.ev5, v99.EV5"):
        read_source(tmp_path)


@pytest.mark.parametrize(("share", "said"), [(1.0, "balanced"), (0.5, "NOT balanced")])
def test_the_force_on_the_barrier_is_held_against_the_cars_momentum(tmp_path, share, said):
    """1500 kg (as the header of `write_folder` has it), of 1000 g for 0.3 ms: 2.5 m/s or so by the trapezoid."""
    car = [record(k, f"FLOOR {side} X", [0, 0, -1000, -1000, -1000], location=f"FL{side[0]}R")
           for k, side in ((2, "LEFT"), (3, "RIGHT"))]  # fmt: skip
    force = [0, 0, *[-share * 1500 * 1000 * G] * 3]
    cell = record(20, "BARRIER A-01 Fx", force, "LC", unit="NWT", vehicle=0)
    notes = read_source(write_folder(tmp_path, [*car, cell])).test.notes
    (momentum,) = [note for note in notes if note.startswith("momentum")]
    assert momentum.endswith(f"apart: {said}") or f": {said}: " in momentum


def test_what_counts_is_how_long_a_test_is_not_how_late(tmp_path):
    """10 s after time zero, at a microsecond, is the ten millionth sample, but the first of this test."""
    late = [(made._replace(first=9_999_999, last=10_000_003, step=1.0), values) for made, values in SENSORS[1:3]]
    folder = write_folder(tmp_path, late)
    for made, values in late:
        rows = (f"{(9_999_999 + k) * 1e-6:.6f}\t{value:.6f}\n" for k, value in enumerate(values))
        (folder / f"v99.{made.number:03d}").write_text("".join(rows))
    assert read_source(folder).time_ns[0] == 9_999_999_000
