"""ISO-MME folders, as ISO/TS 13499 describes them."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from crash_replay.readers import read_source
from crash_replay.readers.codes.isomme import channel_of
from crash_replay.readers.isomme import _masses
from crash_replay.recording import RecordingError

MME = """\
Data format edition number  :1.6
Laboratory name             :A lab
Title                       :Überprüfung
Test number                 :T7
Date of the test            :2026-05-14
Number of test objects      :1
Velocity test object 1      :15.6
Mass test object 1          :1500
"""


def channel_file(code, values, unit="g", **more):
    header = {
        "Channel code": code, "Name of the channel": "a name: with a colon", "Unit": unit,
        "Reference channel": "implicit", "Sampling interval": "0.0001", "Time of first sample": "-0.0002",
        "Number of samples": len(values), "Data status": "ok",
    } | {key.replace("_", " ").capitalize(): value for key, value in more.items()}  # fmt: skip
    return "".join(f"{key:28}:{value}\n" for key, value in header.items()) + "".join(f"{v:.6E}\n" for v in values)


FILES = [
    channel_file("10VEHC000000ACXP", [0, 0, -1, -2, -3]),
    channel_file("11HEADCG00H3ACXA", [0, 0, 0, -1, -2], unit="m/(s*s)"),
    channel_file("B0LOCE000000FOX0", [0, 0, 1, 2, 3], unit="kN"),
    channel_file("13FEMRLE00H3FOZB", [0, 1, 2], unit="N", time_of_first_sample="0"),
    channel_file("13CHST0000H3DSXC", [9] * 5, unit="mm", data_status="channel failed"),
    channel_file("13CHST0000H3TEXC", [9] * 5, unit="C"),
    channel_file("11TIRS000000TIRP", [-2e-4, -1e-4, 0, 1e-4, 2e-4], unit="s"),
    channel_file(
        "11PELV0000H3ACYP", [1, 2, 3, 4, 5], reference_channel="explicit", reference_channel_name="11TIRS000000TIRP"
    ),
    channel_file("11PELV0000H3ACZP", [1, 2], sampling_interval="0.001"),
]


def write_folder(folder, files=FILES, mme=MME, encoding="latin-1"):
    (folder / "T7.MME").write_text(mme, encoding=encoding)
    (folder / "Channel").mkdir(exist_ok=True)
    (folder / "Channel/T7.chn").write_text("Instrumentation standard    :ISO 6487\n")
    for number, text in enumerate(files, start=1):
        (folder / f"Channel/T7.{number:03d}").write_text(text)
    return folder


@pytest.mark.parametrize("encoding", ["latin-1", "utf-8"])
def test_folder(tmp_path, encoding):
    recording = read_source(write_folder(tmp_path, encoding=encoding))
    test = recording.test
    assert (test.id, test.title, test.source) == ("T7", "Überprüfung", "A lab, 2026-05-14, T7.MME")
    assert test.impact_ns == 1_778_716_800 * 10**9, "midnight of that date, UTC"
    assert_array_equal(recording.time_ns, np.arange(-2, 3) * 100_000)
    assert [(c.name, c.body, c.axis) for c in test.channels] == [
        ("car_ax", "car", "x"),
        ("front_left_head_ax_cfc1000", "front_left_head", "x"),
        ("barrier_loce_fx", "barrier", "x"),
        ("front_right_femur_left_fz_cfc600", "front_right_femur_left", "z"),
        ("front_left_pelvis_ay", "front_left_pelvis", "y"),
    ]
    assert_allclose(recording.column("car_ax"), np.array([0, 0, -1, -2, -3]) * 9.80665)
    assert_allclose(recording.column("front_left_head_ax_cfc1000"), [0, 0, 0, -1, -2])
    assert_allclose(recording.column("barrier_loce_fx"), [0, 0, 1e3, 2e3, 3e3])
    assert_allclose(recording.column("front_right_femur_left_fz_cfc600"), [np.nan, np.nan, 0, 1, 2])
    assert_allclose(recording.column("front_left_pelvis_ay"), np.arange(1, 6) * 9.80665)
    assert test.initial_velocity == dict.fromkeys(
        ["car", "front_left_head", "front_right_femur_left", "front_left_pelvis"], 15.6
    )
    assert test.notes == (
        "left out, T7.005: its status is 'channel failed'",
        "left out, T7.006: dimension TE has no ROS message",
        "left out, sampled at another rate than 10000 Hz: front_left_pelvis_az",
        "front_right_femur_left_fz_cfc600: 3 of 5 samples, NaN elsewhere",
        "barrier forces keep their recorded sign; a model expects compression to be positive",
        "initial velocity 15.6 m/s along the object's own x: "
        "car, front_left_head, front_right_femur_left, front_left_pelvis",
    )


@pytest.mark.parametrize(
    "code, name, body",
    [
        ("11HEADCG00H3ACXP", "front_left_head_ax", "front_left_head"),
        ("10ENGN000000ACXP", "engine_ax", "engine"),
        ("14BPILLEUP00ACYD", "second_left_b_pillar_left_upper_ay_cfc60", "second_left_b_pillar_left_upper"),
        ("M0VEHC000000ACXP", "mdb_car_ax", "mdb_car"),
        ("11HEAD0000H3AVZ0", "front_left_head_wz", "front_left_head"),
        ("17SEBE0000B3FO0P", "third_left_seat_belt_upper_diagonal_f", "third_left_seat_belt_upper_diagonal"),
        ("10FORALERERDAC1P", "floor_over_rear_axle_left_rear_ax", "car"),
        ("15PELV00LLQ6MOXF", "second_middle_pelvis_left_lower_mx_cfc600", "second_middle_pelvis_left_lower"),
        ("1AKNSLLE00THDSXC", "seat_a_knee_slider_left_dx_cfc180", "seat_a_knee_slider_left"),
        ("10VEHCCG0000VAXD", "car_vx_cfc60", "car"),
        ("11TRRILE01WSDSYP", "front_left_rib_left_01_dy", "front_left_rib_left_01"),
    ],
)
def test_names(code, name, body):
    channel = channel_of(code, "", several_objects=False)
    assert (channel.name, channel.body) == (name, body)
    assert channel_of("20HEADCG00H3ACXP", "", several_objects=True).name == "object2_head_ax"


def test_a_direction_with_another_sign_is_said(tmp_path):
    """NHTSA's exports have 1 for the longitudinal direction."""
    recording = read_source(write_folder(tmp_path, [FILES[0].replace("ACX", "AC1")]))
    assert recording.test.channels[0].axis == "x"
    assert any(note.startswith("direction 1, 2 or 3") and "--names" in note for note in recording.test.notes)


