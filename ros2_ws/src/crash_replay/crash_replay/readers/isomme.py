"""ISO-MME folder (ISO/TS 13499): NAME.mme says what the test is, Channel/NAME.001, ... hold a channel each.

Every file starts with lines `Key   :value`; in a channel file the values follow, one a line. Their time
is a start and a step, or another channel's values ("explicit").
"""

import re
from array import array
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .. import limits
from ..recording import Channel, Recording, RecordingError, Test
from .dates import stamp_of
from .isomme_codes import channel_of, is_time
from .units import si_factor

FAILED = ("channel failed", "system failed", "meaningless data", "no data")
SAME_BASE = 0.75
"""Samples of one rate that leave less than this share of their step between them lie on two time bases."""


class MmeFile(NamedTuple):
    """A file's header, keys in lower case, and the values below it."""

    file: Path
    header: Mapping[str, str]
    values: np.ndarray

    def get(self, key: str) -> str:
        """The value of a key, "" where there is none."""
        value = self.header.get(key, "")
        return "" if value.upper() == "NOVALUE" else value

    def number(self, key: str, limit: limits.Range) -> float:
        try:
            number = float(self.get(key))
        except ValueError:
            raise RecordingError(f"{key!r}: expected a number, found {limits.shown(self.header.get(key))}") from None
        if wrong := limit.wrong(number):
            raise RecordingError(f"{key!r} {wrong}")
        return number

    @property
    def code(self) -> str:
        return self.get("channel code").upper()


class Track(NamedTuple):
    """A channel that can be used: n values in SI at n times in ns."""

    code: str
    channel: Channel
    time_ns: np.ndarray
    values: np.ndarray

    @property
    def step(self) -> int:
        return round(float(np.median(np.diff(self.time_ns)))) if len(self.time_ns) > 1 else 0


def found(path: Path) -> bool:
    return path.is_dir() and bool(_named(path, r".*\.mme"))


def _named(folder: Path, pattern: str) -> list[Path]:
    return sorted(entry for entry in folder.iterdir() if re.fullmatch(pattern, entry.name, re.IGNORECASE))


def read(path: Path) -> Recording:
    """The recording. Raises RecordingError where the header is at fault or no channel can be used."""
    headers = _named(path, r".*\.mme")
    if len(headers) != 1:
        raise RecordingError(f"{path}: expected one .mme header, found {', '.join(file.name for file in headers)}")
    header = _read_file(headers[0])
    folder = next(iter(_named(path, "channel")), path)
    files = [_read_file(file) for file in _named(folder, r".*\.\d{3,}")]
    if not files:
        raise RecordingError(f"{folder}: no channel files (NAME.001, NAME.002, ...)")
    tracks, notes = _tracks(files)
    if not tracks:
        raise RecordingError(f"{path}: no channel can be used: {'; '.join(notes)}")
    tracks, time_ns, values = _common_time(path, tracks, notes)
    if any(track.code[0] == "B" and track.channel.quantity == "force" for track in tracks):
        notes.append("barrier forces keep their recorded sign; a model expects compression to be positive")
    source = [header.get("laboratory name"), header.get("date of the test"), headers[0].name]
    velocity = _initial_velocity(header, tracks, notes)
    try:
        test = Test(
            id=header.get("test number") or header.get("laboratory test ref. number") or headers[0].stem,
            channels=_unique([track.channel for track in tracks]),
            title=header.get("title") or header.get("type of the test") or header.get("test type"),
            source=", ".join(filter(None, source)),
            initial_velocity=velocity,
            notes=tuple(notes),
            impact_ns=stamp_of(header.get("date of the test") or ""),
        )
        return Recording(test, time_ns, values)
    except RecordingError as error:
        raise RecordingError(f"{path}: {error}") from None


def _read_file(file: Path) -> MmeFile:
    try:
        if wrong := limits.file_wrong(file, limits.HEADER_FILE if file.suffix.lower() == ".mme" else limits.CURVE_FILE):
            raise RecordingError(f"{file}: {wrong}")
        data = file.read_bytes()
    except OSError as error:
        raise RecordingError(f"{file}: cannot be read: {error.strerror or error}") from None
    try:
        lines = data.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:  # older editions of the standard
        lines = data.decode("latin-1").splitlines()
    header: dict[str, str] = {}
    values = array("d")
    for number, line in enumerate(lines, start=1):
        key, colon, value = line.partition(":")
        if colon and not values:
            header.setdefault(key.strip().lower(), value.strip())
        elif line.strip() and file.suffix.lower() != ".mme":
            try:
                values.append(float(line))
            except ValueError:
                raise RecordingError(
                    f"{file}:{number}: expected a number, found {limits.shown(line.strip())}"
                ) from None
    return MmeFile(file, header, np.array(values))


