"""`demo`: a recording replayed, estimated, what its model lacks named and added, and all of it shown, in one command.

make demo                                    a simulated test with an effect that its model has not got
make demo RECORDING=nhtsa:10146              a real one: a bag, CSV with YAML, an NHTSA or ISO-MME folder, nhtsa:NUMBER
"""

import argparse
import sys
from pathlib import Path

from crash_replay.channel_class import BY_CLASS, frequency_class
from crash_replay.conditioning import CFC_CLASSES
from crash_replay.fault import guarded
from crash_replay.said import Parser

from ..core.methods import METHODS
from ..ready_models import MODEL
from .interrupts import interrupted_by_signals


def main() -> int:
    return guarded(_main)


def _main() -> int:
    arguments = _parser().parse_args()
    from .start import demo  # late: it takes long to import, and a line at fault needs none of it

    with interrupted_by_signals():  # what was started is ended
        return demo(arguments)


def _parser() -> Parser:
    parser = Parser(
        prog="demo",
        description="Replay a recording, estimate on it, name what the model lacks, add it, show how the error falls.",
    )
    parser.add_argument(
        "--recording", type=Path, metavar="PATH",
        help="a bag, or what `import` reads: CSV with YAML, NHTSA EV5 or UDS or ISO-MME folder, nhtsa:NUMBER"
        " (default: a simulated one)",
    )  # fmt: skip
    parser.add_argument(
        "--model", action="append", default=[], metavar="M",
        help=f"{MODEL}; may be repeated (default: the simplest that fits)",
    )  # fmt: skip
    parser.add_argument(
        "--method", action="append", default=[], choices=METHODS, help="may be repeated: they run side by side"
    )
    parser.add_argument(
        "--cfc", type=frequency_class, choices=(0, BY_CLASS, *CFC_CLASSES),
        help="filter what is imported with this class of SAE J211-1, `class`: each channel with its own, 0: not"
        " (default: not, or `class` for a laboratory's folder with --no-diagnosis)",
    )  # fmt: skip
    parser.add_argument(
        "--with", dest="others", type=Path, action="append", default=[], metavar="PATH",
        help="another recording of the same structure, at another speed: what one cannot tell apart, two may",
    )  # fmt: skip
    parser.add_argument("--no-diagnosis", action="store_true", help="estimate only, with several models or methods")
    parser.add_argument("--rate", type=_rate, help="times real time (default: such that it takes about 15 s)")
    parser.add_argument("--out", type=Path, default=Path("out"), help="what is written goes below it (default: out)")
    parser.add_argument("--no-viewer", action="store_true", help="without Rerun: the terminal only")
    return parser


def _rate(text: str) -> float:
    rate = float(text)
    if not 0.001 <= rate <= 1000.0:
        raise argparse.ArgumentTypeError(f"must be between 0.001 and 1000 times real time, got {text}")
    return rate


if __name__ == "__main__":
    sys.exit(main())