def long_folder(folder, change=lambda text: text, mme=MME, more=()):
    """160 ms of a car with three sensors that stops from 15.6 m/s."""
    time = np.arange(-100, 1500) * 1e-4
    values = np.where((time >= 0) & (time < 0.08), -15.6 * np.pi / 0.16 * np.sin(np.pi * time / 0.08), 0.0)
    noise = np.random.default_rng(0).normal(scale=0.1, size=(3, len(time)))
    codes = ("10VEHCCG0000ACXP", "10SILBLE0000ACXP", "10SILBRI0000ACXP")
    files = [channel_file(code, values + n, "m/s²", time_of_first_sample="-0.01") for code, n in zip(codes, noise)]
    return write_folder(folder, [change(files[0]), *files[1:], *more], mme)


def test_a_bad_sensor_called_as_the_car_is_not_the_car(tmp_path):
    flipped = long_folder(tmp_path, lambda text: text.replace("\n-", "\n+"))
    recording = read_source(flipped)
    assert any(note.startswith("outlier car_ax") for note in recording.test.notes)
    assert recording.column("car_ax").min() < -250 and "car_ax_sensor" not in recording.test.channel_names
    assert "car_ax_sensor" in read_source(flipped, all_sensors=True).test.channel_names


def test_what_a_header_says_wrong_is_told(tmp_path):
    mme = MME.replace(":15.6", ":56.2") + "Velocity test object 2      :fast\n"
    folder = long_folder(tmp_path, lambda text: text.replace(":1600", ":99").replace(":ok", ":questionable data"), mme)
    notes = "\n".join(read_source(folder).test.notes)
    for said in (
        "velocity test object 1: 56.2 m/s, as the standard has it, are three times",
        "initial_velocity: {car: 15.61}",
        "velocity test object 2: expected a velocity, found 'fast'",
        "the number of samples is not the stated one: T7.001",
        "status 'questionable data': car_ax",
    ):
        assert said in notes
    assert "km/h?" not in "\n".join(read_source(long_folder(tmp_path)).test.notes)


def test_a_header_in_two_bytes_a_letter(tmp_path):
    folder = long_folder(tmp_path)
    (folder / "T7.MME").write_text(MME, encoding="utf-16")
    assert read_source(folder).test.initial_velocity["car"] == 15.6
    assert read_source(folder).test.title == "Überprüfung"


def test_barrier_cells_as_nhtsa_exports_them(tmp_path):
    cells = [channel_file(f"00LOMA{k:02d}0000FO1P", [-1.0] * 1600, "N", time_of_first_sample="-0.01") for k in (1, 2)]
    recording = read_source(long_folder(tmp_path, more=cells))
    assert {"car_ax", "barrier_fx"} <= set(recording.test.channel_names)
    assert_allclose(recording.column("barrier_fx"), 2.0)


