"""`estimate RECORDING --model M --method mrls`: fold a recording through an estimator and print what it found."""

import argparse
import sys

from crash_replay.fault import guarded
from crash_replay.said import Parser

from ..core.methods import METHODS
from .options import RECORDING, add_effects_option, add_model_option


def main() -> None:
    sys.exit(guarded(_main))


def _main() -> None:
    arguments = _parser().parse_args()
    from .work.estimate import estimate  # late: it takes long to import, and a line at fault needs none of it

    estimate(arguments)


def _passes(text: str) -> int:
    if not (text.isdigit() and 1 <= int(text) <= 1000):
        raise argparse.ArgumentTypeError(f"passes are a whole number from 1 to 1000, got {text!r}")
    return int(text)


def _parser() -> Parser:
    parser = Parser(prog="estimate", description=__doc__)
    parser.add_argument("bag", metavar="RECORDING", help=RECORDING)
    add_model_option(parser)
    parser.add_argument("--method", default="constrained_kalman", choices=METHODS)
    parser.add_argument("--set", nargs="*", default=[], metavar="NAME=VALUE", help="settings of the method")
    parser.add_argument(
        "--effective-mass",
        action="store_true",
        help="find the masses that go with the accelerometers first, the other parameters with them",
    )
    parser.add_argument(
        "--passes", metavar="N", type=_passes,
        help="gauss_newton goes over the record until it settles, N times at most; 1: once, as a node does; default "
        "10, with preset=thesis 1",
    )  # fmt: skip
    add_effects_option(parser)
    parser.add_argument("--json", metavar="FILE", help="write everything that was found")
    return parser


if __name__ == "__main__":
    main()
