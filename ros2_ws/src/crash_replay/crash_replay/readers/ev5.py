"""The header of an NHTSA crash test in EV5 form: sections of records whose fields are separated by `|`.

The fields follow NHTSA's test reference guide, version 5.
"""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from ..limits import HEADER_FILE, Range, file_wrong, shown
from ..recording import RecordingError


class Curve(NamedTuple):
    """One INSTRUMENTATION record."""

    vehicle: int  # 0: the barrier
    number: int  # the file's suffix
    sensor: str  # AC, LC, DS, AV, ...
    occupant: str  # 01 driver, 02 passenger, NA
    location: str  # HDCG, ENGN, FLLR, LC0101, ...
    axis: str  # XL, YG, NA, ...
    time_unit: str
    unit: str  # G'S, NWT, ...
    prefilter: str  # Hz
    maker: str
    calibration: str
    full_scale: str
    full_scale_used: str  # %
    initial_velocity: float  # km/h along the axis; NaN where it is not stated
    first: int  # index of the first sample; time zero is index 0
    last: int
    step: float  # us
    status: str  # AM as measured, CM computed, CF failed, MN meaningless, SF system failed, QD questionable, NO none
    redundancy: str  # P primary, R redundant
    comment: str


class Header(NamedTuple):
    number: str  # of the test
    title: str
    date: str
    laboratory: str
    configuration: str  # VTB: vehicle into barrier, ...
    closing_speed: float  # km/h
    impact_angle: float  # degrees between the vehicles' long axes
    masses: dict[int, float]  # vehicle -> test mass in kg
    curves: tuple[Curve, ...]
    wrong: tuple[tuple[str, str], ...] = ()  # records that are at fault: why, and which line

    @property
    def vehicles(self) -> int:
        """How many there are, by their own records or by those of their sensors."""
        return len({*self.masses, *(curve.vehicle for curve in self.curves)} - {0})

    @property
    def along_one_line(self) -> bool:
        """Whether two vehicles meet head on or one from behind: only then their x axes lie on one line."""
        return min(self.impact_angle % 180.0, -self.impact_angle % 180.0) < SMALL_ANGLE


INDEX = Range(-1e8, 1e8, "", "of a sample: ten seconds at 10 MHz")
SPEED = Range(-1e4, 1e4, "km/h", "ten times that of sound")
NUMERIC = {
    "vehicle": (int, Range(0, 99, "", "two digits")),
    "number": (int, Range(0, 99_999, "", "of a file's suffix")),
    "initial_velocity": (float, SPEED),
    "first": (int, INDEX),
    "last": (int, INDEX),
    "step": (float, Range(0, 1e7, "us", "0 of a sensor that is not fitted")),
}
"""A curve's fields that are numbers, of what kind, and what they may be."""
UNKNOWN = ("", "N/A", "NA", "UNK", "UN", "UNKNOWN", "NULL")
TEST_FIELDS = 20
SMALL_ANGLE = 1.0
"""Degrees: its cosine is one within 0.02 %."""
TEST_MASS = Range(0, 1e6, "kg", "0 where it is not stated")


def read_header(path: Path) -> Header:
    """The header. Raises RecordingError with file, line and what was expected."""
    try:
        if wrong := file_wrong(path, HEADER_FILE):
            raise RecordingError(f"{path}: {wrong}")
        lines = path.read_text(encoding="latin-1").splitlines()
    except OSError as error:
        raise RecordingError(f"{path}: cannot be read: {error.strerror or error}") from None
    sections: dict[str, list[tuple[int, list[str]]]] = {}
    name = ""
    for number, line in enumerate(lines, start=1):
        if line.startswith("-----"):
            name = line.strip("- \r")
        elif name and line.strip() and not line.startswith("#"):  # a comment may stand anywhere
            sections.setdefault(name, []).append((number, line.rstrip("\r").split("|")))
    for wanted in ("TEST", "INSTRUMENTATION"):
        if not sections.get(wanted):
            raise RecordingError(
                f"{path}: expected an EV5 header with a section `----- {wanted} -----` and records in it"
            )
    curves, faults = _curves(path, sections["INSTRUMENTATION"])
    at, test = sections["TEST"][0]
    if len(test) < TEST_FIELDS:
        raise RecordingError(f"{path}:{at}: expected {TEST_FIELDS} fields in a TEST record, found {len(test)}")
    return Header(
        number=_test_number(path, lines),
        title=test[1],
        date=test[3],
        laboratory=test[4],
        configuration=test[8],
        closing_speed=_number(path, at, "closing speed", _stated(test[14]), SPEED),
        impact_angle=_angle(test[15]),
        masses={
            int(_number(path, n, "vehicle", f[0], NUMERIC["vehicle"][1])): _number(
                path, n, "test mass", _stated(f[10]), TEST_MASS
            )
            for n, f in sections.get("VEHICLE", [])
            if len(f) > 10
        },
        curves=curves,
        wrong=faults,
    )


def _test_number(path: Path, lines: Sequence[str]) -> str:
    """From the first comment line, else from the file's name (v10146.EV5)."""
    if lines and "Test Number:" in lines[0]:
        return lines[0].split("Test Number:")[1].strip()
    return path.stem.lstrip("vV")


def _curves(
    path: Path, records: Sequence[tuple[int, Sequence[str]]]
) -> tuple[tuple[Curve, ...], tuple[tuple[str, str], ...]]:
    """The curves, and of each record at fault why and where: it costs only itself. Raises where none is left."""
    curves, wrong = [], []
    for line, fields in records:
        try:
            curves.append(_curve(path, line, fields))
        except RecordingError as error:
            if len(records) == 1:
                raise
            wrong.append((str(error).removeprefix(f"{path}:{line}: "), f"line {line} of {path.name}"))
    if not curves:
        raise RecordingError(f"{path}: none of {len(wrong)} INSTRUMENTATION records can be read: {wrong[0][0]}")
    return tuple(curves), tuple(wrong)


def _stated(text: str) -> str:
    """A number that may be left blank, or said to be unknown: 0 then."""
    return "0" if text.strip().upper() in UNKNOWN else text


def _curve(path: Path, line: int, fields: Sequence[str]) -> Curve:
    if len(fields) > len(Curve._fields):  # a commentary may have the separator in it
        last = len(Curve._fields) - 1
        fields = [*fields[:last], "|".join(fields[last:]).strip("| ")]
    if len(fields) != len(Curve._fields):
        raise RecordingError(
            f"{path}:{line}: expected {len(Curve._fields)} fields in an INSTRUMENTATION record, found {len(fields)}"
        )
    given: dict[str, Any] = dict(zip(Curve._fields, (field.strip() for field in fields), strict=False))
    for name, (kind, limit) in NUMERIC.items():
        # what is not determined is left blank: a velocity then is none, a count is an error
        unstated = name == "initial_velocity" and given[name].upper() in UNKNOWN
        given[name] = math.nan if unstated else kind(_number(path, line, name, given[name], limit))
    return Curve(**given)


def _angle(text: str) -> float:
    """Degrees; 0 where it is not stated, as for a barrier."""
    try:
        angle = float(text)
    except ValueError:
        return 0.0
    return angle if abs(angle) <= 360.0 else 0.0


def _number(path: Path, line: int, what: str, text: str, limit: Range) -> float:
    try:
        number = float(text)
    except ValueError:
        raise RecordingError(f"{path}:{line}: {what}: expected a number, found {shown(text)}") from None
    if wrong := limit.wrong(number):
        raise RecordingError(f"{path}:{line}: {what} {wrong}")
    return number
