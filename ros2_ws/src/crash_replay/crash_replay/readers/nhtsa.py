"""NHTSA crash test folder: an EV5 header and one file for each curve (two columns: time in s, value).

Made of the curves: `barrier_fx`, the sum of the barrier's load cells, positive in compression, and
`car_ax`, `engine_ax`, the mean of each body's accelerometers along x. What is left out, and why, is in
the test's notes.
"""

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .. import limits
from ..recording import Channel, Recording, RecordingError, Test
from .dates import stamp_of
from .ev5 import Curve, Header, read_header
from .nhtsa_names import axis_of, body_of, channel_names
from .units import KMH, quantity_of, si_factor

VALID_UNTIL = re.compile(r"no valid data after (\d+(?:\.\d+)?) *ms", re.IGNORECASE)
ON_GRID = 0.01
"""Share of the sample period by which a file's times may be off the header's."""


class Track(NamedTuple):
    """A curve that can be used: SI values at the indices first, first + 1, ... (index 0 is time zero)."""

    curve: Curve
    channel: Channel
    first: int
    values: np.ndarray

    @property
    def end(self) -> int:
        return self.first + len(self.values)

    def on(self, start: int, end: int) -> np.ndarray:
        """(end - start,) values at the indices from start, NaN where there is none."""
        column = np.full(end - start, np.nan)
        column[self.first - start : self.end - start] = self.values
        return column


class Unusable(Exception):
    """Why a curve is left out."""


def found(path: Path) -> bool:
    return path.is_dir() and bool(_headers(path))


def read(path: Path, cells: bool = False) -> Recording:
    """The recording; with `cells`, the barrier's load cells are channels of their own as well.

    Raises RecordingError where the header is at fault or no curve can be used; a curve at fault is left out.
    """
    headers = _headers(path)
    if len(headers) != 1:
        raise RecordingError(f"{path}: expected one .EV5 header, found {', '.join(h.name for h in headers) or 'none'}")
    header = read_header(headers[0])
    tracks, left_out = _read_tracks(headers[0], header)
    if not tracks:
        raise RecordingError(
            f"{path}: none of the header's {len(header.curves)} curves has a file {headers[0].stem}.NNN to use"
        )
    step = Counter(track.curve.step for track in tracks).most_common(1)[0][0]
    other = [track for track in tracks if track.curve.step != step]
    left_out += [(track.curve, f"sampled at another rate than {1e6 / step:g} Hz") for track in other]
    tracks = [track for track in tracks if track.curve.step == step]
    start, end = min(track.first for track in tracks), max(track.end for track in tracks)
    if wrong := limits.size_wrong(end - start, len(tracks)):
        raise RecordingError(f"{path}: from the first sample of any curve to the last, the test {wrong}")

    columns, notes = _body_means(tracks, start, end)
    barrier, of_barrier = _barrier(header, tracks, start, end, keep_cells=cells)
    columns |= barrier
    columns |= {track.channel: track.on(start, end) for track in tracks if track.curve.vehicle != 0}
    notes = [*_about(header), *notes, *of_barrier, *_short(columns, start, step), *_summary(left_out)]
    if not columns:
        raise RecordingError(f"{path}: no curve but of the barrier's cells, and their sum cannot be made")
    time_ns = np.rint(np.arange(start, end) * (step * 1e3)).astype(np.int64)
    try:
        test = Test(
            id=header.number,
            channels=tuple(columns),
            title=header.title,
            source=f"NHTSA Vehicle Crash Test Database, test {header.number}: {header.laboratory}, {header.date}",
            initial_velocity=_initial_velocity(tracks),
            notes=tuple(notes),
            impact_ns=stamp_of(header.date),
        )
        return Recording(test, time_ns, np.stack(list(columns.values()), axis=1))
    except RecordingError as error:
        raise RecordingError(f"{path}: {error}") from None


def _headers(folder: Path) -> list[Path]:
    return sorted(entry for entry in folder.iterdir() if entry.suffix.upper() == ".EV5")


