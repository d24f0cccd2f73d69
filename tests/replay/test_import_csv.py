"""CSV with its YAML: units, signs, names, and one line for whatever is wrong."""

from pathlib import Path

import numpy as np
import pytest
from helpers_paths import DATA
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from crash_replay.bag import read_bag, time_zero_ns, write_bag
from crash_replay.readers import read_source
from crash_replay.readers.units import FACTORS, quantity_of, si_factor
from crash_replay.recording import SI_UNIT, RecordingError

CSV = """\
time,rib_ay,barrier_fx,nose_travel,spare
-0.0001,0.5,0,-3,1
0.0,1.0,10,-2,2
0.0001,-2.0,,-1.5,3
0.0002,nan,30,0,4
"""
YAML = """\
test: {id: T1, title: "Rib drop", source: lab}
channels:
  rib_ay: {quantity: acceleration, unit: g, body: rib, axis: y, sign: -1}
  barrier_fx: {quantity: force, unit: kN, body: barrier}
  nose_travel: {quantity: displacement, unit: mm}
initial_velocity: {rib: 0.5, barrier: 0.0}
initial_displacement: {door_upper: -0.02}
"""


def write(folder, table=CSV, description=YAML):
    (folder / "t.csv").write_text(table, encoding="utf-8-sig")
    (folder / "t.yaml").write_text(description)
    return folder / "t.csv"


def error(path, **options):
    with pytest.raises(RecordingError) as raised:
        read_source(path, **options)
    assert "\n" not in str(raised.value)
    return str(raised.value).removeprefix(str(path.parent) + "/")


@pytest.mark.parametrize(
    ("date", "second"),
    [("2019-05-04", 1_556_928_000), ('"2019-05-04 14:30"', 1_556_980_200), ("04.05.2019", 1_556_928_000)],
)
def test_the_date_of_a_test_is_that_of_its_stamps(tmp_path, date, second):
    recording = read_source(write(tmp_path, description=YAML.replace("source: lab", f"source: lab, date: {date}")))
    assert recording.test.impact_ns == time_zero_ns(recording) == second * 10**9
    again = read_bag(write_bag(recording, tmp_path / "b.mcap"))
    assert again.test.impact_ns == second * 10**9
    assert_array_equal(again.time_ns, recording.time_ns)


def test_a_sign_may_be_said_where_nothing_is_turned(tmp_path):
    recording = read_source(write(tmp_path, description=YAML.replace("sign: -1", "sign: 1")))
    assert_allclose(recording.column("rib_ay")[1], 9.80665)
    assert not recording.test.channels[0].source.endswith("sign turned")


def test_a_test_without_a_date_has_stamps_of_1970(tmp_path):
    recording = read_source(write(tmp_path))
    assert recording.test.impact_ns == 0 and time_zero_ns(recording) == 2 * 10**9
    assert read_bag(write_bag(recording, tmp_path / "b.mcap")).test.impact_ns == 0


@pytest.mark.parametrize("date", ["yesterday", "13-04-2019", "1066-10-14", "2101-01-01"])
def test_what_is_no_date_is_said(tmp_path, date):
    path = write(tmp_path, description=YAML.replace("source: lab", f"source: lab, date: {date}"))
    assert f"test.date: expected a date such as 2019-05-04 or 2019-05-04 14:30, got '{date}'" in error(path)


def test_values_units_signs_and_what_is_left_out(tmp_path):
    recording = read_source(write(tmp_path))
    assert_array_equal(recording.time_ns, [-100_000, 0, 100_000, 200_000])
    assert_allclose(recording.column("rib_ay"), np.array([-0.5, -1.0, 2.0, np.nan]) * 9.80665)
    assert_allclose(recording.column("barrier_fx"), [0, 1e4, np.nan, 3e4])
    assert_allclose(recording.column("nose_travel"), [-3e-3, -2e-3, -1.5e-3, 0])
    test = recording.test
    assert (test.id, test.title, test.source) == ("T1", "Rib drop", "lab")
    assert [(c.body, c.axis) for c in test.channels] == [("rib", "y"), ("barrier", ""), ("", "")]
    assert test.channels[0].source == "t.csv: rib_ay in g, sign turned"
    assert test.initial_velocity == {"rib": 0.5, "barrier": 0.0} and test.initial_displacement == {"door_upper": -0.02}
    assert test.notes == ("left out, not described in t.yaml: spare",)


@pytest.mark.parametrize(
    "quantity, unit, value",
    [
        ("acceleration", "g", 9.80665),
        ("acceleration", "m/s^2", 1.0),
        ("velocity", "km/h", 1 / 3.6),
        ("velocity", "mph", 0.44704),
        ("velocity", "mm/s", 1e-3),
        ("displacement", "mm", 1e-3),
        ("displacement", "in", 0.0254),
        ("force", "kN", 1e3),
        ("force", "lbf", 4.4482216152605),
        ("moment", "N*mm", 1e-3),
        ("angular_velocity", "deg/s", np.pi / 180),
        ("angular_velocity", "rpm", 2 * np.pi / 60),
    ],
)
def test_units(quantity, unit, value):
    assert_allclose(si_factor(quantity, unit), value, rtol=1e-14)


