"""Imports that a test lab would sign: codes instead of comments, sensors compared, holes, classes, signs."""

import numpy as np
import pytest
from helpers_ev5 import MASSES, SPEEDS, TIME, G, pulse, two_cars, write_two_cars
from helpers_paths import DATA
from numpy.testing import assert_allclose, assert_array_equal
from test_import_isomme import channel_file
from test_import_isomme import write_folder as write_isomme

from crash_replay.bag import read_bag
from crash_replay.channel_class import BY_CLASS, class_of
from crash_replay.conditioning import cfc_filter, filter_recording
from crash_replay.import_command import main
from crash_replay.readers import read_source
from crash_replay.recording import Channel, Recording, RecordingError, Test
from crash_replay.sensor_agreement import velocity_change

BAD_SENSOR = "vehicle1_floor_left_rear_ax"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return write_two_cars(tmp_path_factory.mktemp("ev5") / "v07292")


@pytest.fixture(scope="module")
def cars(folder):
    return read_source(folder)


def test_codes_name_what_comments_do_not(cars):
    bodies = {channel.name: channel.body for channel in cars.test.channels}
    for part in ("head", "chest", "pelvis"):
        assert bodies[f"vehicle1_driver_{part}_ax"] == f"vehicle1_driver_{part}"
    assert bodies["vehicle2_passenger_chest_dx"] == "vehicle2_passenger_chest"
    assert {name for name, body in bodies.items() if body == "vehicle1_car"} == {
        "vehicle1_car_ax", "vehicle1_left_sill_ax", "vehicle1_right_sill_ax", "vehicle1_floor_right_rear_ax",
        "vehicle1_left_toepan_ax",
    }  # fmt: skip
    assert bodies["vehicle1_engine_ax"] == "vehicle1_engine"
    assert not any("comment" in name for name in bodies)


def test_a_bad_sensor_is_named_and_is_not_the_car(cars, folder):
    notes = "\n".join(cars.test.notes)
    assert BAD_SENSOR not in cars.test.channel_names
    assert f"outlier {BAD_SENSOR}: its velocity is up to " in notes and "--all-sensors" in notes
    assert BAD_SENSOR in read_source(folder, all_sensors=True).test.channel_names
    for vehicle in (1, 2):
        mean = cars.column(f"vehicle{vehicle}_car_ax")
        assert_allclose(velocity_change(cars.time, mean), -SPEEDS[vehicle], rtol=0.01)
        filtered = cfc_filter(mean, cars.sample_period, 60)
        assert_allclose(filtered.min(), pulse(vehicle).min(), rtol=0.1)
    # a toepan bears witness, but deforms: it is no part of the mean
    (said,) = [note for note in cars.test.notes if note.startswith("vehicle1_car_ax: ")]
    assert "toepan" not in said and "left_sill" in said


def test_momentum_balances(cars, folder):
    (line,) = [note for note in cars.test.notes if note.startswith("momentum")]
    assert line.endswith(": balanced") and "18.0 kN s" in line
    momentum = [MASSES[k] * velocity_change(cars.time, cars.column(f"vehicle{k}_car_ax")) for k in (1, 2)]
    assert_allclose(momentum[0], momentum[1], rtol=0.05)


@pytest.mark.parametrize("said", ["64.6 ms", "64.6 MILLISECONDS", "64.6 MILLSECONDS", "64.6 msec"])
def test_what_the_header_calls_not_valid_is_left_out_however_it_writes_the_unit(tmp_path, said):
    records = two_cars()
    record, values = records[13]
    records[13] = record.replace("AM|P|NO COMMENTS", f"QD|P|NO VALID DATA AFTER {said}"), values
    recording = read_source(write_two_cars(tmp_path / "foot", records=records))
    valid = np.isfinite(recording.column("vehicle2_passenger_chest_dx"))
    assert 0.064 < recording.time[valid].max() < 0.0646 and valid[recording.time < 0.064].all()


