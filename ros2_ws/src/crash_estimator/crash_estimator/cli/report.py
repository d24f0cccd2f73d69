"""`report RECORDING --model M --to DIR`: the thesis's tables and figures for one recording, as one HTML page."""

import argparse
import sys
from pathlib import Path

import numpy as np

from crash_replay.conditioning import CFC_CLASSES
from crash_replay.fault import guarded, tell
from crash_replay.foreign_text import visible
from crash_replay.output import OutputError
from crash_replay.said import Parser, say

from ..core.methods import METHODS
from ..model_file import load_model, ready_models
from ..report_page import write_report
from .common import RECORDING, add_effects_option, add_time_limit, check_written, effects_of, read_crash
from .simulate import smoother

DIAGNOSED_FOR = 8.0
"""s: a page is for looking at what there is; who wants the whole search has `diagnose`."""
SHOWN = ["rls", "mrls", "constrained_kalman"]


def main() -> None:
    sys.exit(guarded(lambda: report(_parser().parse_args())))


def _parser() -> Parser:
    parser = Parser(prog="report", description=__doc__.partition(": ")[2])
    parser.add_argument("bag", metavar="RECORDING", help=RECORDING)
    parser.add_argument("--model", required=True, help=f"a .yaml file, or one of {', '.join(ready_models())}")
    parser.add_argument("--to", required=True, metavar="DIR", help="folder for report.html")
    parser.add_argument("--markdown", action="store_true", help="write report.md with its figures as well")
    known = [method for method in METHODS if method != "effective_mass"]
    parser.add_argument("--methods", nargs="+", default=SHOWN, choices=known, help="the last one's forces run free")
    parser.add_argument("--end", type=float, default=np.inf, metavar="S", help="judge up to this time after the impact")
    parser.add_argument(
        "--cfc", type=int, choices=(0, *CFC_CLASSES), default=None, help="filter of the free run's signals; 0: none"
    )
    add_time_limit(parser, DIAGNOSED_FOR)
    add_effects_option(parser)
    return parser


def report(arguments: argparse.Namespace) -> None:
    folder = Path(arguments.to)
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"{visible(folder)} is a file: --to takes a folder")
    check_written(arguments, arguments.bag, to=folder / "report.html")
    effects = effects_of(arguments)
    structure = load_model(arguments.model, effects)
    recording = read_crash(arguments.bag)
    smooth, said = smoother(recording, arguments.cfc)
    page = write_report(
        recording, structure, list(dict.fromkeys(arguments.methods)), folder, arguments.end, smooth, said,
        effects=effects, markdown=arguments.markdown, seconds=arguments.time_limit, told=tell,
    )  # fmt: skip
    say(f"{recording.test.id}: {visible(page)}")


if __name__ == "__main__":
    main()
