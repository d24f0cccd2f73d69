"""`import SOURCE --to BAG`: a recording of any known form becomes a bag; says what was done and what was left out."""

import argparse
import json
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from .bag import write_bag
from .channel_class import BY_CLASS, frequency_class
from .conditioning import CFC_CLASSES, filter_recording, remove_offset, select_channels
from .fault import guarded
from .foreign_text import visible
from .import_report import found, import_report
from .onset import at_onset, onset_note
from .output import check_outputs, write_text
from .readers import READERS, read_source
from .recording import Recording
from .said import Parser, say
from .sensor_checks import doubtful_channels, gaps_in_time

NAMES_HELP = """
a --names file (or import.yaml in the folder), every key optional; channels and bodies by the names that import shows,
or patterns:

  test: {id: V7292, title: two cars head on}
  channels:
    vehicle2_left_sill_ax: {name: bullet_ax, body: bullet, axis: x}
    vehicle1_cg_ax: {sign: -1}           # this sensor was mounted the other way round: only its values are turned
  turned: [vehicle2_*]                   # these bodies face the other way: x, y and initial velocity change sign
  initial_velocity: {bullet: -15.6}      # m/s at time zero, as it stands
  initial_displacement: {bullet: 0.02}   # m
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Exit status 0 done, 1 data at fault (one line on standard error), 2 usage."""
    return guarded(lambda: run(_parser().parse_args(arguments)))


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
    doubts = (*gaps_in_time(recording), *doubtful_channels(recording))  # before a filter smooths the signs away
    if doubt := onset_note(recording):
        doubts += (doubt,)
    recording = replace(recording, test=replace(recording.test, notes=recording.test.notes + doubts))
    if given.offset:
        recording = remove_offset(recording)
    return filter_recording(recording, given.cfc) if given.cfc else recording


def _parser() -> argparse.ArgumentParser:
    forms = "; ".join(reader.expects for reader in READERS)
    parser = Parser(
        prog="import",
        description=f"Make a bag of a recording. SOURCE is one of: {forms}; nhtsa:NUMBER, a test of NHTSA's database.",
        epilog=NAMES_HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("source", type=Path, metavar="SOURCE")
    parser.add_argument(
        "--to", type=Path, required=True, metavar="BAG", help="rosbag2 folder, or one file if it ends in .mcap"
    )
    parser.add_argument(
        "--time-zero", choices=("stated", "auto"), default="stated",
        help="auto: the impact is where the signals leave their rest, not where the recording states it",
    )  # fmt: skip
    parser.add_argument("--offset", action="store_true", help="remove each channel's mean before the impact")
    parser.add_argument(
        "--cfc", type=frequency_class, choices=(BY_CLASS, *CFC_CLASSES),
        help="filter with SAE J211-1: `class` takes each channel's own class (head 1000, spine 180, car 60, ...), "
        "a number the same for all",
    )  # fmt: skip
    parser.add_argument(
        "--names", type=Path, metavar="YAML",
        help="renames channels, sets bodies, signs and initial velocities, turns vehicles round: see below",
    )  # fmt: skip
    parser.add_argument(
        "--channels", nargs="+", metavar="GLOB", help="only the channels that match, e.g. 'car_*' barrier_fx"
    )
    parser.add_argument(
        "--cells", action="store_true", help="NHTSA: keep the barrier's load cells as channels of their own"
    )
    parser.add_argument(
        "--all-sensors", action="store_true",
        help="NHTSA, ISO-MME: keep the channels of sensors that contradict the others of their body",
    )  # fmt: skip
    parser.add_argument("--recover", action="store_true", help="bag: take what is intact of one that was cut off")
    parser.add_argument("--force", action="store_true", help="replace BAG if it exists")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write what was done to FILE as well")
    return parser


def _size(bag: Path) -> str:
    files = [bag] if bag.is_file() else list(bag.iterdir())
    return f"{sum(file.stat().st_size for file in files) / 1e6:.2f} MB"


if __name__ == "__main__":
    sys.exit(main())
