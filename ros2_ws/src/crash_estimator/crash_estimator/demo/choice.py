"""What the demonstration runs: the recording as a bag, the estimators that fit it, and how fast to replay it."""

import re
from collections.abc import Sequence
from pathlib import Path
from textwrap import fill
from typing import NamedTuple

from crash_replay.bag import write_bag
from crash_replay.channel_class import BY_CLASS
from crash_replay.conditioning import filter_recording
from crash_replay.readers import is_bag, name_of, read_source
from crash_replay.recording import Recording, RecordingError, Test

from ..core.structure import ModelError, Structure
from ..model_file import load_model
from ..ready_models import ready_models

BUNDLED = Path("bags/hidden_effect.mcap")
METHODS_OF_ONE_MODEL = ("mrls", "constrained_kalman")
METHOD_OF_SEVERAL_MODELS = "constrained_kalman"
WALL_TIME = 15.0
"""s that a replay takes by default: long enough to watch, short enough to wait for."""


class Choice(NamedTuple):
    """One estimator of the demonstration."""

    name: str  # of the node
    model: str  # a ready model's name, or the path of a .yaml file
    method: str


def bundled_recording() -> Path:
    """The simulated recording that comes with the project, from the working folder or from the source tree."""
    here = Path(__file__).resolve()
    for folder in (Path.cwd(), *Path.cwd().parents, *here.parents):
        if (folder / BUNDLED).is_file():
            return folder / BUNDLED
    raise RecordingError(
        f"{BUNDLED} is not in {Path.cwd()} nor above it: start in the project's folder, or give --recording"
    )


def as_bag(source: Path, out: Path, cfc: int | str | None = None) -> tuple[Recording, Path, list[str]]:
    """The recording at `source`, a bag of it, and what was done to get it, in lines.

    A bag stays where and as it is; any other form is imported to out/NAME.mcap. `cfc`: its channel frequency class
    of SAE J211-1, 0 for none; without it what a laboratory recorded, which is unfiltered, is filtered, each channel
    with its own class.
    """
    recording = read_source(source)
    if is_bag(source):
        return recording, source, []
    if cfc is None:
        cfc = 0 if source.is_file() else BY_CLASS
    if cfc:
        recording = filter_recording(recording, cfc)
    bag = write_bag(recording, out / f"{name_of(source)}.mcap", overwrite=True)
    notes = recording.test.notes or ("as it is",)
    lines = [fill(note, 110, initial_indent="  ", subsequent_indent="    ") for note in notes]
    return recording, bag, [f"imported {source} to {bag}:", *lines]


def choose(
    test: Test, models: Sequence[str] = (), methods: Sequence[str] = (), by_default: Sequence[str] = ()
) -> list[Choice]:
    """The estimators to run side by side.

    `models` are those asked for; without them `by_default`, else the two largest ready ones that the test has the
    channels for. `methods` likewise: without them two on one model, the same one on several models.
    Raises ModelError or RecordingError with one line where a model does not fit the test.
    """
    models = list(dict.fromkeys(models or by_default or fitting_models(test)[:2]))
    for model in models:
        load_model(model).check_channels(test)
    if not methods:
        methods = METHODS_OF_ONE_MODEL if len(models) == 1 else (METHOD_OF_SEVERAL_MODELS,)
    pairs = [(model, method) for model in models for method in dict.fromkeys(methods)]
    names = [_node_name(model, method, len(models) > 1, len(methods) > 1) for model, method in pairs]
    doubled = next((name for name in names if names.count(name) > 1), None)
    if doubled:
        raise ModelError(f"two models are called {doubled}: give one of their files another name")
    return [Choice(name, *pair) for name, pair in zip(names, pairs, strict=False)]


def _node_name(model: str, method: str, several_models: bool, several_methods: bool) -> str:
    """What tells the estimators apart, as a ROS name: letters, digits and underscores."""
    stem = Path(model).stem.removesuffix(".model")
    parts = [stem] * (several_models or not several_methods) + [method] * several_methods
    name = re.sub(r"\W+", "_", "_".join(parts), flags=re.ASCII)
    return name if name[0].isalpha() else f"model_{name}"


def fitting_models(test: Test) -> list[str]:
    """Names of the ready models that the test has all channels for, the one that reads the most channels first.

    Raises ModelError where there is none; it names the channels and the model that comes nearest.
    """
    structures = {name: load_model(name) for name in ready_models()}
    missing = {name: missing_channels(structure, test) for name, structure in structures.items()}
    fitting = [name for name in structures if not missing[name]]
    if fitting:
        return sorted(fitting, key=lambda name: -len(structures[name].channels()))
    nearest = min(missing, key=lambda name: len(missing[name]) / len(structures[name].channels()))
    raise ModelError(
        f"no ready model fits test {test.id} with its channels {_listed(test.channel_names)}; nearest is {nearest}, "
        f"which also wants {', '.join(missing[nearest])}: copy its file, set its channels and give it by --model"
    )


def simplest_model(test: Test) -> str:
    """The ready model that the test has all channels for and that explains the least: where a search begins.

    Raises ModelError where there is none.
    """
    structures = {name: load_model(name) for name in fitting_models(test)}

    def size(name: str) -> tuple[int, int]:
        structure = structures[name]
        return len(structure.channels()), sum(p.coefficient.estimated for p in structure.parameters)

    return min(structures, key=size)


def model_beside(recording: Path) -> str | None:
    """NAME.model.yaml beside NAME.mcap: the model that a recording comes with."""
    path = recording.with_name(f"{recording.stem}.model.yaml")
    return str(path) if path.is_file() else None


def missing_channels(structure: Structure, test: Test) -> list[str]:
    """The channels that the structure reads and the test has not, or has of another quantity."""
    found = {(channel.name, channel.quantity) for channel in test.channels}
    wanted = [(name, quantity) for _, name, quantity in structure.channels()]
    return [f"{name} ({quantity})" for name, quantity in wanted if (name, quantity) not in found]


def _listed(names: Sequence[str], most: int = 12) -> str:
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


def default_rate(duration: float) -> float:
    """Times real time, of the form 1, 2 or 5 x 10^k, at which `duration` s take about WALL_TIME."""
    wanted = max(duration, 1e-6) / WALL_TIME
    steps = [float(f"{digit}e{power}") for power in range(-6, 4) for digit in (1, 2, 5)]
    return min(steps, key=lambda step: max(step / wanted, wanted / step))
