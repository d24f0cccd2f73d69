"""`report BAG --model M --to DIR`: the thesis's tables and figures for one recording, as a Markdown page."""

import argparse
import sys
from pathlib import Path

import numpy as np

from crash_replay.conditioning import CFC_CLASSES

from ..core.methods import METHODS
from ..core.structure import ModelError
from ..model_file import load_model, ready_models
from ..report_page import write_report
from .common import add_effects_option, effects_of, guarded, read_crash
from .simulate import smoother

SHOWN = ["rls", "mrls", "constrained_kalman"]


def main() -> None:
    parser = argparse.ArgumentParser(prog="report", description=__doc__.partition(": ")[2])
    parser.add_argument("bag", metavar="BAG", help="a recording: rosbag2 folder or .mcap file")
    parser.add_argument("--model", required=True, help=f"a .yaml file, or one of {', '.join(ready_models())}")
    parser.add_argument("--to", required=True, metavar="DIR", help="folder for report.md and its figures")
    known = [method for method in METHODS if method != "effective_mass"]
    parser.add_argument("--methods", nargs="+", default=SHOWN, choices=known, help="the last one's forces run free")
    parser.add_argument("--end", type=float, default=np.inf, metavar="S", help="judge up to this time after the impact")
    parser.add_argument(
        "--cfc", type=int, choices=(0, *CFC_CLASSES), default=None, help="filter of the free run's signals; 0: none"
    )
    add_effects_option(parser)
    arguments = parser.parse_args()
    sys.exit(guarded(lambda: report(arguments)))


def report(arguments: argparse.Namespace) -> None:
    effects = effects_of(arguments)
    structure = load_model(arguments.model, effects)
    recording = read_crash(arguments.bag)
    folder = Path(arguments.to)
    if folder.exists() and not folder.is_dir():
        raise ModelError(f"{folder} is a file: --to takes a folder")
    smooth, said = smoother(recording, arguments.cfc)
    page = write_report(
        recording, structure, list(dict.fromkeys(arguments.methods)), folder, arguments.end, smooth, said,
        effects=effects,
    )  # fmt: skip
    print(f"{recording.test.id}: {page} and {len(list(folder.glob('*.png')))} figures")


if __name__ == "__main__":
    main()
