"""`diagnose RECORDING [RECORDING ...] --model M`: which physical effect is missing from a model, by recordings of
it."""

import argparse
import sys

from crash_replay.fault import guarded
from crash_replay.said import Parser

from ..core.structure import ModelError
from .options import RECORDING, add_effects_option, add_model_option, add_time_limit


def main() -> None:
    sys.exit(guarded(_main))


def _main() -> None:
    arguments = _parser().parse_args()
    from .work.diagnose import run  # late: it takes long to import, and a line at fault needs none of it

    run(arguments)


def _parser() -> Parser:
    parser = Parser(prog="diagnose", description=__doc__)
    parser.add_argument(
        "bags", nargs="+", metavar="RECORDING",
        help=f"recordings of one structure, best at different speeds; each is {RECORDING}",
    )  # fmt: skip
    add_model_option(parser)
    parser.add_argument("--apply", metavar="NEW_MODEL.yaml", help="write the model with the effects that were found")
    parser.add_argument(
        "--apply-unexplained", action="store_true", help="with --apply: also what explains part of it only"
    )
    parser.add_argument(
        "--good-enough", metavar="RATING|PERCENT%", type=_tolerance,
        help="what may be left in every channel: an ISO/TS 18571 rating, as in 0.8, or an RMS as a share of the peak, "
        "as in 5%%; a model that is as good is adequate as it is. Default: 1%% completes an explanation, no more",
    )  # fmt: skip
    parser.add_argument("--json", metavar="FILE", help="write everything that was found")
    add_time_limit(parser)
    add_effects_option(parser)
    return parser


def _tolerance(text: str):
    from ..core.diagnosis import tolerance_of  # late, as the work

    try:
        return tolerance_of(text)
    except ModelError as error:  # argparse says what its own errors say
        raise argparse.ArgumentTypeError(str(error)) from None


if __name__ == "__main__":
    main()
