"""What `demo` begins with: the recording as a bag, the models to start from, and all processes at once."""

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from crash_replay.recording import Recording

from ..viewer.native import has_display
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
from .terminal import Terminal, near

START_OF_REPLAY = 3600.0
"""s that the replay waits for its listeners: the demonstration itself gives up earlier, and says why."""
END_OF_REPLAY = 150.0
"""s that it stays for who was stopped: a little longer than the demonstration waits for such a process."""


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
    from ..viewer.web import WebFile  # late: it takes rerun

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
        viewer: dict[str, Any] = dict(estimators=names, models=models or [""], rrd=str(rrd.absolute()), web=True)
        children.start("viewer", "crash_estimator", "viewer", **viewer)
    if searches:
        same = [choice.name for choice in choices if choice.model == choices[0].model]
        search: dict[str, Any] = dict(model=choices[0].model, with_bags=[str(other) for other in others] or [""])
        children.start("diagnosis", "crash_estimator", "diagnosis", add_first=True, estimators=same, **search)
    for choice in choices:
        parameters = dict(model=choice.model, method=choice.method)
        children.start(choice.name, "crash_estimator", "estimator", node=choice.name, **parameters)
    listeners = [*children.all, "demo"]
    waiting: dict[str, Any] = dict(listeners=listeners, wait_timeout=START_OF_REPLAY, finish_timeout=END_OF_REPLAY)
    children.start("replay", "crash_replay", "replay", bag=str(bag), rate=rate, **waiting)
