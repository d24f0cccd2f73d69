"""ISO-MME folder (ISO/TS 13499): NAME.mme says what the test is, Channel/NAME.001, ... hold a channel each.

Every file starts with lines `Key   :value`; in a channel file the values follow, one a line, NOVALUE where there is
none. Their time is a start and a step, or another channel's values ("explicit"). A file at fault costs only itself.
"""

import math
import re
from array import array
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .. import limits
from ..progress import with_progress
from ..recording import Channel, Recording, RecordingError, Test
from ..shortened import shortened
from ..unique_names import unique
from .body_means import Sensor, body_motion
from .codes.isomme import channel_of, is_time, object_of, other_sign
from .dates import stamp_of
from .isomme_velocity import initial_velocity
from .units import si_factor

NO_VALUE = "NOVALUE"
FAILED = ("channel failed", "system failed", "meaningless data", "no data")
LASTS = 0.8
"""Share of the record that a body's motion must be known for."""
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
        return "" if value.upper() == NO_VALUE else value

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


def read(path: Path, all_sensors: bool = False) -> Recording:
    """The recording; with `all_sensors` also those that contradict the others of their body.

    Raises RecordingError where the header is at fault or no channel can be used.
    """
    headers = _named(path, r".*\.mme")
    if len(headers) != 1:
        raise RecordingError(f"{path}: expected one .mme header, found {', '.join(file.name for file in headers)}")
    header = _read_file(headers[0])
    folder = next(iter(_named(path, "channel")), path)
    named = _named(folder, r".*\.\d{3,}")
    if not named:
        raise RecordingError(f"{folder}: no channel files (NAME.001, NAME.002, ...)")
    files, notes = [], []
    for file in with_progress(named, "reading channel"):
        try:
            files.append(_read_file(file))
        except RecordingError as why:
            notes.append(f"left out, {file.name}: {str(why).removeprefix(f'{file}:').strip()}")
    tracks = _tracks(files, notes)
    if not tracks:
        raise RecordingError(f"{path}: no channel can be used: {shortened(notes)}")
    tracks, time_ns, values = _common_time(path, tracks, notes)
    channels = unique([track.channel for track in tracks])
    if turned := [channel.name for track, channel in zip(tracks, channels) if other_sign(track.code)]:
        notes.append(
            f"direction 1, 2 or 3 in the code: the sign is not that of SAE J211: turn what looks wrong with --names "
            f"(sign: -1): {shortened(turned)}"
        )
    if any(_on_barrier(track.code, channel) for track, channel in zip(tracks, channels)):
        notes.append("barrier forces keep their recorded sign; a model expects compression to be positive")
    made, outliers = _made_of_several(header, tracks, channels, time_ns, values, notes)
    means = {channel.name for channel in made}
    kept = [replace(c, name=f"{c.name}_sensor") if c.name in means else c for c in channels]
    columns = made | {c: v for c, own, v in zip(kept, channels, values.T) if all_sensors or own.name not in outliers}
    source = [header.get("laboratory name"), header.get("date of the test"), headers[0].name]
    bodies = [(track.code[0], track.channel.body) for track in tracks]
    velocity, about = initial_velocity(header.file, header.header, bodies, time_ns * 1e-9, columns)
    notes += about
    try:
        test = Test(
            id=header.get("test number") or header.get("laboratory test ref. number") or headers[0].stem,
            channels=tuple(columns),
            title=header.get("title") or header.get("type of the test") or header.get("test type"),
            source=", ".join(filter(None, source)),
            initial_velocity=velocity,
            notes=tuple(notes),
            impact_ns=stamp_of(header.get("date of the test") or ""),
        )
        return Recording(test, time_ns, np.stack(list(columns.values()), axis=1))
    except RecordingError as error:
        raise RecordingError(f"{path}: {error}") from None