def test_a_folder_of_nothing_but_faults_is_one_short_line(tmp_path):
    with pytest.raises(RecordingError) as raised:
        read_source(write_folder(tmp_path, [channel_file("10VEHCCG0000ACXP", [1.0], unit="furlong")] * 200))
    assert len(str(raised.value)) < 2000 and "and 195 more" in str(raised.value)


def test_a_velocity_with_its_unit_and_doubled_names(tmp_path):
    mme = MME.replace(":15.6", ":57.6 km/h")
    recording = read_source(write_folder(tmp_path, [FILES[0], FILES[0]], mme))
    assert recording.test.channel_names == ("car_ax", "car_ax_2")
    assert_allclose(recording.test.initial_velocity["car"], 16.0)


@pytest.mark.parametrize(
    "wrong, message",
    [
        (
            channel_file("10VEHC00ACXP", [1]),
            "left out, T7.001: expected a channel code of 16 letters and digits, found '10VEHC00ACXP'",
        ),
        (channel_file("10VEHC000000ACXP", []), "left out, T7.001: it has no values"),
        (channel_file("10VEHC000000ACXP", [1], unit="gs"), "left out, T7.001: unknown unit 'gs' for acceleration"),
        (
            channel_file("10VEHC000000ACXP", [1], sampling_interval="NOVALUE"),
            "'sampling interval': expected a number, found 'NOVALUE'",
        ),
        (
            channel_file("10VEHC000000ACXP", [1, 2], sampling_interval="0"),
            "'sampling interval' must be a number from 1e-09 to 10 s, got 0.0",
        ),
        (
            channel_file("10VEHC000000ACXP", [1], reference_channel="explicit"),
            "its time channel (not named) is missing",
        ),
    ],
)
def test_channels_at_fault_are_named(tmp_path, wrong, message):
    with pytest.raises(RecordingError) as raised:
        read_source(write_folder(tmp_path, [wrong]))
    assert str(raised.value).startswith(f"{tmp_path}: no channel can be used: left out, T7.001: ")
    assert message in str(raised.value)


def test_folders_at_fault(tmp_path):
    def error():
        with pytest.raises(RecordingError) as raised:
            read_source(tmp_path)
        return str(raised.value)

    write_folder(tmp_path, [FILES[0] + "words\n"])
    assert error().endswith("no channel can be used: left out, T7.001: line 14: expected a number, found 'words'")
    shifted = channel_file("10ENGN000000ACXP", [1] * 5, time_of_first_sample="-0.00015")
    write_folder(tmp_path, [FILES[0], shifted])
    assert "mixed sample times" in error()
    write_folder(tmp_path, [FILES[0]], MME.replace(":15.6", ":15 knots"))
    (tmp_path / "Channel/T7.002").unlink()
    assert error().startswith(f"{tmp_path}/T7.MME: velocity test object 1: unknown unit 'knots'")
    (tmp_path / "Channel/T7.001").unlink()
    assert error() == f"{tmp_path}/Channel: no channel files (NAME.001, NAME.002, ...)"
    (tmp_path / "other.mme").touch()
    assert error() == f"{tmp_path}: expected one .mme header, found T7.MME, other.mme"


@pytest.mark.parametrize(
    ("stated", "masses"), [("1200", {"car": 1200.0}), ("0", {}), ("0.5", {"car": 0.5}), ("NOVALUE", {})]
)
def test_a_mass_is_a_number_above_0(stated, masses):
    track = SimpleNamespace(code="1VEHC", channel=SimpleNamespace(body="car"))
    rib = SimpleNamespace(code="1RIBS", channel=SimpleNamespace(body="driver_rib"))
    header = SimpleNamespace(get={"mass test object 1": stated}.get)
    assert _masses(header, [track, rib]) == masses


def test_a_channel_of_one_value_has_no_rate_and_costs_only_itself(tmp_path):
    recording = read_source(write_folder(tmp_path, [*FILES[:3], channel_file("10ENGN000000ACXP", [1])]))
    assert "engine_ax" not in recording.test.channel_names and "car_ax" in recording.test.channel_names
    assert "left out, sampled at another rate than 10000 Hz: engine_ax" in recording.test.notes


@pytest.mark.parametrize(
    ("letter", "cfc"),
    [*zip("ABCD", (1000, 600, 180, 60)), *zip("EFGH", (1000, 600, 180, 60)), ("L", 20), *zip("0PSX", [None] * 4)],
)
def test_the_last_letter_is_the_class_of_the_filter(letter, cfc):
    """ISO/TS 13499: A to D are filtered by SAE J211's phaseless filter, E to H by another one, P before sampling."""
    name = channel_of(f"11HEADCG00H3ACX{letter}", "", several_objects=False).name
    assert name == "front_left_head_ax" + (f"_cfc{cfc}" if cfc else "")