def _read_tracks(header_file: Path, header: Header) -> tuple[list[Track], list[tuple[Curve, str]]]:
    """The usable curves, and the others with the reason why they are not."""
    tracks, left_out = [], []
    vehicles = len(header.masses)
    for curve, name in zip(header.curves, channel_names(header.curves, vehicles)):
        try:
            tracks.append(_read_track(header_file, curve, name, body_of(curve, vehicles)))
        except Unusable as why:
            left_out.append((curve, str(why)))
    return tracks, left_out


def _read_track(header_file: Path, curve: Curve, name: str, body: str) -> Track:
    until = VALID_UNTIL.search(curve.comment)
    if curve.status == "NO":
        raise Unusable("sensor not fitted")
    if curve.status == "CF" and not until:
        raise Unusable("no valid data, says the header")
    quantity = quantity_of(curve.unit)
    if quantity is None:
        raise Unusable(f"unit {curve.unit} has no ROS message")
    if limits.PERIOD.wrong(curve.step * 1e-6):
        raise Unusable(f"its step of {curve.step:g} us is none")
    file = header_file.with_name(f"{header_file.stem}.{curve.number:03d}")
    if not file.is_file():
        raise Unusable("no data file")
    table = _table(file)
    if wrong := limits.times_wrong(table[:, 0]):
        raise Unusable(f"{file.name}: {wrong}")
    index = table[:, 0] / (curve.step * 1e-6)
    first = round(index[0])
    if np.any(np.abs(index - first - np.arange(len(index))) > ON_GRID):
        raise Unusable(f"{file.name}: its times are not the header's steps of {curve.step:g} us")
    values = limits.valid_values(table[:, 1], si_factor(quantity, curve.unit))
    if until:
        ends = min(float(until[1]), limits.TIME.highest * 1e3)  # ms
        values = values[: max(0, round(ends * 1e3 / curve.step) - first)]
    source = f"{file.name}: {curve.comment.split(':')[0]}, {curve.unit}, prefilter {curve.prefilter} Hz"
    return Track(curve, Channel(name, quantity, body, axis_of(curve), source), first, values)


def _table(file: Path) -> np.ndarray:
    """(n, 2) time in s and value. Raises Unusable."""
    try:
        if wrong := limits.file_wrong(file, limits.CURVE_FILE):
            raise Unusable(f"{file.name} {wrong}")
        lines = file.read_text(encoding="latin-1").splitlines()
        table = np.loadtxt(lines, ndmin=2) if any(line.strip() for line in lines) else np.empty((0, 2))
    except (ValueError, OSError) as error:
        raise Unusable(f"{file.name} is damaged ({limits.shown(str(error))})") from None
    if table.shape[1:] != (2,) or not len(table):
        raise Unusable(f"{file.name}: expected the two columns time and value")
    return table


def _body_means(tracks: Sequence[Track], start: int, end: int) -> tuple[dict[Channel, np.ndarray], list[str]]:
    """`car_ax`, `engine_ax`: the mean of a body's accelerometers along x that last from start to end."""
    columns, notes, taken = {}, [], {track.channel.name for track in tracks}
    bodies: dict[str, list[Track]] = {}
    for track in tracks:
        along_x = track.channel.quantity == "acceleration" and track.channel.axis == "x"
        if along_x and (track.first, track.end) == (start, end):
            bodies.setdefault(track.channel.body, []).append(track)
    for body, members in bodies.items():
        name = f"{body}_ax"
        if name not in taken:
            of = ", ".join(member.channel.name for member in members)
            curves = ", ".join(str(member.curve.number) for member in members)
            channel = Channel(
                name, "acceleration", body, "x", ("mean of curves " if len(members) > 1 else "curve ") + curves
            )
            columns[channel] = np.mean([member.values for member in members], axis=0)
            notes.append(f"{name}: mean of {of}" if len(members) > 1 else f"{name}: is {of}")
    return columns, notes


