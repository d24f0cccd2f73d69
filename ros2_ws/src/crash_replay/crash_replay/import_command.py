"""`import SOURCE --to BAG`: a recording of any known form becomes a bag; says what was done and what was left out."""

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from .bag import write_bag
from .conditioning import CFC_CLASSES, filter_recording, remove_offset, select_channels
from .fault import guarded
from .foreign_text import visible
from .output import check_outputs, write_text
from .readers import READERS, read_source
from .readers.units import G
from .recording import Recording
from .said import Parser, say
from .sensor_checks import doubtful_channels, gaps_in_time

SHOWN_IN = {"acceleration": (G, "g"), "force": (1e3, "kN"), "displacement": (1e-3, "mm")}
"""For people to read; everything else is SI."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Exit status 0 done, 1 data at fault (one line on standard error), 2 usage."""
    return guarded(lambda: run(_parser().parse_args(arguments)))


def run(given: argparse.Namespace) -> None:
    check_outputs({"--json": given.json}, [given.source, given.names], folders={"--to": given.to})
    recording = import_recording(given)
    bag = write_bag(recording, given.to, overwrite=given.force)
    if given.json:
        write_text(given.json, json.dumps(_found(recording, bag), indent=1) + "\n")
    say(_report(recording, bag))
    kept = [
        what
        for what, done in (("zero offset kept (--offset)", given.offset), ("no filter (--cfc)", given.cfc))
        if not done
    ]
    if kept:
        say(f"as recorded: {', '.join(kept)}")


def import_recording(given: argparse.Namespace) -> Recording:
    """The source, with the choice of channels, zero offset and filter that was asked for."""
    recording = read_source(given.source, names=given.names, cells=given.cells, recover=given.recover)
    if given.channels:
        recording = select_channels(recording, given.channels)
    doubts = (*gaps_in_time(recording), *doubtful_channels(recording))  # before a filter smooths the signs away
    recording = replace(recording, test=replace(recording.test, notes=recording.test.notes + doubts))
    if given.offset:
        recording = remove_offset(recording)
    return filter_recording(recording, given.cfc) if given.cfc else recording


def _parser() -> argparse.ArgumentParser:
    forms = "; ".join(reader.expects for reader in READERS)
    parser = Parser(prog="import", description=f"Make a bag of a recording. SOURCE is one of: {forms}.")
    parser.add_argument("source", type=Path, metavar="SOURCE")
    parser.add_argument(
        "--to", type=Path, required=True, metavar="BAG", help="rosbag2 folder, or one file if it ends in .mcap"
    )
    parser.add_argument("--offset", action="store_true", help="remove each channel's mean before the impact")
    parser.add_argument(
        "--cfc", type=int, choices=CFC_CLASSES, help="filter with this channel frequency class of SAE J211-1"
    )
    parser.add_argument(
        "--names", type=Path, metavar="YAML", help="renames channels, sets bodies and initial velocities"
    )
    parser.add_argument(
        "--channels", nargs="+", metavar="GLOB", help="only the channels that match, e.g. 'car_*' barrier_fx"
    )
    parser.add_argument(
        "--cells", action="store_true", help="NHTSA: keep the barrier's load cells as channels of their own"
    )
    parser.add_argument("--recover", action="store_true", help="bag: take what is intact of one that was cut off")
    parser.add_argument("--force", action="store_true", help="replace BAG if it exists")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write what was done to FILE as well")
    return parser


def _peaks(recording: Recording) -> list[tuple[float, float]]:
    """(value, time) of each channel's largest magnitude; NaN where it has no valid value."""
    peaks = []
    for values in recording.values.T:
        size = np.where(np.isfinite(values), np.abs(values), -1.0)
        k = int(np.argmax(size))
        peaks.append((float(values[k]), float(recording.time[k])) if size[k] >= 0 else (np.nan, np.nan))
    return peaks


def _report(recording: Recording, bag: Path) -> str:
    test, time = recording.test, recording.time
    rate = f"{1e-3 / recording.sample_period:.6g} kHz" if recording.sample_period else "one sample"
    lines = [
        f"{test.id}: {test.title}",
        f"{len(recording)} samples, {rate}, {time[0]:.4f} to {time[-1]:.4f} s, {len(test.channels)} channels",
        "",
    ]
    rows = [("channel", "body", "quantity", "peak", "", "at")]
    for channel, (value, at) in zip(test.channels, _peaks(recording)):
        factor, unit = SHOWN_IN.get(channel.quantity, (1.0, channel.unit))
        rows.append((channel.name, channel.body, channel.quantity, f"{value / factor:.5g}", unit, f"{1e3 * at:.2f} ms"))
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    for row in rows:
        cells = [
            text.rjust(width) if k in (3, 5) else text.ljust(width) for k, (text, width) in enumerate(zip(row, widths))
        ]
        lines.append("  " + "  ".join(cells).rstrip())
    if test.initial_velocity:
        speeds: dict[float, list[str]] = {}
        for body, speed in test.initial_velocity.items():
            speeds.setdefault(speed, []).append(body)
        stated = "; ".join(f"{speed:.4g} m/s: {', '.join(bodies)}" for speed, bodies in speeds.items())
        lines += ["", f"initial velocity {stated}"]
    else:
        lines += ["", "initial velocity not given: every body is at rest until the impact"]
    lines += ["", *(f"- {note}" for note in test.notes)] if test.notes else []
    return "\n".join([*lines, "", f"written to {visible(bag)} ({_size(bag)})"])


def _size(bag: Path) -> str:
    files = [bag] if bag.is_file() else list(bag.iterdir())
    return f"{sum(file.stat().st_size for file in files) / 1e6:.2f} MB"


def _found(recording: Recording, bag: Path) -> dict[str, Any]:
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


if __name__ == "__main__":
    sys.exit(main())
