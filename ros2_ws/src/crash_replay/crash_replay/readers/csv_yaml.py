"""CSV with a YAML of the same name beside it.

    rib.csv:   time,rib_ay,...         s, or `time [ms]`, then one column for each channel
    rib.yaml:  test: {id: T1, title: "...", source: "...", date: 2019-05-04}
               channels: {rib_ay: {quantity: acceleration, unit: g, body: rib, axis: y, sign: 1}}
               initial_velocity: {rib: 0.0}          m/s at time zero and before it
               initial_displacement: {rib: -0.02}    m at time zero

Lines above the header begin with #. Columns may be separated by semicolons or tabs as well; then numbers may have
decimal commas. A channel's `name` replaces the column's, where that does not fit (letters, digits and underscores).
"""

import csv
import re
from array import array
from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import dropwhile
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field

from .. import limits
from ..recording import SI_UNIT, Channel, Recording, RecordingError, Test
from ..yaml_schema import load_yaml, suggestion
from .dates import checked_stamp
from .description import ChannelNames, Displacements, Part, TestPart, Velocities, unknown_bodies
from .units import si_factor

LONG, SPARSE = 10.0, 0.01
"""s: no crash is that long and sampled that seldom. 10 ms of one, written in ms, look like it."""


SEPARATORS = ",;\t"
TIME = re.compile(r"time[\s_]*[\[(]?\s*(s|ms|us)?\s*[\])]?", re.IGNORECASE)
"""The first column's name."""
SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6}


class CsvChannel(ChannelNames):
    quantity: Literal[tuple(SI_UNIT)]
    unit: str
    sign: Literal[1, -1] = 1


class CsvDescription(Part):
    test: TestPart = TestPart()
    channels: dict[str, CsvChannel] = Field(min_length=1)
    initial_velocity: Velocities = {}
    initial_displacement: Displacements = {}


def found(path: Path) -> bool:
    return path.is_file() and path.suffix.lower() == ".csv"


def read(path: Path) -> Recording:
    """The recording. Raises RecordingError with one line that names file, line and column or key."""
    beside = next((p for p in (path.with_suffix(".yaml"), path.with_suffix(".yml")) if p.is_file()), None)
    if beside is None:
        raise RecordingError(
            f"{path}: expected {path.with_suffix('.yaml').name} beside it, with test and channels (units)"
        )
    description = load_yaml(beside, CsvDescription)
    columns, table = _read_table(path)
    channels, values, notes = [], [], []
    for column, given in description.channels.items():
        if column not in columns:
            raise RecordingError(
                f"{beside}: channels.{column}: {path.name} has no such column; {suggestion(column, columns)}"
            )
        try:
            factor = given.sign * si_factor(given.quantity, given.unit)
        except RecordingError as error:
            raise RecordingError(f"{beside}: channels.{column}: {error}") from None
        source = f"{path.name}: {column} in {given.unit}" + (", sign turned" if given.sign < 0 else "")
        channels.append(Channel(given.name or column, given.quantity, given.body or "", given.axis or "", source))
        values.append(limits.valid_values(table[:, columns.index(column)], factor))
    left_out = [column for column in columns[1:] if column not in description.channels]
    if left_out:
        notes.append(f"left out, not described in {beside.name}: {', '.join(left_out)}")
    notes += unknown_bodies(channels, description.initial_velocity)
    try:
        test = Test(
            id=description.test.id or path.stem,
            channels=tuple(channels),
            title=description.test.title,
            source=description.test.source,
            initial_velocity=description.initial_velocity,
            initial_displacement=description.initial_displacement,
            notes=tuple(notes),
            impact_ns=checked_stamp(description.test.date, "test.date"),
        )
        return Recording(test, np.rint(table[:, 0] * 1e9).astype(np.int64), np.stack(values, axis=1))
    except RecordingError as error:  # two channels of one name, for instance
        raise RecordingError(f"{beside}: {error}") from None


