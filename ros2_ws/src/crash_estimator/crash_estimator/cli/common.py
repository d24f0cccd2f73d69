"""What the commands share in their work: what they read and write, settings from the command line, JSON without NaN."""

import argparse
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from crash_replay.limits import NUMBER
from crash_replay.output import check_outputs, write_text
from crash_replay.readers import read_source
from crash_replay.recording import Recording, RecordingError

from ..core.effects import EFFECTS
from ..core.effects.effect import Effect
from ..core.effects.user import load_effects
from ..core.structure import ModelError, Structure
from ..ready_models import model_path


def read_crash(source: str) -> Recording:
    """A recording of any form with some of a crash in it; raises RecordingError where it ends before the impact."""
    recording = read_source(source)
    if not recording.time_ns[-1] >= 0:
        end = recording.time_ns[-1] * 1e-6
        raise RecordingError(
            f"{source}: its last sample is {-end:.4g} ms before the impact (time zero): there is nothing to learn from"
        )
    return recording


def refuse_empty_channels(structure: Structure, recording: Recording) -> None:
    """Raises ModelError for a channel of the model without a valid sample: what it should say, would be made up."""
    names = {name for _, name, _ in structure.channels()} & set(recording.test.channel_names)
    for name in sorted(names):
        if not np.isfinite(recording.column(name)).any():
            raise ModelError(f"test {recording.test.id}: channel {name} has no valid sample: leave it out of the model")


def check_written(arguments: argparse.Namespace, *recordings: str | None, **outputs: str | Path | None) -> None:
    """Before anything is read: nothing is written onto the recordings, the model or the effects; `json="out.json"` is
    `--json out.json`. Raises OutputError."""
    read = [*recordings, model_path(arguments.model), arguments.effects]
    check_outputs({f"--{option}": path for option, path in outputs.items()}, read)


def effects_of(arguments: argparse.Namespace) -> dict[str, Effect]:
    """The vocabulary, and the user's own effects where `--effects` names a file of them."""
    return EFFECTS | (load_effects(arguments.effects) if arguments.effects else {})


def parse_settings(pairs: list[str]) -> dict[str, Any]:
    """["forgetting=0.98", "m=5", "preset=thesis"] -> {"forgetting": 0.98, "m": 5, "preset": "thesis"}."""
    settings: dict[str, Any] = {}
    for pair in pairs:
        name, equals, text = pair.partition("=")
        if name.strip() == "preset":
            settings["preset"] = text.strip()
            continue
        try:
            if not equals:
                raise ValueError
            value: float | int | bool = text == "true" if text in ("true", "false") else float(text)
        except ValueError:
            raise ModelError(f"a setting is written NAME=NUMBER, such as forgetting=0.98, got {pair!r}") from None
        if wrong := NUMBER.wrong(value) if isinstance(value, float) else "":
            raise ModelError(f"setting {name.strip()} {wrong}")
        settings[name.strip()] = (
            int(value) if isinstance(value, float) and text.strip().lstrip("+-").isdigit() else value
        )
    return settings


def write_json(path: str | Path, content: Any) -> None:
    """Strict JSON: arrays become lists, NaN and infinity become null."""
    write_text(path, json.dumps(_plain(content), indent=1, allow_nan=False) + "\n")


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return [_plain(item) for item in value.tolist()]
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
