"""What `import` says of a recording: its channels with their peaks, initial velocities, what was done and left out."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .readers.left_out import MARK
from .recording import Recording, Test
from .shown_units import scale_of

WIDEST = 60
"""Characters of a cell of the table of what was left out; all of it stands in the notes and in --json."""


def import_report(recording: Recording) -> str:
    test, time = recording.test, recording.time
    rate = f"{1e-3 / recording.sample_period:.6g} kHz" if recording.sample_period else "one sample"
    lines = [
        f"{test.id}: {test.title}",
        f"{len(recording)} samples, {rate}, {time[0]:.4f} to {time[-1]:.4f} s, {len(test.channels)} channels",
        "",
        *_channels(recording),
        "",
        _velocities(test),
    ]
    done = [note for note in test.notes if not note.startswith(MARK)]
    lines += ["", *(f"- {note}" for note in done)] if done else []
    left_out = [note for note in test.notes if note.startswith(MARK)]
    return "\n".join([*lines, *(["", *_left_out(left_out)] if left_out else [])])


def _channels(recording: Recording) -> list[str]:
    peaks = _peaks(recording)
    values: dict[str, list[float]] = {}
    for channel, (value, _) in zip(recording.test.channels, peaks):
        values.setdefault(channel.quantity, []).append(value)
    scale = {quantity: scale_of(quantity, found) for quantity, found in values.items()}
    rows = [("channel", "body", "quantity", "peak", "", "at")]
    for channel, (value, at) in zip(recording.test.channels, peaks):
        unit, factor = scale[channel.quantity]
        rows.append((channel.name, channel.body, channel.quantity, f"{value * factor:.5g}", unit, f"{1e3 * at:.2f} ms"))
    return _aligned(rows, right=(3, 5))


def _velocities(test: Test) -> str:
    if not test.initial_velocity:
        return "initial velocity not given: every body is at rest until the impact"
    speeds: dict[float, list[str]] = {}
    for body, speed in test.initial_velocity.items():
        speeds.setdefault(speed, []).append(body)
    return "initial velocity " + "; ".join(f"{speed:.4g} m/s: {', '.join(b)}" for speed, b in speeds.items())


def _left_out(notes: Sequence[str]) -> list[str]:
    """A table; reasons and names that are long are cut."""
    rows = [("left out", "why")]
    for note in notes:
        why, _, what = note.removeprefix(MARK).rpartition(": ")
        if what.startswith("curves ") or "moments" in what or why.startswith(("not asked", "sampled", "not described")):
            rows.append((_cut(what), _cut(why)))
        else:  # one file's name, then its reason
            name, _, reason = note.removeprefix(MARK).partition(": ")
            rows.append((_cut(name), _cut(reason)))
    return _aligned(rows)


def _cut(text: str) -> str:
    return text if len(text) <= WIDEST else f"{text[: WIDEST - 4]} ..."


def _aligned(rows: Sequence[Sequence[str]], right: Sequence[int] = ()) -> list[str]:
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = []
    for row in rows:
        cells = [
            text.rjust(width) if k in right else text.ljust(width) for k, (text, width) in enumerate(zip(row, widths))
        ]
        lines.append("  " + "  ".join(cells).rstrip())
    return lines


def _peaks(recording: Recording) -> list[tuple[float, float]]:
    """(value, time) of each channel's largest magnitude; NaN where it has no valid value."""
    peaks = []
    for values in recording.values.T:
        size = np.where(np.isfinite(values), np.abs(values), -1.0)
        k = int(np.argmax(size))
        peaks.append((float(values[k]), float(recording.time[k])) if size[k] >= 0 else (np.nan, np.nan))
    return peaks


def found(recording: Recording, bag: Path) -> dict[str, Any]:
    """For --json, SI units."""
    test = recording.test
    channels = []
    for channel, (value, at) in zip(test.channels, _peaks(recording)):
        peak = {"value": value, "time": at} if np.isfinite(value) else None
        channels.append(
            {"name": channel.name, "quantity": channel.quantity, "unit": channel.unit, "body": channel.body}
            | {"axis": channel.axis, "source": channel.source, "peak": peak}
        )
    return {
        "bag": str(bag),
        "test": {"id": test.id, "title": test.title, "source": test.source},
        "samples": len(recording),
        "sample_period": recording.sample_period,
        "start": float(recording.time[0]),
        "end": float(recording.time[-1]),
        "channels": channels,
        "initial_velocity": dict(test.initial_velocity),
        "initial_displacement": dict(test.initial_displacement),
        "notes": list(test.notes),
    }
