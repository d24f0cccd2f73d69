"""NHTSA crash test folder: an EV5 header and one file for each curve (two columns: time in s, value).

Made of the curves: `barrier_fx`, the sum of the barrier's load cells, positive in compression, and
`car_ax`, `engine_ax`, the mean of each body's accelerometers along x, without those that contradict the others
(`body_means`). What is left out, and why, is in the test's notes.
"""

import math
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from .. import limits
from ..recording import Channel, Recording, RecordingError, Test
from ..shortened import shortened
from .body_means import BodyMotion, Sensor, body_motion
from .codes.nhtsa import QUESTIONABLE, location_of
from .dates import stamp_of
from .ev5 import Curve, Header, read_header
from .left_out import summary
from .nhtsa_curves import LeftOut, Track, ev5_samples, read_tracks
from .nhtsa_names import axis_of
from .units import KMH, quantity_of

LASTS = 0.8
"""Share of the record that a body's motion must be known for."""


def found(path: Path) -> bool:
    return path.is_dir() and bool(_headers(path))


def read(path: Path, cells: bool = False, all_sensors: bool = False) -> Recording:
    """The recording; with `cells`, the barrier's load cells are channels of their own as well; with `all_sensors`,
    those that contradict the others of their body too.

    Raises RecordingError where the header is at fault or no curve can be used; a curve at fault is left out.
    """
    headers = _headers(path)
    if len(headers) != 1:
        raise RecordingError(f"{path}: expected one .EV5 header, found {', '.join(h.name for h in headers) or 'none'}")
    header = read_header(headers[0])
    tracks, left_out = read_tracks(header, ev5_samples(headers[0], header))
    if not tracks:
        raise RecordingError(
            f"{path}: none of the header's {len(header.curves)} curves has a file {headers[0].stem}.NNN to use"
        )
    return recording_of(path, header, tracks, left_out, cells, all_sensors)


def recording_of(
    path: Path, header: Header, tracks: list[Track], left_out: LeftOut, cells: bool, all_sensors: bool
) -> Recording:
    """What NHTSA's formats have in common: one time base, the bodies' means, the notes."""
    step = Counter(track.curve.step for track in tracks).most_common(1)[0][0]
    other = [track for track in tracks if track.curve.step != step]
    left_out += [(track.curve, f"sampled at another rate than {1e6 / step:g} Hz") for track in other]
    tracks = [track for track in tracks if track.curve.step == step]
    start, end = min(track.first for track in tracks), max(track.end for track in tracks)
    if wrong := limits.size_wrong(end - start, len(tracks)):
        raise RecordingError(f"{path}: from the first sample of any curve to the last, the test {wrong}")

    time_ns = np.rint(np.arange(start, end) * (step * 1e3)).astype(np.int64)
    barrier, of_barrier = _barrier(header, tracks, start, end, keep_cells=cells)
    force = next((values for channel, values in barrier.items() if channel.name == "barrier_fx"), None)
    motion = _body_motion(header, tracks, start, time_ns, force)
    dropped = () if all_sensors else motion.outliers
    columns = dict(motion.columns) | barrier
    columns |= {
        track.channel: track.on(start, end)
        for track in tracks
        if track.curve.vehicle != 0 and track.channel.name not in dropped
    }
    notes = [
        *_about(header),
        *_questionable(tracks),
        *motion.notes,
        *of_barrier,
        *_short(columns, start, step),
        *_summary(left_out),
        *(summary(why, [], where) for why, where in header.wrong),
    ]
    if not columns:
        raise RecordingError(f"{path}: no curve but of the barrier's cells, and their sum cannot be made")
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
    """In the folder or, as a test is submitted, in its folder DATA."""
    inner = [entry for entry in folder.iterdir() if entry.name.upper() == "DATA" and entry.is_dir()]
    for place in (folder, *inner):
        if found := sorted(entry for entry in place.iterdir() if entry.suffix.upper() == ".EV5"):
            return found
    return []


