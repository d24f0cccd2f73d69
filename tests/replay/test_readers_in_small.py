"""Decisions of the readers, each asked alone: what is read of a file's words and of what it does not say."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from test_import_nhtsa import SENSORS, write_folder

from crash_replay.readers import body_means, isomme, nhtsa, read_source
from crash_replay.readers.codes.nhtsa import LOCATIONS
from crash_replay.readers.csv_yaml import LONG, _check_time
from crash_replay.readers.description import apply_names
from crash_replay.readers.ev5 import _test_number
from crash_replay.readers.isomme import MmeFile
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