def _read_table(path: Path) -> tuple[list[str], np.ndarray]:
    """The header's names, and the numbers (rows, columns); NaN for an empty cell and for what is not finite."""
    cells = array("d")  # a list of lists of Python's numbers takes five times as much
    try:
        if wrong := limits.file_wrong(path, limits.TABLE_FILE):
            raise RecordingError(f"{path}: {wrong}")
        with path.open(newline="", encoding="utf-8-sig") as file:
            rows = _rows(file)
            line, columns = next(rows, (1, []))
            unit = _checked_header(path, line, columns)
            for line, row in rows:
                cells.extend(_numbers(path, line, columns, row))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise RecordingError(f"{path}: cannot be read as a CSV text file ({error})") from None
    if not cells:
        raise RecordingError(f"{path}: has no samples, only a header")
    table = np.array(cells).reshape(-1, len(columns))
    table[~np.isfinite(table)] = np.nan
    table[:, 0] *= unit
    _check_time(path, table[:, 0])
    return columns, table


def _rows(file: Iterator[str]) -> Iterator[tuple[int, list[str]]]:
    """Line and cells of the header, and of each sample."""
    first, header = next(dropwhile(_is_above, enumerate(file, start=1)), (1, ""))
    separator = max(SEPARATORS, key=header.count)
    yield first, [name.strip() for name in next(csv.reader([header], delimiter=separator), [])]
    lines = csv.reader(file, delimiter=separator)
    for row in lines:
        if row:
            yield first + lines.line_num, row if separator == "," else [cell.replace(",", ".") for cell in row]


def _is_above(numbered: tuple[int, str]) -> bool:
    """Whether a line is not the header yet."""
    return not numbered[1].strip() or numbered[1].startswith("#")


def _checked_header(path: Path, line: int, columns: Sequence[str]) -> float:
    """s in the unit of time."""
    time = TIME.fullmatch(columns[0]) if columns else None
    if len(columns) < 2 or not time:
        raise RecordingError(
            f"{path}:{line}: expected a header of names, separated by commas, semicolons or tabs, the first `time` "
            f"(in s, or `time [ms]`), found {limits.shown(','.join(columns))}; lines above it begin with #"
        )
    if wrong := limits.count_wrong("has", len(columns) - 1, limits.CHANNELS):
        raise RecordingError(f"{path}:{line}: {wrong}")
    doubled = [name for name, count in Counter(columns).items() if count > 1]
    if doubled:
        raise RecordingError(
            f"{path}:{line}: column {limits.shown(doubled[0])} appears more than once: rename or remove one"
        )
    return SECONDS[(time[1] or "s").lower()]


def _numbers(path: Path, line: int, columns: Sequence[str], cells: Sequence[str]) -> list[float]:
    if len(cells) != len(columns):
        more = "; decimal commas need columns separated by semicolons or tabs" if len(cells) > len(columns) else ""
        raise RecordingError(f"{path}:{line}: expected {len(columns)} cells as in the header, found {len(cells)}{more}")
    try:
        return [float(cell) if cell.strip() else np.nan for cell in cells]
    except ValueError:
        name, cell = next((n, c) for n, c in zip(columns, cells, strict=False) if c.strip() and not _is_number(c))
        raise RecordingError(
            f"{path}:{line}: column {limits.shown(name)}: expected a number or an empty cell, found "
            f"{limits.shown(cell)}"
        ) from None


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _check_time(path: Path, time: np.ndarray) -> None:
    """Time is a number in every row, increases by a nanosecond or more, and is in s."""
    row = np.flatnonzero(np.isnan(time))
    if len(row):
        raise RecordingError(f"{path}: sample {row[0]}: time is missing")
    if wrong := limits.times_wrong(time):
        raise RecordingError(
            f"{path}: {wrong}: it must be in s since the impact; is it a date? Of one in ms name the column `time [ms]`"
        )
    backwards = np.flatnonzero(np.diff(np.rint(time * 1e9)) <= 0)
    if len(backwards):
        k = int(backwards[0]) + 1
        raise RecordingError(
            f"{path}: sample {k}: time must increase from sample to sample, "
            f"but {time[k]:.9g} s follows {time[k - 1]:.9g} s"
        )
    if time[-1] - time[0] > LONG and np.median(np.diff(time)) > SPARSE:
        raise RecordingError(
            f"{path}: time runs from {time[0]:.6g} to {time[-1]:.6g} s "
            f"with a sample every {np.median(np.diff(time)):.4g} s, "
            "which is no crash; is it in ms? Then name the column `time [ms]`"
        )