def _read_file(file: Path) -> MmeFile:
    try:
        if wrong := limits.file_wrong(file, limits.HEADER_FILE if file.suffix.lower() == ".mme" else limits.CURVE_FILE):
            raise RecordingError(f"{file}: {wrong}")
        data = file.read_bytes()
    except OSError as error:
        raise RecordingError(f"{file}: cannot be read: {error.strerror or error}") from None
    wide = data[:2] in (b"\xff\xfe", b"\xfe\xff")
    try:
        lines = data.decode("utf-16" if wide else "utf-8-sig").splitlines()
    except UnicodeDecodeError:  # older editions of the standard
        lines = data.decode("latin-1").splitlines()
    header: dict[str, str] = {}
    values = array("d")
    for number, line in enumerate(lines, start=1):
        key, colon, value = line.partition(":")
        if colon and not len(values):
            header.setdefault(key.strip().lower(), value.strip())
        elif line.strip() and file.suffix.lower() != ".mme":
            try:
                values.append(math.nan if line.strip().upper() == NO_VALUE else float(line))
            except ValueError:
                raise RecordingError(
                    f"{file}: line {number}: expected a number, found {limits.shown(line.strip())}"
                ) from None
    return MmeFile(file, header, np.array(values))


def _tracks(files: Sequence[MmeFile], notes: list[str]) -> list[Track]:
    """The usable channels; a note for each of the others."""
    by_code = {file.code: file for file in files}
    several = len({object_of(code) for code in by_code if object_of(code).isdigit()}) > 1
    doubted: dict[str, list[str]] = {}
    tracks = []
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
            stated = file.get("number of samples")
            if stated.isdigit() and int(stated) != len(values):
                doubted.setdefault("the number of samples is not the stated one", []).append(file.file.name)
            if status not in ("", "ok"):
                doubted.setdefault(f"status {limits.shown(status)}", []).append(channel.name)
        except RecordingError as why:
            notes.append(f"left out, {file.file.name}: {why}")
    notes += [f"{why}: {shortened(names)}" for why, names in doubted.items()]
    return tracks


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
        notes.append(f"left out, sampled at another rate than {1e9 / max(step, 1):g} Hz: {shortened(others)}")
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


def _on_barrier(code: str, channel: Channel) -> bool:
    return object_of(code) == "B" and channel.quantity == "force"


def _made_of_several(
    header: MmeFile, tracks: Sequence[Track], channels: Sequence[Channel], time_ns: np.ndarray, values: np.ndarray,
    notes: list[str],
) -> tuple[dict[Channel, np.ndarray], tuple[str, ...]]:  # fmt: skip
    """`barrier_fx` of several cells, the motion of cars and engines; names of the sensors that contradict others."""
    made, barrier = {}, None
    cells = [k for k, t in enumerate(tracks) if _on_barrier(t.code, channels[k]) and channels[k].axis == "x"]
    names = [channel.name for channel in channels]
    if len(cells) > 1 and "barrier_fx" not in names:
        total = values[:, cells].sum(axis=1)
        # the structure only pushes, so the larger side of the sum is compression
        turn = -1.0 if -np.nanmin(total, initial=0.0) > np.nanmax(total, initial=0.0) else 1.0
        barrier = turn * total
        sign = "sign turned" if turn < 0 else "sign as recorded"
        made[Channel("barrier_fx", "force", "barrier", "x", f"sum of {len(cells)} load cells, {sign}")] = barrier
        notes.append(f"barrier_fx: sum of {len(cells)} cells; positive in compression: {sign}")
    sensors = [
        Sensor(channel, column)
        for channel, column in zip(channels, values.T)
        if (channel.quantity, channel.axis) == ("acceleration", "x")
        and channel.body.endswith(("car", "engine"))
        and np.isfinite(column).mean() >= LASTS
    ]
    motion = body_motion(time_ns * 1e-9, sensors, _masses(header, tracks), barrier)
    notes += motion.notes
    return dict(motion.columns) | made, motion.outliers


def _masses(header: MmeFile, tracks: Sequence[Track]) -> dict[str, float]:
    """kg by body, of the test objects whose mass the header gives."""
    masses = {}
    for track in tracks:
        stated = header.get(f"mass test object {track.code[0].lower()}")
        if track.channel.body.endswith("car") and re.fullmatch(r"\d+(\.\d+)?", stated) and float(stated) > 0:
            masses[track.channel.body] = float(stated)
    return masses
