"""What the command `import` does with what was asked for."""

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path

from .bag import write_bag
from .conditioning import filter_recording, remove_offset, select_channels
from .foreign_text import visible
from .import_report import found, import_report
from .onset import at_onset, moved_time_zero, onset_note
from .output import check_outputs, write_text
from .readers import read_source
from .recording import Recording
from .said import say
from .sensor_checks import doubtful_channels, gaps_in_time


def run(given: argparse.Namespace) -> None:
    began = time.monotonic()
    check_outputs({"--json": given.json}, [given.source, given.names], folders={"--to": given.to})
    recording = import_recording(given)
    bag = write_bag(recording, given.to, overwrite=given.force)
    if given.json:
        write_text(given.json, json.dumps(found(recording, bag), indent=1) + "\n")
    say(f"{import_report(recording)}\n\nwritten to {visible(bag)} ({_size(bag)}, {time.monotonic() - began:.1f} s)")
    kept = [
        what
        for what, done in (("zero offset kept (--offset)", given.offset), ("no filter (--cfc)", given.cfc))
        if not done
    ]
    if kept:
        say(f"as recorded: {', '.join(kept)}")


def import_recording(given: argparse.Namespace) -> Recording:
    """The source, with the choice of channels, zero offset and filter that was asked for."""
    recording = read_source(
        given.source, names=given.names, cells=given.cells, all_sensors=given.all_sensors, recover=given.recover
    )
    if given.channels:
        recording = select_channels(recording, given.channels)
    if given.time_zero == "auto":
        recording = at_onset(recording)
    elif given.time_zero != "stated":
        recording = moved_time_zero(recording, round(given.time_zero * 1e9), "as stated with --time-zero")
    doubts = (*gaps_in_time(recording), *doubtful_channels(recording))  # before a filter smooths the signs away
    if given.time_zero in ("stated", "auto") and (doubt := onset_note(recording)):
        doubts += (doubt,)
    recording = replace(recording, test=replace(recording.test, notes=recording.test.notes + doubts))
    if given.offset:
        recording = remove_offset(recording)
    return filter_recording(recording, given.cfc) if given.cfc else recording


def _size(bag: Path) -> str:
    files = [bag] if bag.is_file() else list(bag.iterdir())
    return f"{sum(file.stat().st_size for file in files) / 1e6:.2f} MB"
