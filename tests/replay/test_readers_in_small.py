"""Decisions of the readers, each asked alone: what is read of a file's words and of what it does not say."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from helpers_ev5 import write_two_cars
from test_import_nhtsa import SENSORS, curve, write_folder

from crash_replay import limits
from crash_replay.readers import body_means, is_bag, isomme, nhtsa, read_source
from crash_replay.readers.codes.nhtsa import LOCATIONS
from crash_replay.readers.csv_yaml import LONG, _check_time, _checked_header
from crash_replay.readers.description import apply_names
from crash_replay.readers.ev5 import _angle, _test_number, read_header
from crash_replay.readers.isomme import MmeFile
from crash_replay.readers.isomme_velocity import _like_kmh
from crash_replay.readers.left_out import ranges
from crash_replay.readers.nhtsa_curves import _read_track
from crash_replay.readers.uds import is_uds
from crash_replay.recording import Channel, Recording, RecordingError, Test
from crash_replay.sensor_agreement import Agreement


def test_what_is_on_the_left_moves_with_what_its_like_on_the_right_does():
    by_name = {location.name: location for location in LOCATIONS.values()}
    pairs = [
        (by_name[n], by_name[n.replace("left", "right")]) for n in by_name if n.replace("left", "right") in by_name
    ]
    pairs = [(left, right) for left, right in pairs if left.name != right.name]
    assert len(pairs) > 10
    for left, right in pairs:
        assert (left.moves_with, left.near) == (right.moves_with, right.near), left.name


@pytest.mark.parametrize(
    ("vehicles", "along", "cars"),
    [
        (1, False, {"car": 1500.0}),
        (2, True, {"vehicle1_car": 1500.0, "vehicle2_car": 1400.0}),
        (2, False, {}),  # their momentum along x is not kept
    ],
)
def test_of_cars_that_do_not_meet_along_one_line_no_momentum_is_compared(monkeypatch, vehicles, along, cars):
    given = []
    monkeypatch.setattr(nhtsa, "body_motion", lambda time, sensors, masses, *more: given.append(masses))
    masses = {1: 1500.0, 2: 1400.0} if vehicles > 1 else {1: 1500.0, 2: 0.0}
    header = SimpleNamespace(vehicles=vehicles, masses=masses, along_one_line=along)
    nhtsa._body_motion(header, (), 0, np.arange(5), None)
    assert given == [cars]


def test_a_header_of_iso_mme_may_be_as_long_as_headers_are_and_a_curve_as_curves(monkeypatch, tmp_path):
    asked = {}
    monkeypatch.setattr(isomme.limits, "file_wrong", lambda file, limit: asked.update({file.suffix: limit}) or "")
    for name in ("one.MME", "one.001"):
        (tmp_path / name).write_text("Test object: a\n")
        isomme._read_file(tmp_path / name)
    assert asked == {".MME": isomme.limits.HEADER_FILE, ".001": isomme.limits.CURVE_FILE}


@pytest.mark.parametrize(("objects", "distinct"), [("11", False), ("12", True), ("123", True)])
def test_bodies_of_several_objects_are_told_apart(objects, distinct):
    """Two cars, or three: with one alone its number says nothing."""
    header = {
        "unit": "m/s2", "time of first sample": "0", "sampling interval": "1E-4", "number of samples": "3",
    }  # fmt: skip
    files = [
        MmeFile(Path(f"t.{k:03}"), header | {"channel code": f"{number}{place}"}, np.arange(3.0))
        for k, (number, place) in enumerate(zip(objects, ("ENGN0000000ACXA", "SEAT0000000ACXA", "ENGN0000000ACYA")))
    ]
    notes = []
    names = [track.channel.name for track in isomme._tracks(files, notes)]
    assert not notes and len(names) == len(objects)
    assert all(f"{number}_" in name for number, name in zip(objects, names)) == distinct


def test_the_title_of_an_ev5_header_is_its_own(tmp_path):
    folder = write_folder(tmp_path, SENSORS[:3])
    fields = (folder / "v99.EV5").read_text().split("----- TEST -----")[1].strip().splitlines()[0].split("|")
    assert fields[1] and fields[1] != fields[2]
    assert read_source(folder).test.title == fields[1]


@pytest.mark.parametrize(
    ("lines", "number"),
    [(["# Test Number: 10146"], "10146"), (["# by hand"], "99"), ([], "99"), (["", "Test Number: 10146"], "99")],
)
def test_the_number_of_a_test_is_in_its_first_line_or_its_file_s_name(lines, number):
    assert _test_number(Path("v99.EV5"), lines) == number


@pytest.mark.parametrize(
    ("undecided", "mass", "again"), [(True, 1500.0, True), (False, 1500.0, False), (True, 0.0, False)]
)
def test_only_sensors_that_contradict_each_other_are_compared_with_the_momentum(monkeypatch, undecided, mass, again):
    asked = []
    monkeypatch.setattr(body_means, "_compared", lambda *given: asked.append(given) or "decided")
    compared = {"car": Agreement(np.array([15.0, 9.0]), np.zeros(2), (), undecided)}
    found = body_means._by_momentum(np.zeros(1), {"car": ()}, compared, {"car": mass}, 30e3)
    assert found == ({"car": "decided"} if again else {})
    assert [given[2] for given in asked] == ([20.0] if again else [])


@pytest.mark.parametrize(("named", "before", "source"), [
    ("lab", "", "lab"), ("lab", "other", "lab"), ("", "other", "other"),
])  # fmt: skip
def test_names_say_where_a_test_is_from_where_they_say_so_and_turn_what_faces_the_other_way(
    tmp_path, named, before, source
):
    channels = (
        Channel("a", "acceleration", "car", "x", "curve 1"),
        Channel("b", "acceleration", "car", "z", "curve 2"),
    )
    recording = Recording(Test("one", channels, source=before), np.arange(2) * 1000, np.array([[1.0, 2.0], [3.0, 4.0]]))
    file = tmp_path / "names.yaml"
    file.write_text(f"test: {{source: '{named}'}}\nturned: [car]\n")
    found = apply_names(recording, file)
    assert found.test.source == source
    assert found.values.tolist() == [[-1.0, 2.0], [-3.0, 4.0]]
    assert [channel.source for channel in found.test.channels] == ["curve 1; sign turned", "curve 2"]


def test_a_time_is_as_long_as_from_its_first_sample_to_its_last():
    """Hours at a sample a second are no crash, wherever their zero is."""
    for shift in (0.0, -0.6, -1.0):
        time = np.arange(0.0, 1.2 * LONG, 1.0) + shift * LONG
        with pytest.raises(RecordingError, match="which is no crash"):
            _check_time(Path("t.csv"), time)
    _check_time(Path("t.csv"), np.arange(0.0, 0.9 * LONG, 1.0) + LONG)


@pytest.mark.parametrize(("files", "bag"), [(["metadata.yaml"], True), (["a.mcap"], True), (["a.csv"], False)])
def test_a_folder_is_a_bag_by_its_metadata_or_by_a_file_of_one(tmp_path, files, bag):
    for name in files:
        (tmp_path / name).touch()
    assert is_bag(tmp_path) == bag


@pytest.mark.parametrize("more", [0, 1])
def test_a_csv_file_may_have_as_many_channels_as_are_allowed(more):
    names = [f"c{k}" for k in range(int(limits.CHANNELS.highest) + more)]
    if more:
        with pytest.raises(RecordingError, match=f"has {len(names)} "):
            _checked_header(Path("a.csv"), 1, ["time", *names])
    else:
        _checked_header(Path("a.csv"), 1, ["time", *names])


def test_the_header_of_ev5_says_who_made_the_test_and_how(tmp_path):
    write_two_cars(tmp_path / "v1")
    header = read_header(next((tmp_path / "v1").glob("*.EV5")))
    said = (header.title, header.date, header.laboratory, header.configuration, header.closing_speed)
    assert said == ("TWO CARS HEAD ON", "11/MAY/2012", "LAB", "VTV", 90.0)


@pytest.mark.parametrize(("said", "kept"), [("", 1000), (": No valid data after 67 ms", 670)])
def test_a_curve_is_read_as_far_as_it_is_valid(said, kept):
    table = np.column_stack([np.arange(1000) * 1e-4, np.ones(1000)])
    header = curve("SILL X" + said, first=0, last=999, status="CF" if said else "AM")
    assert len(_read_track(header, "sill_ax", "car", lambda: ("a.001", table)).values) == kept


@pytest.mark.parametrize(
    ("text", "degrees"), [("90", 90.0), ("-90", -90.0), ("360", 360.0), ("999", 0.0), ("N/A", 0.0)]
)
def test_an_impact_angle_that_is_none_counts_as_head_on(text, degrees):
    assert _angle(text) == degrees


@pytest.mark.parametrize(
    ("body", "moved", "like"),
    [
        ("car", ["car"], True),
        ("head", ["head"], False),
        ("car", ["barrier"], False),
        ("object2_car", ["object2_car"], True),
    ],
)
def test_a_speed_is_like_km_h_where_a_car_of_those_that_have_it_loses_as_much(body, moved, like):
    """36 is stated, 10 m/s are lost; of a head nothing is said, nor of a car that stood."""
    time = np.arange(1000) * 1e-4
    columns = {Channel("ax", "acceleration", body, "x"): np.full(1000, -100.0)}
    assert _like_kmh(36.0, moved, time, columns) == like


@pytest.mark.parametrize(("mass", "masses"), [("1200", {1: 1200.0}), (None, {})])
def test_a_vehicle_record_that_ends_before_the_mass_has_none(tmp_path, mass, masses):
    write_two_cars(tmp_path / "v1")
    (file,) = (tmp_path / "v1").glob("*.EV5")
    lines = file.read_text(encoding="latin-1").splitlines()
    at = next(k for k, line in enumerate(lines) if line.startswith("1|16|"))
    fields = lines[at].split("|")[:10] + ([mass] if mass else [])
    lines[at] = "|".join(fields)
    file.write_text("\n".join(lines), encoding="latin-1")
    assert {k: v for k, v in read_header(file).masses.items() if k == 1} == masses


def test_a_file_that_cannot_be_read_is_no_uds_file(tmp_path):
    assert not is_uds(tmp_path / "missing") and not is_uds(tmp_path)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_the_cells_of_a_barrier_are_added_up_and_pressed_by_what_hits_it(monkeypatch, side):
    monkeypatch.setattr(isomme, "body_motion", lambda *given: SimpleNamespace(notes=[], columns={}, outliers=()))
    cells = [Channel(f"cell{k}_fx", "force", "barrier", "x") for k in range(2)]
    tracks = [SimpleNamespace(code="B0BARR0000000FOXP"[:16], channel=cell) for cell in cells]
    values = side * np.array([[1.0, 2.0], [30.0, 10.0], [-3.0, 1.0]])
    made, _ = isomme._made_of_several({}, tracks, cells, np.arange(3), values, notes := [])
    (barrier,) = made.values()
    assert barrier.tolist() == [3.0, 40.0, -2.0]
    assert notes[0].endswith("sign as recorded" if side > 0 else "sign turned")


def test_of_many_curves_that_are_left_out_the_first_ranges_are_listed_and_the_others_counted():
    assert ranges([1, 2, 3, 7]) == "1-3, 7"
    twelve = list(range(0, 24, 2))
    assert ranges(twelve) == ", ".join(map(str, twelve))
    shown = ", ".join(map(str, twelve[:11]))
    assert ranges([*twelve, 30, 31, 32]) == f"{shown} and 4 more"


@pytest.mark.parametrize(("sign", "turned"), [(1, False), (-1, True), (2, None), (0, None)])
def test_a_sign_turns_a_channel_or_leaves_it(tmp_path, sign, turned):
    recording = Recording(Test("one", (Channel("a", "acceleration"),)), np.arange(2) * 1000, np.array([[1.0], [3.0]]))
    file = tmp_path / "names.yaml"
    file.write_text(f"channels: {{a: {{sign: {sign}}}}}\n")
    if turned is None:
        with pytest.raises(RecordingError, match=r"channels\.a\.sign"):
            apply_names(recording, file)
    else:
        assert apply_names(recording, file).values.tolist() == ([[-1.0], [-3.0]] if turned else [[1.0], [3.0]])
