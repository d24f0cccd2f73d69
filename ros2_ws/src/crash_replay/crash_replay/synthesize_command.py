"""`synthesize SCENARIO --to BAG`: write a simulated recording, with its truth in a YAML file beside it."""

import argparse
import math
import sys
from collections.abc import Callable
from pathlib import Path

from .bag import write_bag
from .recording import RecordingError
from .synthetic.recordings import BUILDERS, BUNDLED_SEED, SCENARIOS
from .synthetic.truth_file import truth_text


def main() -> None:
    parser = argparse.ArgumentParser(prog="synthesize", description=__doc__)
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument(
        "scenario", nargs="?", metavar="SCENARIO", choices=BUILDERS, help="one of those that --list shows"
    )
    what.add_argument("--all", action="store_true", help="every scenario, as in bags/; replaces what is there")
    what.add_argument("--list", action="store_true", help="show the scenarios and write nothing")
    parser.add_argument(
        "--to", metavar="BAG", type=Path, help="folder or .mcap file to write; with --all, the folder for all"
    )
    parser.add_argument("--force", action="store_true", help="replace BAG where it exists")
    parser.add_argument(
        "--seed", type=_whole, default=BUNDLED_SEED, metavar="N", help="of the noise (default %(default)s)"
    )
    parser.add_argument("--rate", type=_positive, metavar="HZ", help="sample rate, instead of the scenario's")
    parser.add_argument(
        "--noise", type=_not_negative, metavar="G", help="noise of the accelerometers, standard deviation in g"
    )
    parser.add_argument("--speed", type=_positive, default=1.0, metavar="FACTOR", help="times the scenario's speed")
    arguments = parser.parse_args()
    if arguments.list:
        print("\n".join(f"{name:22} {build().title}" for name, build in BUILDERS.items()))
        return
    if arguments.to is None:
        parser.error("the argument --to is required: where to write")
    try:
        if arguments.all:
            for name in SCENARIOS:
                _write(name, arguments.to / f"{name}.mcap", arguments, replace=True)
        else:
            _write(arguments.scenario, arguments.to, arguments, arguments.force)
    except (RecordingError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(1)


def _write(name: str, path: Path, arguments: argparse.Namespace, replace: bool) -> None:
    recording, truth = SCENARIOS[name](
        arguments.seed, rate=arguments.rate, noise=arguments.noise, speed=arguments.speed
    )
    write_bag(recording, path, overwrite=replace)
    beside = path.parent / f"{path.stem if path.suffix == '.mcap' else path.name}.truth.yaml"
    beside.write_text(truth_text(truth), encoding="utf-8")
    print(f"{path}: {len(recording)} samples, {len(recording.test.channels)} channels; truth in {beside.name}")


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
    main()
