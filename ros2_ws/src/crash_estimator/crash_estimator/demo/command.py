"""`demo`: a recording replayed, estimated, what its model lacks named and added, and all of it shown, in one command.

make demo                                    a simulated test with an effect that its model has not got
make demo RECORDING=nhtsa:10146              a real one: a bag, CSV with YAML, an NHTSA or ISO-MME folder, nhtsa:NUMBER
"""

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from crash_replay.channel_class import BY_CLASS, frequency_class
from crash_replay.conditioning import CFC_CLASSES
from crash_replay.fault import guarded
from crash_replay.recording import Recording
from crash_replay.said import Parser

from ..core.methods import METHODS
from ..model_file import ready_models
from ..viewer.native import has_display
from ..viewer.web import WebFile
from .children import Children
from .choice import (
    METHOD_OF_SEVERAL_MODELS,
    Choice,
    as_bag,
    bundled_recording,
    choose,
    default_rate,
    model_beside,
    simplest_model,
)
from .domain import own_environment
from .folder import claim
from .interrupts import interrupted_by_signals
from .terminal import Terminal, near

START_OF_REPLAY = 3600.0
"""s that the replay waits for its listeners: the demonstration itself gives up earlier, and says why."""
END_OF_REPLAY = 150.0
"""s that it stays for who was stopped: a little longer than the demonstration waits for such a process."""


def main() -> int:
    return guarded(_main)


def _main() -> int:
    with interrupted_by_signals():  # what was started is ended
        return demo(_parser().parse_args())


def _parser() -> Parser:
    parser = Parser(
        prog="demo",
        description="Replay a recording, estimate on it, name what the model lacks, add it, show how the error falls.",
    )
    parser.add_argument(
        "--recording", type=Path, metavar="PATH",
        help="a bag, or what `import` reads: CSV with YAML, NHTSA EV5 or ISO-MME folder, nhtsa:NUMBER"
        " (default: a simulated one)",
    )  # fmt: skip
    parser.add_argument(
        "--model", action="append", default=[], metavar="M",
        help=f"a .yaml file, or one of {', '.join(ready_models())}; may be repeated (default: the simplest that fits)",
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


def demo(arguments: argparse.Namespace) -> int:
    """Exit status 0, or 1 where the answer, the recording for Rerun or its picture is missing or not whole."""
    source, searches = arguments.recording or bundled_recording(), not arguments.no_diagnosis
    cfc = 0 if searches and arguments.cfc is None else arguments.cfc  # a filter would hide what the sensors' noise is
    with claim(arguments.out, source) as out:
        recording, bag, lines = as_bag(source, out, cfc)
        others = [as_bag(other, out / f"with_{k}", cfc)[1] for k, other in enumerate(arguments.others, 1)]
        choices = _choices(arguments, source, recording)
        rate = arguments.rate or default_rate(recording.time[-1] - recording.time[0])
        terminal = Terminal()
        for line in (*lines, *_announcement(recording, source, choices, rate, searches)):
            terminal.say(line)
        os.environ.update(own_environment())
        terminal.say(f"other nodes can listen in with ROS_DOMAIN_ID={os.environ['ROS_DOMAIN_ID']}")
        rrd = None if arguments.no_viewer else out / "demo.rrd"
        with Children(out / "log", os.environ) as children:
            _start(children, bag, others, choices, rate, rrd, searches)
            from .run import Run  # takes rclpy, while the processes start, which take it too

            status = Run(children, choices, terminal, rrd).to_the_end()
    if rrd and rrd.is_file() and terminal.live and sys.stdin.isatty() and not has_display():
        _stay(rrd, terminal)
    return status


def _stay(rrd: Path, terminal: Terminal) -> None:
    """At a terminal without a display: the finished recording in the browser, until Ctrl-C."""
    web = WebFile(rrd, port=9090, data_port=9876)
    terminal.say(f"\nIn a browser on this machine: {web.page}\nCtrl-C ends it.")
    try:
        web.process.wait()
    except KeyboardInterrupt:
        terminal.say()
    finally:
        web.close()


def _choices(arguments: argparse.Namespace, source: Path, recording: Recording) -> list[Choice]:
    """A search begins with one model: the recording's own, or the simplest that fits."""
    if arguments.no_diagnosis:
        return choose(recording.test, arguments.model, arguments.method)
    models = arguments.model or [model_beside(source) or simplest_model(recording.test)]
    return choose(recording.test, models, arguments.method or [METHOD_OF_SEVERAL_MODELS])


def _announcement(
    recording: Recording, source: Path, choices: Sequence[Choice], rate: float, searches: bool
) -> list[str]:
    test, time_ms = recording.test, recording.time * 1e3
    frequency = f"{1e-3 / recording.sample_period:.4g} kHz" if recording.sample_period else "no rate"
    wall = (recording.time[-1] - recording.time[0]) / rate
    return [
        f"{test.id}: {test.title or source}",
        f"{len(recording)} samples at {frequency}, {time_ms[0]:.4g} to {time_ms[-1]:.4g} ms, "
        f"replayed at {rate:g} x real time: {wall:.3g} s",
        *(f"estimator {choice.name}: model {near(choice.model)}, method {choice.method}" for choice in choices),
        *([f"diagnosis: what does model {near(choices[0].model)} lack?"] if searches else []),
    ]


def _start(
    children: Children, bag: Path, others: Sequence[Path], choices: Sequence[Choice], rate: float, rrd: Path | None,
    searches: bool,
) -> None:  # fmt: skip
    """All at once; the one that takes longest to start first."""
    names = [choice.name for choice in choices]
    if rrd is not None:
        for old in (rrd, rrd.with_suffix(".png")):
            old.unlink(missing_ok=True)  # an older one must not pass for this one
        models = list(dict.fromkeys(choice.model for choice in choices if choice.model.endswith((".yaml", ".yml"))))
        viewer = dict(estimators=names, models=models or [""], rrd=str(rrd.absolute()), web=True)
        children.start("viewer", "crash_estimator", "viewer", **viewer)
    if searches:
        same = [choice.name for choice in choices if choice.model == choices[0].model]
        search = dict(model=choices[0].model, with_bags=[str(other) for other in others] or [""])
        children.start("diagnosis", "crash_estimator", "diagnosis", add_first=True, estimators=same, **search)
    for choice in choices:
        parameters = dict(model=choice.model, method=choice.method)
        children.start(choice.name, "crash_estimator", "estimator", node=choice.name, **parameters)
    listeners = [*children.all, "demo"]
    waiting = dict(listeners=listeners, wait_timeout=START_OF_REPLAY, finish_timeout=END_OF_REPLAY)
    children.start("replay", "crash_replay", "replay", bag=str(bag), rate=rate, **waiting)


if __name__ == "__main__":
    sys.exit(main())
