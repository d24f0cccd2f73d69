"""`synthesize SCENARIO --to BAG`: write a simulated recording, with its truth in a YAML file beside it.

`synthesize STRUCTURE --hide EFFECT[:TARGET] --to BAG`: of a structure drawn at random by its seed, with an effect
that NAME.model.yaml, beside it too, does not tell of.
"""

import argparse
import math
import sys
from collections.abc import Callable
from pathlib import Path

from .bag import write_bag
from .fault import guarded
from .foreign_text import visible
from .output import check_outputs, write_text
from .recording import Recording
from .said import Parser, say
from .synthetic.hidden.bundled import NAME, bundled_case
from .synthetic.hidden.cases import EFFECTS, HiddenCase, draw_case
from .synthetic.hidden.structures import STRUCTURES
from .synthetic.recordings import BUILDERS, BUNDLED_SEED, SCENARIOS
from .synthetic.truth_file import truth_text


def main() -> int:
    return guarded(command)


def command() -> None:
    parser = Parser(prog="synthesize", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument(
        "scenario", nargs="?", metavar="SCENARIO", choices=[*BUILDERS, *STRUCTURES],
        help=f"one of those that --list shows; or, to hide an effect in it, one of {', '.join(STRUCTURES)}",
    )  # fmt: skip
    what.add_argument("--all", action="store_true", help="all of bags/; replaces what is there")
    what.add_argument("--list", action="store_true", help="show the scenarios and write nothing")
    parser.add_argument(
        "--to", metavar="BAG", type=Path, help="folder or .mcap file to write; with --all, the folder for all"
    )
    parser.add_argument(
        "--hide", action="append", type=_hidden, metavar="EFFECT[:TARGET]",
        help=f"may be repeated; none, or one of {', '.join(EFFECTS)}; without a target it is drawn",
    )  # fmt: skip
    parser.add_argument(
        "--size", type=_positive, default=1.0, metavar="FACTOR", help="of the hidden effects, times the usual one"
    )
    parser.add_argument("--force", action="store_true", help="replace BAG where it exists")
    parser.add_argument(
        "--seed",
        type=_whole,
        default=BUNDLED_SEED,
        metavar="N",
        help="of the noise and of what is drawn (default %(default)s)",
    )
    parser.add_argument("--rate", type=_positive, metavar="HZ", help="sample rate, instead of the scenario's")
    parser.add_argument(
        "--noise", type=_not_negative, metavar="G", help="noise of the accelerometers, standard deviation in g"
    )
    parser.add_argument("--speed", type=_positive, default=1.0, metavar="FACTOR", help="times the scenario's speed")
    arguments = parser.parse_args()
    if arguments.list:
        say("\n".join(f"{name:22} {build().title}" for name, build in BUILDERS.items()))
        return
    if arguments.to is None:
        parser.error("the argument --to is required: where to write")
    if (arguments.hide is not None) != (arguments.scenario in STRUCTURES):
        parser.error(f"--hide goes with one of {', '.join(STRUCTURES)}, which need it (none: nothing is hidden)")
    if arguments.all:
        for name in SCENARIOS:
            _write(name, arguments.to / f"{name}.mcap", arguments, replace=True)
        _write_hidden(bundled_case(), arguments.to / f"{NAME}.mcap", arguments, replace=True)
    elif arguments.hide:
        _write_hidden(_case(arguments), arguments.to, arguments, arguments.force)
    else:
        _write(arguments.scenario, arguments.to, arguments, arguments.force)


def _write(name: str, path: Path, arguments: argparse.Namespace, replace: bool) -> None:
    recording, truth = SCENARIOS[name](
        arguments.seed, rate=arguments.rate, noise=arguments.noise, speed=arguments.speed
    )
    _write_files(recording, path, {"truth": truth_text(truth)}, replace)


def _case(arguments: argparse.Namespace) -> HiddenCase:
    chosen = {effect: target for effect, target in arguments.hide if effect != "none"}
    at = {effect: target for effect, target in chosen.items() if target}
    return draw_case(arguments.scenario, list(chosen), arguments.seed, arguments.size, at)


def _write_hidden(case: HiddenCase, path: Path, arguments: argparse.Namespace, replace: bool) -> None:
    recorded = {"noise": arguments.noise, "rate": arguments.rate}
    recording, truth = case.record(arguments.speed, **{k: v for k, v in recorded.items() if v is not None})
    _write_files(recording, path, {"truth": case.truth_text(truth), "model": case.model_text}, replace)


def _write_files(recording: Recording, path: Path, texts: dict[str, str], replace: bool) -> None:
    """The bag, and NAME.WHAT.yaml beside it."""
    stem = path.stem if path.suffix == ".mcap" else path.name
    beside = {what: path.with_name(f"{stem}.{what}.yaml") for what in texts}
    check_outputs({f"{what} of --to": file for what, file in beside.items()}, [])
    write_bag(recording, path, overwrite=replace)
    for what, file in beside.items():
        write_text(file, texts[what])
    named = ", ".join(f"{what} in {visible(file.name)}" for what, file in beside.items())
    say(f"{visible(path)}: {len(recording)} samples, {len(recording.test.channels)} channels; {named}")


def _hidden(text: str) -> tuple[str, str]:
    """EFFECT[:TARGET] -> the effect, and its target or nothing."""
    effect, _, target = text.partition(":")
    if effect not in ("none", *EFFECTS):
        raise argparse.ArgumentTypeError(f"expected none or one of {', '.join(EFFECTS)}, got {effect!r}")
    return effect, target


def _number(convert: Callable[[str], float], accept: Callable[[float], bool], expected: str) -> Callable[[str], float]:
    """An argument's type: what it must be is said in the usage error."""

    def parse(text: str) -> float:
        try:
            value = convert(text)
        except ValueError:
            value = math.nan
        if not (math.isfinite(value) and accept(value)):
            raise argparse.ArgumentTypeError(f"expected {expected}, got {text!r}")
        return value

    return parse


_whole = _number(int, lambda value: value >= 0, "a whole number of 0 or more")
_positive = _number(float, lambda value: value > 0.0, "a number above 0")
_not_negative = _number(float, lambda value: value >= 0.0, "a number of 0 or more")


if __name__ == "__main__":
    sys.exit(main())
