"""Options that several commands take. A command's line is read before what it works with is imported (`work`)."""

import argparse
import math

from ..ready_models import MODEL

RECORDING = "a recording in any form: bag, CSV with its YAML, NHTSA EV5 or UDS or ISO-MME folder, nhtsa:NUMBER"


def add_model_option(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--model", required=True, help=MODEL)


def add_time_limit(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--time-limit", metavar="S", type=_seconds,
        help="after so many seconds the diagnosis tries nothing more, and the best answer so far is given; inf: all is "
        "tried; default: a number of iterations instead, which takes some 10 s for two recordings of a dummy",
    )  # fmt: skip


def _seconds(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if not seconds > 0.0:
        raise argparse.ArgumentTypeError(f"a time limit is a number of seconds above 0, got {text!r}")
    return seconds


def add_effects_option(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--effects", metavar="FILE.py", help="your own effects; the file is executed")
