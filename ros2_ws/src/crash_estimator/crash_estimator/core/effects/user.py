"""A user's own effects, from a Python file that they ask to be executed."""

import runpy
from pathlib import Path

from ..structure import ModelError
from . import EFFECTS
from .base import Effect


def load_effects(path: str | Path) -> dict[str, Effect]:
    """Every `Effect` that the file defines at its top level, by name.

    Raises ModelError with one line where the file fails, defines none, or takes a name of the vocabulary.
    """
    try:
        content = runpy.run_path(str(path))
    except Exception as error:  # whatever a user's file may raise
        raise ModelError(f"{path}: {type(error).__name__}: {error}") from None
    found = {value.name: value for value in content.values() if isinstance(value, Effect)}
    if not found:
        raise ModelError(f"{path} defines no effect: give one of the kinds of crash_estimator.core.effects.base a name")
    taken = [name for name in found if name in EFFECTS]
    if taken:
        raise ModelError(f"{path}: {taken[0]!r} is an effect of the vocabulary already: choose another name")
    return found
