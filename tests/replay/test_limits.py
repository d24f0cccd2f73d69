"""One table of limits, and what is wrong said once: where a number may come from outside, it is checked against it."""

import math
import os

import numpy as np
import pytest

from crash_estimator.kept import Kept, Rows
from crash_estimator.nodes.samples import Received, received, what_is_wrong
from crash_replay import limits
from crash_replay.complaints import Complaints
from crash_replay.node_parameters import Allowed, ParameterError, checked
from crash_replay.recording import Channel, Recording, RecordingError, Test


@pytest.mark.parametrize("value", [math.nan, math.inf, -1, 11, True, "5", None, [5], 10**300])
def test_what_is_no_number_in_a_range(value):
    wrong = limits.Range(0.0, 10.0, "s", "").wrong(value)
    assert wrong.startswith("must be a number from 0 to 10 s, got ") and len(wrong) < 120


def test_both_ends_are_in_a_range():
    assert not any(
        limits.Range(0.0, 10.0, "s", "").wrong(value) for value in (0, 10, 0.0, np.float64(3.0), np.int64(10))
    )


@pytest.mark.parametrize("value", [[[1] * 10**6] * 100, "x" * 10**6, [10**5000], {k: "x" * 10**5 for k in range(1000)}])
def test_a_bomb_is_shown_in_a_few_words(value):
    assert len(limits.shown(value)) <= 60


def test_an_error_is_one_line_that_a_terminal_can_show():
    assert str(RecordingError("a\n\x1b[2Jb  c")) == "a \\x1b[2Jb c"
    assert len(str(RecordingError("x" * 10**6))) < 1100


def test_what_is_no_file_is_not_opened(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "large").write_bytes(bytes(11))
    size = limits.Range(0, 10, "bytes", "")
    said = {name: limits.file_wrong(tmp_path / name, size) for name in ("pipe", "large", ".")}
    assert said == {
        "pipe": "is not a file",
        "large": "has 11 bytes, more than the 10 allowed",
        ".": "is a folder, not a file",
    }


TEST = Test("t", (Channel("a", "force"), Channel("b", "force")))


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"initial_velocity": {"car": math.nan}}, "initial velocity of 'car' must be"),
        ({"initial_displacement": {"car": 1e9}}, "initial displacement of 'car' must be"),
        ({"channels": (Channel("a", "force"), Channel("a", "force"))}, "channel a appears more than once"),
        ({"title": "x" * 20_000}, "20000 characters"),
        ({"channels": tuple(Channel(f"c{k}", "force") for k in range(2001))}, "2001 channels"),
    ],
)
def test_a_test_that_cannot_be(change, line):
    with pytest.raises(RecordingError, match=line):
        Test(**{"id": "t", "channels": ()} | change)


def test_times_that_no_stamp_can_tell():
    with pytest.raises(RecordingError, match="time must be a number from -10000 to 10000 s"):
        Recording(TEST, np.array([0, 10**14]), np.zeros((2, 2)))


def seen(numbers_and_times) -> Kept:
    kept = Kept(TEST)
    for number, times in numbers_and_times:
        kept.put_rows(Rows(number, np.array(times), np.zeros((len(times), 2))))
    return kept


def message(number: int, times: list[int], values: list[float] | None = None) -> Received:
    return Received(0, number, 0, np.array(times), np.zeros(2 * len(times)) if values is None else np.array(values))


@pytest.mark.parametrize(
    ("sent", "wrong"),
    [
        (message(0, [1, 2]), ""),
        (message(3, [4]), ""),
        (message(3, [4, 6]), ""),
        (message(8, [9]), ""),
        (message(1, [2, 3, 5]), ""),
        (message(0, [1, 3]), "their times are not those"),
        (message(3, [3]), "their times are not those"),
        (message(3, [6]), "their times are not those"),
        (message(8, [5]), "their times are not those"),
        (message(8, [9, 9]), "do not increase"),
        (message(8, [10, 9]), "do not increase"),
        (message(8, [10**17]), "within 10000 s"),
        (message(8, [9], [0.0, math.inf]), "a value is beyond"),
        (message(8, [9], [0.0, math.nan]), ""),
        (message(8, [9], [0.0]), "expected 2 values"),
        (message(8, []), "expected 0 values"),
        (message(99, [100, 101]), "the test has 100 samples"),
        (message(2**63, [100]), "the test has 100 samples"),
    ],
)
def test_samples_that_cannot_be_of_the_test(sent, wrong):
    kept = seen([(0, [1, 2, 3]), (4, [6])])  # number 3 is missing
    said = what_is_wrong(sent, kept, 100)
    assert wrong in said if wrong else said == "", said


@pytest.mark.parametrize(
    "raw",
    [b"", b"\x00\x01\x00\x00", bytes(200), b"\x00\x01\x00\x00" + b"\xff" * 60, b"\x00\x01\x00\x00" + bytes(range(256))],
)
def test_bytes_that_are_no_samples(raw):
    try:
        assert what_is_wrong(received(raw), Kept(TEST), 10)
    except RecordingError as error:
        assert "Samples" in str(error) or "the number of the first sample" in str(error)


def test_what_a_message_claims_takes_no_memory():
    kept = Kept(TEST)
    assert kept.values.nbytes < 1e6
    kept.put_rows(Rows(5_000_000, np.array([1]), np.zeros((1, 2))))
    assert kept.missing(kept.end) == 5_000_000 and kept.gap(0, kept.end) == (0, 5_000_000)


def test_a_flood_is_a_line_now_and_then():
    now, said = [0.0], []
    complaints = Complaints(said.append, lambda: now[0])
    for k in range(1000):
        now[0] = k * 0.01  # 10 s
        complaints.complain("a", "left out")
    complaints.complain("b", "another")
    assert said == ["left out", "left out (and 499 more like it)", "another"]


PARAMETERS = {
    "every": Allowed(0.002, "s", 1e-5, 1e4),
    "port": Allowed(9876, "of the server", 0, 65_535),
    "names": Allowed([""], "of nodes", pattern="[a-z]+"),
    "memory": Allowed("1GB", "to keep", pattern=r"\d+GB"),
    "mode": Allowed("auto", "how", choices=("auto", "true")),
}


@pytest.mark.parametrize(
    ("name", "value"),
    [("every", v) for v in (math.nan, -1, 0, 1e9, "fast", True, None)]
    + [("port", v) for v in (-5, 70_000, 1.5, "x")]
    + [("names", v) for v in (["a", "B"], [1], 5, "a\n")]
    + [("memory", "much"), ("memory", "1GB\x1b"), ("mode", "perhaps")],
)
def test_a_parameter_that_cannot_be(name, value):
    with pytest.raises(ParameterError, match=f"parameter {name} must be .*, got "):
        checked(PARAMETERS, name, value)


def test_parameters_that_can_be():
    given = {"every": 1, "port": 0, "names": "a", "memory": "2GB", "mode": True}
    taken = {"every": 1.0, "port": 0, "names": ["a"], "memory": "2GB", "mode": "true"}
    assert {name: checked(PARAMETERS, name, value) for name, value in given.items()} == taken