def test_of_two_sensors_the_momentum_tells_which_is_wrong(tmp_path):
    records = [r for r in two_cars() if r[0].split("|")[1] in ("5", "7", "10", "11", "12")]
    recording = read_source(write_two_cars(tmp_path / "two", records=records))
    assert BAD_SENSOR not in recording.test.channel_names
    # without the other car nobody knows: both stay, and it is said
    alone = read_source(write_two_cars(tmp_path / "one", records=records[:2]))
    assert BAD_SENSOR in alone.test.channel_names
    assert any("two sensors contradict each other, which is right is not known" in note for note in alone.test.notes)


def test_a_car_whose_sensors_contradict_each_other_bears_no_witness(tmp_path):
    """Both cars have a loose sensor and a sound one, whose mean would just bear out the other car's loose one."""
    records = [r for r in two_cars() if r[0].split("|")[1] in ("5", "7", "10", "11")]
    records[3] = (records[3][0], records[3][1] * 5.0)
    recording = read_source(write_two_cars(tmp_path / "two", records=records))
    undecided = [note for note in recording.test.notes if "which is right is not known" in note]
    assert [note.partition(":")[0] for note in undecided] == ["vehicle1_car", "vehicle2_car"]
    assert not any(note.startswith("outlier") for note in recording.test.notes)


@pytest.mark.parametrize(("shares", "left_out"), [
    ((0.7, 0.95, 1.25, 1.4), 0), ((1.0, 0.7, 1.0, 1.4), 0), ((1.0, 1.0, 1.0, 1.4), 1),
])  # fmt: skip
def test_none_is_an_outlier_where_not_most_of_a_car_s_sensors_agree(tmp_path, shares, left_out):
    """As in NHTSA 7292, where both cars turn: each sensor is more than a tenth off the median."""
    numbers = dict(zip(("4", "6", "7", "8"), shares))
    records = [(record, values) for record, values in two_cars() if record.split("|")[1] != "5"]
    records = [(record, values * numbers.get(record.split("|")[1], 1.0)) for record, values in records]
    recording = read_source(write_two_cars(tmp_path / "turning", records=records))
    said = [note for note in recording.test.notes if note.startswith("vehicle1_car: ")]
    outliers = [note for note in recording.test.notes if note.startswith("outlier")]
    assert len(outliers) == left_out and len(said) == (not left_out)
    assert all("4 sensors contradict each other, which are right is not known" in note for note in said)
    names = [
        "vehicle1_left_sill_ax",
        "vehicle1_right_sill_ax",
        "vehicle1_floor_right_rear_ax",
        "vehicle1_left_toepan_ax",
    ]
    assert sum(name in recording.test.channel_names for name in names) == len(names) - left_out
    mean = np.mean([recording.column(name) for name in names[:3]], axis=0)
    assert_allclose(recording.column("vehicle1_car_ax"), mean, rtol=1e-6, atol=1e-6)


def test_signs_and_vehicles_that_face_each_other(folder, cars, tmp_path):
    names = tmp_path / "names.yaml"
    names.write_text(
        "turned: [vehicle2_*]\n"
        "channels:\n"
        "  vehicle1_car_ax: {name: target_ax, body: target}\n"
        "  vehicle2_car_ax: {name: bullet_ax, body: bullet}\n"
        "  vehicle1_driver_head_ax: {sign: -1}\n"
    )
    turned = read_source(folder, names=names)
    assert_array_equal(turned.column("bullet_ax"), -cars.column("vehicle2_car_ax"))
    assert_array_equal(turned.column("vehicle2_left_sill_ax"), -cars.column("vehicle2_left_sill_ax"))
    assert_array_equal(turned.column("target_ax"), cars.column("vehicle1_car_ax"))
    assert_array_equal(turned.column("vehicle1_driver_head_ax"), -cars.column("vehicle1_driver_head_ax"))
    velocity = turned.test.initial_velocity
    assert (velocity["bullet"], velocity["target"]) == (-SPEEDS[2], SPEEDS[1])
    assert velocity["vehicle1_driver_head"] == SPEEDS[1], "a sensor turned round does not turn its body"
    assert turned.test.channels[turned.test.index("bullet_ax")].source.endswith("sign turned")
    total = sum(m * velocity[b] for m, b in zip(MASSES.values(), ("target", "bullet")))
    assert_allclose(total, 0.0, atol=1.0)


