"""`simulate RECORDING --model M`: estimate, then let the model run free from the impact and compare it with what was
measured.

With --from OTHER the forces come from another recording: a car with the interior of one test and the structure's
motion of another, as in section 6.6 of the thesis.
"""

import math
import sys

from crash_replay.conditioning import CFC_CLASSES
from crash_replay.fault import guarded
from crash_replay.said import Parser

from ..core.methods import METHODS
from .options import RECORDING, add_effects_option, add_model_option


def main() -> None:
    sys.exit(guarded(_main))


def _main() -> None:
    arguments = _parser().parse_args()
    from .work.simulate import simulate  # late: it takes long to import, and a line at fault needs none of it

    simulate(arguments)


def _parser() -> Parser:
    parser = Parser(prog="simulate", description=__doc__.partition("\n\n")[0])
    parser.add_argument("bag", metavar="RECORDING", help=RECORDING)
    add_model_option(parser)
    parser.add_argument("--method", default="constrained_kalman", choices=[m for m in METHODS if m != "effective_mass"])
    parser.add_argument("--set", nargs="*", default=[], metavar="NAME=VALUE", help="settings of the method")
    parser.add_argument("--from", dest="source", metavar="OTHER", help="take the forces over crush from this recording")
    parser.add_argument(
        "--end", type=float, default=math.inf, metavar="S", help="simulate up to this time after the impact"
    )
    parser.add_argument(
        "--cfc", type=int, choices=(0, *CFC_CLASSES), default=None, help="filter of the compared signals; 0: none"
    )
    add_effects_option(parser)
    parser.add_argument("--json", metavar="FILE", help="write everything that was found")
    return parser


if __name__ == "__main__":
    main()
