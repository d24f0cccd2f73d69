"""`report RECORDING --model M --to DIR`: the thesis's tables and figures for one recording, as one HTML page."""

import math
import sys

from crash_replay.conditioning import CFC_CLASSES
from crash_replay.fault import guarded
from crash_replay.said import Parser

from ..core.methods import METHODS
from .options import RECORDING, add_effects_option, add_model_option, add_time_limit

SHOWN = ["rls", "mrls", "constrained_kalman"]


def main() -> None:
    sys.exit(guarded(_main))


def _main() -> None:
    arguments = _parser().parse_args()
    from .work.report import report  # late: it takes long to import, and a line at fault needs none of it

    report(arguments)


def _parser() -> Parser:
    parser = Parser(prog="report", description=__doc__.partition(": ")[2])
    parser.add_argument("bag", metavar="RECORDING", help=RECORDING)
    add_model_option(parser)
    parser.add_argument("--to", required=True, metavar="DIR", help="folder for report.html")
    parser.add_argument("--markdown", action="store_true", help="write report.md with its figures as well")
    known = [method for method in METHODS if method != "effective_mass"]
    parser.add_argument("--methods", nargs="+", default=SHOWN, choices=known, help="the last one's forces run free")
    parser.add_argument(
        "--end", type=float, default=math.inf, metavar="S", help="judge up to this time after the impact"
    )
    parser.add_argument(
        "--cfc", type=int, choices=(0, *CFC_CLASSES), default=None, help="filter of the free run's signals; 0: none"
    )
    add_time_limit(parser)
    add_effects_option(parser)
    return parser


if __name__ == "__main__":
    main()
