"""`import SOURCE --to BAG`: a recording of any known form becomes a bag; says what was done and what was left out."""

import argparse
import math
import sys
from collections.abc import Sequence
from pathlib import Path

from .channel_class import BY_CLASS, frequency_class
from .conditioning import CFC_CLASSES
from .fault import guarded
from .forms import FORMS
from .said import Parser

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
    return guarded(lambda: _run(_parser().parse_args(arguments)))


def _run(given: argparse.Namespace) -> None:
    from .import_work import run  # late: the readers take long to import, and `--help` needs none of them

    run(given)


def _time_zero(text: str) -> str | float:
    if text in ("stated", "auto"):
        return text
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if not math.isfinite(seconds):
        raise argparse.ArgumentTypeError(f"stated, auto or a number of seconds, got {text!r}")
    return seconds


def _parser() -> argparse.ArgumentParser:
    parser = Parser(
        prog="import",
        description=f"Make a bag of a recording. SOURCE is one of: {'; '.join(FORMS)}; nhtsa:NUMBER, a test of NHTSA's "
        "database.",
        epilog=NAMES_HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("source", type=Path, metavar="SOURCE")
    parser.add_argument(
        "--to", type=Path, required=True, metavar="BAG", help="rosbag2 folder, or one file if it ends in .mcap"
    )
    parser.add_argument(
        "--time-zero", type=_time_zero, metavar="stated|auto|S", default="stated",
        help="where the impact is. auto: where the signals leave their rest; S: so many seconds after the stated zero, "
        "as `diagnose` says it; default: as the recording states it",
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


if __name__ == "__main__":
    sys.exit(main())