def _barrier(
    header: Header, tracks: Sequence[Track], start: int, end: int, keep_cells: bool
) -> tuple[dict[Channel, np.ndarray], list[str]]:
    """`barrier_fx`, the sum of the cells' Fx, positive in compression; the cells too where they are asked for."""
    listed = [curve for curve in header.curves if _is_cell_force(curve)]
    used = [t for t in tracks if _is_cell_force(t.curve) and (t.first, t.end) == (start, end)]
    if not used:
        return {}, [f"barrier_fx: none of the {len(listed)} cells can be used"] if listed else []
    total = np.sum([track.values for track in used], axis=0)
    # the structure only pushes, so the larger side of the sum is compression
    turn = -1.0 if -total.min() > total.max() else 1.0
    missing = sorted({curve.number for curve in listed} - {track.curve.number for track in used})
    cells = {curve.number: curve.comment.split(":")[0] for curve in listed}
    without = ", ".join(f"{cells[number]} (curve {number})" for number in missing)
    text = f"sum of {len(used)} of {len(listed)} cells" + (f", without {without}" if without else "")
    sign = "sign turned, the cells read negative in compression" if turn < 0 else "sign as recorded"
    channel = Channel("barrier_fx", "force", "barrier", "x", f"sum of {len(used)} load cells, {sign}")
    columns = {channel: turn * total}
    others = [track for track in tracks if track.curve.vehicle == 0]
    if keep_cells:
        columns |= {t.channel: (turn if _is_cell_force(t.curve) else 1.0) * t.on(start, end) for t in others}
    elif others:
        text += f"; the cells themselves ({len(others)} curves) are left out"
    return columns, [f"barrier_fx: {text}; positive in compression: {sign}"]


def _is_cell_force(curve: Curve) -> bool:
    """Vehicle 0 is the barrier; its moments have an axis too (and not always the right one)."""
    return curve.vehicle == 0 and curve.sensor == "LC" and quantity_of(curve.unit) == "force" and axis_of(curve) == "x"


def _initial_velocity(tracks: Sequence[Track]) -> dict[str, float]:
    """m/s along x of each body, from the first of its accelerometers along x."""
    velocity: dict[str, float] = {}
    for track in tracks:
        if track.channel.quantity == "acceleration" and track.channel.axis == "x":
            velocity.setdefault(track.channel.body, track.curve.initial_velocity * KMH)
    return velocity


def _about(header: Header) -> list[str]:
    masses = ", ".join(f"{mass:g} kg" for mass in header.masses.values())
    return [f"closing speed {header.closing_speed:g} km/h" + (f", test mass {masses}" if masses else "")]


def _short(columns: dict[Channel, np.ndarray], start: int, step: float) -> list[str]:
    """A note for each channel that does not last for the whole record."""
    notes = []
    for channel, values in columns.items():
        valid = np.flatnonzero(np.isfinite(values))
        if len(valid) < len(values):
            span = (
                f"from {(start + valid[0]) * step * 1e-6:.4f} s to {(start + valid[-1]) * step * 1e-6:.4f} s"
                if len(valid)
                else ""
            )
            notes.append(f"{channel.name}: valid {span or 'nowhere'} only, NaN elsewhere")
    return notes


def _summary(left_out: Iterable[tuple[Curve, str]]) -> list[str]:
    """One note for each reason: ranges of curves, the barrier's many moments as a number."""
    reasons: dict[str, list[Curve]] = {}
    for curve, why in left_out:
        reasons.setdefault(why, []).append(curve)
    notes = []
    for why, curves in reasons.items():
        moments = sum(curve.vehicle == 0 and quantity_of(curve.unit) == "moment" for curve in curves)
        numbers = [c.number for c in curves if not (c.vehicle == 0 and quantity_of(c.unit) == "moment")]
        parts = [f"curves {_ranges(numbers)}"] if numbers else []
        parts += [f"{moments} barrier cell moments"] if moments else []
        notes.append(f"left out, {why}: {' and '.join(parts)}")
    return notes


def _ranges(numbers: Sequence[int]) -> str:
    """1, 2, 3, 7 -> "1-3, 7"."""
    runs: list[list[int]] = []
    for number in sorted(numbers):
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    return ", ".join(str(run[0]) if len(run) == 1 else f"{run[0]}-{run[-1]}" for run in runs)