def test_every_quantity_has_its_si_unit_and_no_unit_is_of_two():
    for quantity, unit in SI_UNIT.items():
        assert si_factor(quantity, unit) == 1.0
    for quantity, units in FACTORS.items():
        assert all(quantity_of(unit) == quantity for unit in units)


@given(st.lists(st.integers(-(10**9), 10**9), min_size=2, max_size=20, unique=True))
def test_time_is_rounded_to_ns(steps):
    """Whatever ns a time is written from, it comes back as those."""
    from tempfile import TemporaryDirectory

    times = sorted(steps)
    with TemporaryDirectory() as folder:
        path = write(
            Path(folder),
            "time,f\n" + "".join(f"{t * 1e-9!r},1\n" for t in times),
            "channels: {f: {quantity: force, unit: N}}",
        )
        assert_array_equal(read_source(path).time_ns, times)


def test_time_in_ms_is_refused(tmp_path):
    """130 ms at 10 kHz, their time written in ms: read as s, they would be a crash of two minutes."""
    rows = [f"{k * 0.1 - 30.0:.1f},1,2,3,4" for k in range(1301)]
    path = write(tmp_path, "time,rib_ay,barrier_fx,nose_travel,spare\n" + "\n".join(rows))
    assert error(path) == (
        "t.csv: time runs from -30 to 100 s with a sample every 0.1 s, which is no crash; is it in ms? "
        "Then name the column `time [ms]`"
    )
    named = write(tmp_path, "time [ms],rib_ay,barrier_fx,nose_travel,spare\n" + "\n".join(rows))
    assert_allclose(read_source(named).time[[0, -1]], [-0.030, 0.1], rtol=1e-12)


@pytest.mark.parametrize(
    "form",
    [
        lambda table: table.replace(",", ";"),
        lambda table: table.replace(",", ";").replace(".", ","),
        lambda table: table.replace(",", "\t").replace(".", ","),
        lambda table: "# exported by a logger; channel list, 4 of 4\n\n#\n" + table,
        lambda table: table.replace("time", "Time (s)"),
    ],
)
def test_a_table_may_be_written_as_loggers_and_spreadsheets_do(tmp_path, form):
    expected = read_source(write(tmp_path))
    found = read_source(write(tmp_path, form(CSV)))
    assert_array_equal(found.values, expected.values)
    assert_array_equal(found.time_ns, expected.time_ns)


def test_a_mistake_below_lines_above_the_header_has_its_own_line(tmp_path):
    path = write(tmp_path, "# a logger's\n" + CSV.replace("1.0,10,", "1.0,1O,"))
    assert error(path).startswith("t.csv:4: column 'barrier_fx': expected a number")


def test_id_is_the_file_name_where_none_is_given_and_numbers_are_names(tmp_path):
    path = write(tmp_path, description="channels: {rib_ay: {quantity: acceleration, unit: g}}\n")
    assert read_source(path).test.id == "t"
    path = write(tmp_path, description="test: {id: 10146}\nchannels: {rib_ay: {quantity: acceleration, unit: g}}\n")
    assert read_source(path).test.id == "10146"


def test_a_column_may_be_renamed(tmp_path):
    path = write(
        tmp_path,
        "time,Rib Y [g]\n0,1\n1,2\n",
        "channels: {'Rib Y [g]': {name: rib_ay, quantity: acceleration, unit: g}}",
    )
    assert read_source(path).test.channel_names == ("rib_ay",)


def test_names_file_beside_or_given(tmp_path):
    (tmp_path / "names.yaml").write_text(
        "channels: {rib_ay: {name: chest_ay, body: chest}}\ninitial_velocity: {barier: 1.0}\n"
    )
    recording = read_source(write(tmp_path), names=tmp_path / "names.yaml")
    assert recording.test.channels[0].name == "chest_ay" and recording.test.channels[0].body == "chest"
    assert recording.test.initial_velocity == {
        "chest": 0.5,
        "barrier": 0.0,
        "barier": 1.0,
    }  # moved along with its channel
    assert (
        recording.test.notes[-1] == "initial velocity of 'barier': no channel is on this body; did you mean 'barrier'?"
    )
    (tmp_path / "names.yaml").write_text("channels: {rib_az: {name: chest_ay}}\n")
    assert error(tmp_path / "t.csv", names=tmp_path / "names.yaml") == (
        "names.yaml: channels.rib_az: the recording has no such channel; did you mean 'rib_ay'?"
    )