def _tracks(files: Sequence[MmeFile]) -> tuple[list[Track], list[str]]:
    """The usable channels, and a note for each of the others."""
    by_code = {file.code: file for file in files}
    several = len({code[:1] for code in by_code if code[:1].isdigit()}) > 1
    tracks, notes = [], []
    for file in files:
        if is_time(file.code):
            continue
        try:
            status = file.get("data status").lower()
            if status in FAILED or not len(file.values):
                raise RecordingError(f"its status is {status!r}" if status in FAILED else "it has no values")
            unit = file.get("unit")
            channel = channel_of(file.code, f"{file.file.name}: {file.code}, {unit}", several)
            values = limits.valid_values(file.values, si_factor(channel.quantity, unit))
            tracks.append(Track(file.code, channel, _time_ns(file, by_code), values))
        except RecordingError as why:
            notes.append(f"left out, {file.file.name}: {why}")
    return tracks, notes


def _time_ns(file: MmeFile, by_code: Mapping[str, MmeFile]) -> np.ndarray:
    """(n,) int64 ns of a channel's values."""
    n = len(file.values)
    if file.get("reference channel").lower() == "explicit":
        name = file.get("reference channel name").upper()
        if name not in by_code:
            raise RecordingError(f"its time channel {name or '(not named)'} is missing")
        seconds = by_code[name].values
        if len(seconds) != n:
            raise RecordingError(f"it has {n} values, its time channel {name} has {len(seconds)}")
    else:
        start, step = file.number("time of first sample", limits.TIME), file.number("sampling interval", limits.PERIOD)
        seconds = start + np.arange(n) * step
    if wrong := limits.times_wrong(seconds):
        raise RecordingError(wrong)
    time_ns = np.rint(seconds * 1e9).astype(np.int64)
    if np.any(np.diff(time_ns) <= 0):
        raise RecordingError("its time does not increase from sample to sample")
    return time_ns


def _common_time(path: Path, tracks: Sequence[Track], notes: list[str]) -> tuple[list[Track], np.ndarray, np.ndarray]:
    """The channels of the commonest sample rate on one time base, NaN where a channel has no value."""
    step = Counter(track.step for track in tracks).most_common(1)[0][0]
    used = [track for track in tracks if track.step == step]
    others = [track.channel.name for track in tracks if track.step != step]
    if others:
        notes.append(f"left out, sampled at another rate than {1e9 / max(step, 1):g} Hz: {', '.join(others)}")
    time_ns = np.unique(np.concatenate([track.time_ns for track in used]))
    if len(time_ns) > 1 and np.median(np.diff(time_ns)) < SAME_BASE * step:
        raise RecordingError(
            f"{path}: mixed sample times: channels are sampled between each other's samples; use one time base"
        )
    if wrong := limits.size_wrong(len(time_ns), len(used)):
        raise RecordingError(f"{path}: {wrong}")
    values = np.full((len(time_ns), len(used)), np.nan)
    for column, track in enumerate(used):
        values[np.searchsorted(time_ns, track.time_ns), column] = track.values
        if len(track.values) < len(time_ns):
            notes.append(f"{track.channel.name}: {len(track.values)} of {len(time_ns)} samples, NaN elsewhere")
    return used, time_ns, values


def _unique(channels: Sequence[Channel]) -> tuple[Channel, ...]:
    """Where a second channel has the same name it gets `_2` and so on."""
    taken: Counter[str] = Counter()
    unique = []
    for channel in channels:
        taken[channel.name] += 1
        number = taken[channel.name]
        unique.append(channel if number == 1 else replace(channel, name=f"{channel.name}_{number}"))
    return tuple(unique)


def _initial_velocity(header: MmeFile, tracks: Sequence[Track], notes: list[str]) -> dict[str, float]:
    """m/s of each body of a test object whose velocity the header gives (in m/s, or with its unit)."""
    velocity: dict[str, float] = {}
    for key in header.header:
        test_object = re.fullmatch(r"velocity test object (\w)(?: lon\.?)?", key)
        stated = re.fullmatch(r"([-+]?[0-9.]+(?:[eE][-+]?\d+)?) *(\S*)", header.get(key))
        if test_object and stated:
            try:
                speed = float(stated[1]) * si_factor("velocity", stated[2] or "m/s")
                if wrong := limits.VELOCITY.wrong(speed):
                    raise RecordingError(wrong)
            except ValueError as error:
                raise RecordingError(f"{header.file}: {key}: {error}") from None
            bodies = dict.fromkeys(track.channel.body for track in tracks if track.code[0] == test_object[1])
            velocity |= dict.fromkeys(bodies, speed)
            if bodies:
                notes.append(f"initial velocity {speed:.4g} m/s along the object's own x: {', '.join(bodies)}")
    return velocity