def _body_motion(
    header: Header, tracks: Sequence[Track], start: int, time_ns: np.ndarray, barrier: np.ndarray | None
) -> BodyMotion:
    """Of every body's accelerometers along x that last as long as its longest."""
    end = start + len(time_ns)
    bodies: dict[str, list[Track]] = {}
    for track in tracks:
        if track.channel.quantity == "acceleration" and track.channel.axis == "x" and track.curve.vehicle != 0:
            bodies.setdefault(track.channel.body, []).append(track)
    sensors, numbers = [], {}
    for members in bodies.values():
        longest = max(members, key=lambda track: len(track.values))
        if len(longest.values) < LASTS * len(time_ns):
            continue
        for track in members:
            if (track.first, track.end) == (longest.first, longest.end):
                near = location_of(track.curve.location, track.curve.comment).near
                sensors.append(Sensor(track.channel, track.on(start, end), near))
                numbers[track.channel] = f"curve {track.curve.number}"
    vehicles = header.vehicles
    cars = {f"vehicle{k}_car" if vehicles > 1 else "car": mass for k, mass in header.masses.items() if mass > 0}
    if vehicles > 1 and not header.along_one_line:
        cars = {}
    return body_motion(time_ns * 1e-9, sensors, cars, barrier, lambda sensor: numbers[sensor.channel])


def _barrier(
    header: Header, tracks: Sequence[Track], start: int, end: int, keep_cells: bool
) -> tuple[dict[Channel, np.ndarray], list[str]]:
    """`barrier_fx`, the sum of the cells' Fx, positive in compression; the cells too where they are asked for."""
    listed = [curve for curve in header.curves if _is_cell_force(curve)]
    used = _of_one_span([track for track in tracks if _is_cell_force(track.curve)])
    if not used:
        return {}, [f"barrier_fx: none of the {len(listed)} cells can be used"] if listed else []
    total = np.sum([track.on(start, end) for track in used], axis=0)
    # the structure only pushes, so the larger side of the sum is compression
    turn = -1.0 if -np.nanmin(total) > np.nanmax(total) else 1.0
    missing = sorted({curve.number for curve in listed} - {track.curve.number for track in used})
    cells = {curve.number: curve.comment.split(":")[0] for curve in listed}
    without = shortened([f"{cells[number]} (curve {number})" for number in missing])
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


def _of_one_span(cells: Sequence[Track]) -> list[Track]:
    """Those that begin and end as most do: a sum needs all of its parts."""
    spans = Counter((track.first, track.end) for track in cells)
    most = max(spans, key=lambda span: (spans[span], span[1] - span[0]), default=None)
    return [track for track in cells if (track.first, track.end) == most]


def _is_cell_force(curve: Curve) -> bool:
    """Vehicle 0 is the barrier; its moments have an axis too (and not always the right one)."""
    return curve.vehicle == 0 and curve.sensor == "LC" and quantity_of(curve.unit) == "force" and axis_of(curve) == "x"


def _initial_velocity(tracks: Sequence[Track]) -> dict[str, float]:
    """m/s along x of each body, from the first of its accelerometers along x."""
    velocity: dict[str, float] = {}
    for track in tracks:
        stated = math.isfinite(track.curve.initial_velocity)
        if track.channel.quantity == "acceleration" and track.channel.axis == "x" and stated:
            velocity.setdefault(track.channel.body, track.curve.initial_velocity * KMH)
    return velocity


def _questionable(tracks: Sequence[Track]) -> list[str]:
    named = [track.channel.name for track in tracks if track.curve.status == QUESTIONABLE]
    return [f"questionable, says the header: {shortened(named)}"] if named else []


def _about(header: Header) -> list[str]:
    masses = ", ".join(f"{mass:g} kg" for mass in header.masses.values() if mass > 0)
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


def _summary(left_out: LeftOut) -> list[str]:
    """One note for each reason: ranges of curves, the barrier's many moments as a number."""
    reasons: dict[str, list[Curve]] = {}
    for curve, why in left_out:
        reasons.setdefault(why, []).append(curve)
    notes = []
    for why, curves in reasons.items():
        moments = sum(curve.vehicle == 0 and quantity_of(curve.unit) == "moment" for curve in curves)
        numbers = [c.number for c in curves if not (c.vehicle == 0 and quantity_of(c.unit) == "moment")]
        notes.append(summary(why, numbers, f"{moments} barrier cell moments" if moments else ""))
    return notes