# (what is replaced in the CSV or YAML, by what, the message)
HEADER = "expected a header of names, separated by commas, semicolons or tabs, the first `time` (in s, or `time [ms]`)"
MISTAKES = [
    ("unit: g", "unit: gs", "t.yaml: channels.rib_ay: unknown unit 'gs' for acceleration; expected one of m/s^2, "),
    ("unit: kN", "unit: mm", "t.yaml: channels.barrier_fx: unknown unit 'mm' for force; mm is a unit of displacement"),
    (
        "  barrier_fx:",
        "  barrier_fy:",
        "t.yaml: channels.barrier_fy: t.csv has no such column; did you mean 'barrier_fx'?",
    ),
    ("quantity: force", "quantity: forse", "t.yaml:4: channels.barrier_fx.quantity: should be 'acceleration', "),
    ("unit: kN", "units: kN", "t.yaml:4: unknown key 'units' in channels.barrier_fx; did you mean 'unit'?"),
    ("unit: kN, ", "", "t.yaml:4: key 'unit' is missing in channels.barrier_fx"),
    ("sign: -1", "sign: 2", "t.yaml:3: channels.rib_ay.sign: should be 1 or -1, found 2"),
    ("axis: y", "axis: w", "t.yaml:3: channels.rib_ay.axis: should be 'x', 'y', 'z' or '', found 'w'"),
    ("rib: 0.5", "rib: .nan", "t.yaml:6: initial_velocity.rib: must be a number from -10000 to 10000 m/s, got nan"),
    ("time,", "t,", f"t.csv:1: {HEADER}, found 't,rib_ay,barrier_fx,nose_travel,spare'"),
    ("time,", "Logger 7\ntime,", f"t.csv:1: {HEADER}, found 'Logger 7'; lines above it begin with #"),
    (",barrier_fx,", ",rib_ay,", "t.csv:1: column 'rib_ay' appears more than once"),
    ("0.0,1.0,10,", "0.0,1.0,1O,", "t.csv:3: column 'barrier_fx': expected a number or an empty cell, found '1O'"),
    ("-2.0,,", "-2.0,", "t.csv:4: expected 5 cells as in the header, found 4"),
    ("0.0002,", "0.0001,", "t.csv: sample 3: time must increase from sample to sample, but 0.0001 s follows 0.0001 s"),
    ("0.0001,-2", "-0.0001,-2", "t.csv: sample 2: time must increase from sample to sample, but -0.0001 s follows 0 s"),
    ("0.0001,-2", ",-2", "t.csv: sample 2: time is missing"),
    (CSV.split("\n", 1)[1], "", "t.csv: has no samples, only a header"),
    (CSV, "", "t.csv:1: expected a header"),
    (
        "1.0,10,",
        "1,0,10,",
        "t.csv:3: expected 5 cells as in the header, found 6; decimal commas need columns separated",
    ),
]


@pytest.mark.parametrize("good, bad, expected", MISTAKES)
def test_mistakes(tmp_path, good, bad, expected):
    assert good in CSV or good in YAML
    table = CSV.replace(good, bad, 1) if good in CSV else CSV
    assert error(write(tmp_path, table, YAML if good in CSV else YAML.replace(good, bad, 1))).startswith(expected)


def test_missing_yaml_and_binary_file(tmp_path):
    (tmp_path / "t.csv").write_text(CSV)
    assert error(tmp_path / "t.csv") == "t.csv: expected t.yaml beside it, with test and channels (units)"
    (tmp_path / "t.yaml").write_text(YAML)
    (tmp_path / "t.csv").write_bytes(b"\xff\xfe\x00")
    assert error(tmp_path / "t.csv").startswith("t.csv: cannot be read as a CSV text file")


def test_sources_of_no_known_form(tmp_path):
    assert error(tmp_path / "no.csv") == "no.csv: there is no such file or folder"
    (tmp_path / "notes.txt").write_text("hello")
    text = error(tmp_path / "notes.txt")
    assert "no recording of a known form" in text
    assert all(form in text for form in (".csv file with a .yaml", ".EV5 header", ".mme header", "rosbag2 folder"))
    assert "takes no option 'cells'" in error(write(tmp_path), cells=True)


@pytest.mark.skipif(not (DATA / "cyberdiver").is_dir(), reason=f"no recordings in {DATA}")
def test_real_files():
    """A 50 kHz impactor: the damped one at 2 m/s; values at its first sample and its peaks as in the file."""
    recording = read_source(DATA / "cyberdiver/linear_damped__15npmm_2mps_025damping_trial1.csv")
    assert len(recording) == 4000
    assert_allclose(recording.sample_period, 20e-6, rtol=1e-12)
    assert_array_equal(np.unique(np.diff(recording.time_ns)), [20_000])
    first = [0.1259766 * 9.80665, 0.01599999e-3, 5.355e-3, -0.0976719]
    assert_allclose(recording.values[0], first, rtol=1e-12)
    assert recording.test.channel_names == ("body_ax", "rel_displacement", "rel_velocity", "actuator_force")
    for path in sorted((DATA / "cyberdiver").glob("*.csv")):
        assert np.isfinite(read_source(path).values).all()
