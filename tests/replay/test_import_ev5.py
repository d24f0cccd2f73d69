"""EV5 as NHTSA's guide allows it and as laboratories submit it: headers with holes, values alone."""

import math

import pytest
from numpy.testing import assert_allclose, assert_array_equal
from test_import_nhtsa import SENSORS, record, write_folder

from crash_replay.readers import read_source
from crash_replay.readers.ev5 import Header
from crash_replay.recording import RecordingError


def test_comment_lines_blank_numbers_and_statuses(tmp_path):
    """As NHTSA's guide allows them: # anywhere, a field that is not determined left blank, MN for meaningless."""
    folder = write_folder(tmp_path, [*SENSORS[:3], record(30, "SILL X", [0, 0, 9, 9, 9], status="MN"),
                                     record(31, "ROOF X", [0, 0, 1, 1, 1], status="QD")])  # fmt: skip
    header = folder / "v99.EV5"
    text = header.read_text().replace("|OTH|OTH|36.0|", "|OTH|OTH| |").replace("|AF|1500|", "|AF| |")
    lines = ["# by hand" if line.startswith("----- INST") else "" for line in text.splitlines()]
    text = "\n".join(line + (f"\n{comment}" if comment else "") for line, comment in zip(text.splitlines(), lines))
    header.write_text(text.replace("|36|-2|", "||-2|"))
    recording = read_source(folder)
    notes = "\n".join(recording.test.notes)
    assert recording.test.initial_velocity == {}
    assert "no valid data, says the header: curves 30" in notes and "questionable, says the header: roof_ax" in notes
    assert {"driver_head_ax", "car_ax", "roof_ax"} <= set(recording.test.channel_names)


@pytest.mark.parametrize(
    "wrong, message",
    [
        (lambda text: text.replace("|DRIVER HEAD X", ""), "expected 20 fields in an INSTRUMENTATION record, found 19"),
        (lambda text: text.replace("|100|AM|P|DRIVER", "|x|AM|P|DRIVER"), "step: expected a number, found 'x'"),
        (lambda text: text.replace("|-2|2|100|AM|P|DRIVER", "||2|100|AM|P|DRIVER"), "first: expected a number"),
    ],
)
def test_a_record_at_fault_costs_only_itself(tmp_path, wrong, message):
    file = write_folder(tmp_path) / "v99.EV5"
    text = file.read_text()
    assert wrong(text) != text
    file.write_text(wrong(text))
    recording = read_source(tmp_path)
    assert "driver_head_ax" not in recording.test.channel_names and "car_ax" in recording.test.channel_names
    assert any(n.startswith(f"left out, {message}") and n.endswith("line 8 of v99.EV5") for n in recording.test.notes)


def test_the_separator_in_a_commentary(tmp_path):
    file = write_folder(tmp_path) / "v99.EV5"
    file.write_text(file.read_text().replace("|DRIVER HEAD X", "|DRIVER HEAD X|NO COMMENTS|"))
    assert "driver_head_ax" in read_source(tmp_path).test.channel_names


def test_values_alone_as_laboratories_submit_them(tmp_path):
    """NHTSA's guide: one value a line in any floating-point format, the time from the header; in the folder DATA."""
    expected = read_source(write_folder(tmp_path))
    (tmp_path / "DATA").mkdir()
    for file in tmp_path.glob("v99.*"):
        target = file.rename(tmp_path / "DATA" / file.name)
        if file.suffix != ".EV5":
            values = [float(line.split("\t")[1]) for line in target.read_text().splitlines()]
            target.write_text("".join(f"{x:+.5E}\n".replace("E", "D") for x in values))
    recording = read_source(tmp_path)
    assert recording.test.channel_names == expected.test.channel_names
    assert_array_equal(recording.time_ns, expected.time_ns)
    assert_allclose(recording.values, expected.values, rtol=1e-5)
    assert "v99.024: 3 values, 5 in the header, and no times beside them: curves 24" in "\n".join(recording.test.notes)


def test_vehicles_are_those_of_the_sensors_too(tmp_path):
    """Where the header does not list them, two cars are not one."""
    file = (
        write_folder(tmp_path, [*SENSORS[:3], record(40, "FLOOR LEFT X", [0, 0, 9, 9, 9], location="FLLR", vehicle=2)])
        / "v99.EV5"
    )
    file.write_text(file.read_text().replace("----- VEHICLE -----\n1|16|03|2018|M|4S|V|4CIF|2.5|AF|1500|1\n", ""))
    assert {"vehicle1_car_ax", "vehicle2_car_ax"} <= set(read_source(tmp_path).test.channel_names)


def test_the_header_is_read_in_its_folder_or_in_data_and_nowhere_else(tmp_path):
    """As submitted: in a folder DATA. Another folder's header is another test's; a file named DATA is no folder."""
    inner = tmp_path / "test" / "DATA"
    inner.mkdir(parents=True)
    write_folder(inner)
    other = tmp_path / "test" / "ANOTHER"
    other.mkdir()
    (other / "v11.EV5").write_text("not this one")
    assert read_source(tmp_path / "test").test.id == read_source(inner).test.id
    (tmp_path / "plain").mkdir()
    write_folder(tmp_path / "plain")
    for name in ("v99.EV5",):
        (tmp_path / "plain" / name).rename(tmp_path / "plain" / "kept")
    (tmp_path / "plain" / "DATA").write_text("a file")
    with pytest.raises(RecordingError):
        read_source(tmp_path / "plain")


@pytest.mark.parametrize(
    ("angle", "along"),
    [
        (0.0, True),
        (180.0, True),
        (0.9, True),
        (359.5, True),
        (180.9, True),
        (1.2, False),
        (178.5, False),
        (90.0, False),
    ],
)
def test_vehicles_meet_along_one_line_where_their_axes_agree_within_two_in_ten_thousand(angle, along):
    """Only then their momenta along x are compared."""
    off = 1.0 - abs(math.cos(math.radians(angle)))
    assert Header("1", "", "", "", "VTV", 90.0, angle, {}, ()).along_one_line == along == (off < 2e-4)


def slow(seconds: float) -> list:
    return [(made._replace(step=seconds * 1e6), values) for made, values in SENSORS[:3]]


@pytest.mark.parametrize(("seconds", "read"), [(9.5, True), (10.5, False)])
def test_a_curve_that_is_sampled_too_seldom_is_left_out(tmp_path, seconds, read):
    """Seldomer than every ten seconds is no crash."""
    if not read:
        with pytest.raises(RecordingError):
            read_source(write_folder(tmp_path, slow(seconds)))
        return
    assert read_source(write_folder(tmp_path, slow(seconds))).sample_period == pytest.approx(seconds)