@pytest.mark.parametrize(
    "text, said",
    [
        ("turned: [vehicle3_*]", "turned: no channel is on a body 'vehicle3_*'"),
        ("channels: {door_ax: {sign: -1}}", "channels.door_ax: the recording has no such channel"),
        ("channels: {'vehicle2_*': {name: one}}", "cannot give them one name"),
        ("channels: {vehicle1_car_ax: {sign: 2}}", "sign"),
    ],
)
def test_names_at_fault(folder, tmp_path, text, said):
    names = tmp_path / "names.yaml"
    names.write_text(text + "\n")
    with pytest.raises(RecordingError, match="names.yaml") as raised:
        read_source(folder, names=names)
    assert said in str(raised.value)


def test_import_says_it_in_short_and_how_long_it_took(folder, tmp_path, capsys):
    (short := folder.parent / "short").mkdir()
    lost = [(record.replace("|AM|", "|NO|"), values) for record, values in two_cars()[:3]]
    write_two_cars(short, records=[*lost, *two_cars()[3:]])
    assert main([str(short), "--to", str(tmp_path / "b"), "--offset", "--cfc", "class"]) == 0
    said = capsys.readouterr().out
    assert max(map(len, said.splitlines())) < 300
    lines = said.splitlines()
    head = next(k for k, line in enumerate(lines) if line.split() == ["left", "out", "why"])
    assert lines[head + 1].split() == ["curves", "1-3", "sensor", "not", "fitted"]
    assert any(line.startswith("written to ") and line.endswith(" s)") for line in lines)


def test_names_are_in_the_help(capsys):
    assert main_status(["--help"]) == 0
    told = capsys.readouterr().out
    assert "turned: [vehicle2_*]" in told and "sign: -1" in told and "--all-sensors" in told


def main_status(arguments):
    with pytest.raises(SystemExit) as raised:
        main(arguments)
    return raised.value.code


# ---- channel frequency classes


@pytest.mark.parametrize(
    "name, quantity, cfc",
    [
        ("driver_head_ax", "acceleration", 1000),
        ("driver_neck_upper_fx", "force", 1000),
        ("driver_neck_upper_my", "moment", 600),
        ("driver_chest_ax", "acceleration", 180),
        ("spine_ay", "acceleration", 180),
        ("rib_ay", "acceleration", 1000),
        ("driver_chest_dx", "displacement", 600),
        ("driver_pelvis_ax", "acceleration", 1000),
        ("driver_left_femur_fz", "force", 600),
        ("driver_left_foot_front_az", "acceleration", 1000),
        ("driver_shoulder_belt_f", "force", 60),
        ("barrier_fx", "force", 60),
        ("car_ax", "acceleration", 60),
        ("engine_ax", "acceleration", 60),
        ("second_left_b_pillar_upper_ay", "acceleration", 60),
        ("rear_left_passenger_shoulder_az", "acceleration", 1000),
        ("seat_a_head_ax", "acceleration", 1000),
    ],
)
def test_classes_of_sae_j211(name, quantity, cfc):
    assert class_of(Channel(name, quantity)).cfc == cfc


def test_each_channel_by_its_class_and_in_its_record(cars):
    filtered = filter_recording(cars, BY_CLASS)
    for name, cfc in (("vehicle1_driver_head_ax", 1000), ("vehicle1_driver_chest_ax", 180), ("vehicle2_car_ax", 60)):
        assert_array_equal(filtered.column(name), cfc_filter(cars.column(name), cars.sample_period, cfc))
        assert f"CFC {cfc} (SAE J211-1: " in filtered.test.channels[filtered.test.index(name)].source
    assert all(len(note) < 300 for note in filtered.test.notes)


