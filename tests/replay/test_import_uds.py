"""NHTSA's UDS files: the same test as in EV5 form, in each form of numbers, and what is at fault."""

import numpy as np
import pytest
from helpers_ev5 import MASSES, two_cars, write_two_cars
from helpers_uds import CODES, uds_file, write_uds
from numpy.testing import assert_allclose, assert_array_equal

from crash_replay.readers import read_source
from crash_replay.readers.codes.nhtsa import code_of_attachment, code_of_status
from crash_replay.readers.codes.nhtsa_library import DATA_STATUS, SENSOR_ATTACHMENTS
from crash_replay.readers.uds import _floats, read_uds
from crash_replay.recording import RecordingError


def records():
    made = []
    for record, values in two_cars():
        fields = record.split("|")
        fields[4] = CODES.get(fields[4], fields[4])
        made.append(("|".join(fields), values))
    return made


@pytest.fixture(scope="module")
def expected(tmp_path_factory):
    return read_source(write_two_cars(tmp_path_factory.mktemp("ev5") / "made", 7292, records()))


@pytest.mark.parametrize("form, xy", [("IEEE", False), ("VAX", False), ("SUN", False), ("IEEE", True)])
def test_the_same_test_as_in_ev5_form(expected, tmp_path, form, xy):
    recording = read_source(write_uds(tmp_path / "uds", records(), form=form, xy=xy))
    assert recording.test.channel_names == expected.test.channel_names
    assert [c.body for c in recording.test.channels] == [c.body for c in expected.test.channels]
    assert_array_equal(recording.time_ns, expected.time_ns)
    assert_allclose(recording.values, expected.values, rtol=1e-4, atol=1e-3)  # EV5's text has five decimals of a g
    assert recording.test.id == "7292" and recording.test.title == "TWO CARS HEAD ON"
    for body, velocity in expected.test.initial_velocity.items():
        assert_allclose(recording.test.initial_velocity[body], velocity, rtol=1e-5)
    notes = "\n".join(recording.test.notes)
    assert (
        "outlier vehicle1_floor_left_rear_ax" in notes and "closing speed 90 km/h, test mass 1200 kg, 1800 kg" in notes
    )


@pytest.mark.parametrize("form", ["IEEE", "VAX", "SUN"])
def test_of_a_last_record_that_is_not_full_only_the_curve_s_samples_are_read(tmp_path, form):
    record, values = records()[0]
    file = tmp_path / "v07292.001"
    file.write_bytes(uds_file(record.split("|"), values[:132], 7292, form))
    (curve,) = read_uds(file)
    assert curve.y.shape == (132,)
    assert_allclose(curve.y, values[:132], rtol=1e-6)


def test_numbers_of_a_vax():
    """NHTSA's own example: 100 is 00 00 43 C8 from the fourth byte to the first, 0 is 00 00 00 00."""
    assert_array_equal(_floats(bytes([0xC8, 0x43, 0, 0]) + bytes(4), "VAX"), [100.0, 0.0])


def test_a_signalling_nan_is_a_hole(tmp_path):
    folder = wrong(tmp_path, changed(1536 + 12 + 400, bytes([1, 0, 0xA0, 0x7F])))
    assert list(np.flatnonzero(np.isnan(read_source(folder).values[:, 0]))) == [100]


def wrong(tmp_path, change):
    record, values = records()[0]
    data = bytearray(uds_file(record.split("|"), values, 7292, "IEEE"))
    data = change(data)
    folder = tmp_path / "uds"
    folder.mkdir()
    (folder / "v07292.001").write_bytes(data)
    return folder


def changed(at, text):
    def change(data):
        data[at : at + len(text)] = text
        return data

    return change


@pytest.mark.parametrize(
    "change, message",
    [
        (changed(26, b"CRAY "), "v07292.001: expected NUMFORM IEEE, VAX or SUN, found 'CRAY'"),
        (changed(31, b"OLD"), "expected DIMSYS MET, SI, ENG, found 'OLD'"),
        (lambda data: data[:600], "expected a header and a curve's|it has no record CURVE HDR"),
        (lambda data: data[:-512], "v07292.001: 2500 samples are stated, 2375 are there"),
        (lambda data: data[:-100], "v07292.001: 2500 samples are stated, 2475 are there"),
        (lambda data: data[:512], "expected a header and a curve's"),
        (changed(1536 + 512, b"X DATA"), "samples are stated"),
        (changed(1024 + 128, b"DEFLECTION"), "it is over deflection, not over time"),
        (changed(1024 + 108, b"JOULES              "), "unit JOULES has no ROS message"),
    ],
)
def test_files_at_fault(tmp_path, change, message):
    folder = wrong(tmp_path, change)
    with pytest.raises(RecordingError, match=message) as raised:
        read_source(folder)
    assert "\n" not in str(raised.value)


def test_a_file_at_fault_costs_only_itself_and_tests_are_not_mixed(tmp_path):
    folder = write_uds(tmp_path / "uds", records())
    file = next(folder.glob("*.002.uds"))
    file.write_bytes(file.read_bytes()[:-512])
    recording = read_source(folder)
    assert "vehicle1_driver_chest_ax" not in recording.test.channel_names
    assert any(note.startswith("left out, v07292aa0.002.uds: 2500 samples") for note in recording.test.notes)
    write_uds(folder, records()[:1], number=7293)
    with pytest.raises(RecordingError, match="expected the curves of one test, found 7292, 7293"):
        read_source(folder)


def test_half_empty_garbage_is_refused_in_one_line(tmp_path):
    """Whatever bytes follow the mark."""
    rng = np.random.default_rng(3)
    for k in range(20):
        folder = tmp_path / f"f{k}"
        folder.mkdir()
        (folder / "x.uds").write_bytes(b"UDS-1992    " + rng.bytes(14) + b"IEEE MET" + rng.bytes(4000))
        with pytest.raises(RecordingError):
            read_source(folder)


@pytest.mark.parametrize(("number", "said"), [(7292, "7292"), (0, "A-12")])
def test_a_test_without_a_number_goes_by_its_name(tmp_path, number, said):
    record, values = records()[0]
    data = uds_file(record.split("|"), values, number, "IEEE")
    named = data.replace(str(number).rjust(12).encode(), b"A-12".rjust(12), 1)
    assert named != data
    (tmp_path / "v07292.001").write_bytes(named)
    assert read_source(tmp_path).test.id == said


def test_words_of_the_library_are_its_codes():
    for known, code_of in ((SENSOR_ATTACHMENTS, code_of_attachment), (DATA_STATUS, code_of_status)):
        by_words = {}
        for code, words in known.items():
            by_words.setdefault(words, code)
        assert len(by_words) > 5 and all(code_of(words) == code for words, code in by_words.items())
        assert code_of("NO SUCH WORDS") == "NO SUCH WORDS"


def test_what_a_barrier_weighs_is_no_cars_mass(tmp_path, monkeypatch):
    """Component 0 is what the car runs into; a file of one of its sensors states a weight as every other does."""
    record, values = records()[3]
    cell = "|".join(["0", *record.split("|")[1:]]).replace("|4|", "|40|", 1)
    monkeypatch.setitem(MASSES, 0, 80_000.0)
    made = uds_file(cell.split("|"), values, 7292, "IEEE")
    folder = write_uds(tmp_path / "uds", [records()[3]])
    (folder / "v07292aa0.040.uds").write_bytes(made)
    notes = "\n".join(read_source(folder).test.notes)
    assert "test mass 1200 kg" in notes and "80000" not in notes