def test_a_class_in_the_name_is_that_of_the_values():
    channels = (Channel("head_ax_cfc1000", "acceleration"), Channel("spine_ax_cfc60", "acceleration"))
    values = np.stack([pulse(1), pulse(2)], axis=1)
    recording = Recording(Test("T", channels), np.rint(TIME * 1e9).astype(np.int64), values)
    filtered = filter_recording(recording, 180)
    assert filtered.test.channel_names == ("head_ax_cfc180", "spine_ax_cfc60")
    assert_array_equal(filtered.values[:, 1], values[:, 1])
    assert_array_equal(filtered.values[:, 0], cfc_filter(values[:, 0], 1e-4, 180))
    assert any("left at the CFC 60 that it came with: spine_ax_cfc60" in note for note in filtered.test.notes)


# ---- ISO-MME


def test_novalue_is_a_hole_and_micrometres_are_a_length(tmp_path):
    with_hole = channel_file("10VEHC000000ACXP", [0, 0, -1, -2, -3]).replace("-1.000000E+00", "NOVALUE")
    lengths = [channel_file("11CHST0000H3DSX0", [0, 0, 100, 200, 300], unit=unit)
               for unit in ("um", "\N{MICRO SIGN}m", "\N{GREEK SMALL LETTER MU}m", "dm", "nm")]  # fmt: skip
    damaged = channel_file("10ENGN000000ACXP", [1] * 5) + "words\n"
    recording = read_source(write_isomme(tmp_path, [with_hole, *lengths, damaged], encoding="utf-8"))
    assert_allclose(recording.column("car_ax") / G, [0, 0, np.nan, -2, -3])
    columns = [recording.column(name)[-1] for name in recording.test.channel_names if "chest" in name]
    assert_allclose(columns, [300e-6, 300e-6, 300e-6, 30.0, 300e-9])
    assert any(note.startswith("left out, T7.007: line 14: expected a number") for note in recording.test.notes)


MADE = {  # the channel of an ISO-MME test that a channel of NHTSA's becomes
    "left_rear_crossmember_ax": "10CRMELERE00ACXP",
    "right_rear_crossmember_ax": "10CRMERIRE00ACXP",
    "left_rear_crossmember_ax_redundant": "10CRMELE0000ACXP",
    "right_rear_crossmember_ax_redundant": "10CRMERI0000ACXP",
    "engine_top_ax": "10ENGNUP0000ACXP",
    "driver_head_ax": "11HEADCG00H3ACXP",
    "barrier_fx": "B0LOCE000000FOXP",
}


@pytest.mark.skipif(not (DATA / "nhtsa-10146").is_dir(), reason=f"no recordings in {DATA}")
def test_the_same_test_in_both_forms_gives_the_same_figures(tmp_path):
    camry = read_source(DATA / "nhtsa-10146")
    more = dict(sampling_interval="0.0001", time_of_first_sample="-0.05")
    files = [channel_file(code, camry.column(name) / (1.0 if "FO" in code else G), "N" if "FO" in code else "g", **more)
             for name, code in MADE.items()]  # fmt: skip
    mme = "Test number :10146\nVelocity test object 1 :15.858333\nMass test object 1 :1719\n"
    (tmp_path / "iso").mkdir()
    iso = read_source(write_isomme(tmp_path / "iso", files, mme))
    for name, others in (("car_ax", "car_ax"), ("engine_ax", "engine_ax"), ("driver_head_ax", "front_left_head_ax"),
                         ("barrier_fx", "barrier_loce_fx")):  # fmt: skip
        assert_allclose(iso.column(others), camry.column(name), atol=0.001 * np.abs(camry.column(name)).max())
    assert_array_equal(iso.time_ns, camry.time_ns)
    assert_allclose(iso.test.initial_velocity["car"], camry.test.initial_velocity["car"], rtol=1e-6)
    assert not any("outlier" in note for note in (*iso.test.notes, *camry.test.notes)), "all four sensors are sound"
    filtered = filter_recording(iso, BY_CLASS)
    assert_allclose(filtered.column("car_ax").min() / G, -41.7, rtol=0.01)
    bag = tmp_path / "b.mcap"
    assert main([str(tmp_path / "iso"), "--to", str(bag), "--channels", "car_ax"]) == 0
    assert_allclose(read_bag(bag).column("car_ax"), iso.column("car_ax"))
