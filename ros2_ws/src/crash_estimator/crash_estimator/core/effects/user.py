"""A user's own effects, from a Python file that they ask to be executed."""

import runpy
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import wraps
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np

from crash_replay.limits import NUMBER, YAML_FILE, file_wrong, shown

from ..structure import ModelError
from . import EFFECTS
from .effect import Effect, ElementMotion, Shape

INSTANTS = 64
"""Of the motion that a function is tried on: to the largest crush, back, and beyond, to apart."""
LARGEST_CRUSH = 0.2
"""m, of that motion."""


def load_effects(path: str | Path) -> dict[str, Effect]:
    """Every `Effect` that the file defines at its top level, by name; its functions say who they are when they fail.

    Raises ModelError with one line where the file fails, defines none, takes a name of the vocabulary, or where a
    function of one fails on a motion that it is tried on.
    """
    try:
        if wrong := file_wrong(Path(path), YAML_FILE):
            raise ModelError(f"{path}: {wrong}")
        content = runpy.run_path(str(path))
    except ModelError:
        raise
    except OSError as error:
        raise ModelError(f"{path}: cannot be read: {error.strerror or error}") from None
    except (Exception, SystemExit) as error:  # whatever a user's file may raise, also where it means to end us
        raise ModelError(f"{path}: {_said(error)}") from None
    found = [value for value in content.values() if isinstance(value, Effect)]
    if not found:
        raise ModelError(f"{path} defines no effect: give one of the kinds of crash_estimator.core.effects.base a name")
    return {effect.name: effect for effect in (_checked(path, effect) for effect in found)}


def _checked(path: str | Path, effect: Effect) -> Effect:
    """The effect, its function guarded. Raises ModelError where one of its constants is not what it must be."""
    if not (isinstance(effect.name, str) and effect.name.isidentifier()):
        raise ModelError(f"{path}: an effect's name is a word of letters, digits and _, got {shown(effect.name)}")
    where = f"{path}: effect {effect.name!r}"
    if effect.name in EFFECTS:
        raise ModelError(f"{path}: {effect.name!r} is an effect of the vocabulary already: choose another name")
    if wrong := _wrong_constants(effect):
        raise ModelError(f"{where}: {wrong}")
    function = effect.function
    if not function:
        return effect
    if not callable(getattr(effect, function)):
        raise ModelError(f"{where}: {function} must be a function, got {shown(getattr(effect, function))}")
    said = f"{path}: {function} of {effect.name!r}"
    changed: dict[str, Any] = {function: _guarded(said, getattr(effect, function))}
    guarded = replace(effect, **changed)
    _try_out(said, guarded)
    return guarded


def _wrong_constants(effect: Effect) -> str:
    """Of what is not one of its functions; "" for nothing."""
    if not isinstance(effect.unit, str) or not isinstance(effect.shapes, Mapping):
        return "unit must be a text, and shapes a mapping of names to Shape"
    for name, value in (("low", effect.low), ("high", effect.high), ("size", effect.size)):
        if not isinstance(value, Real | None) or value != value:
            return f"{name} must be a number, got {shown(value)}"
    if not effect.low < effect.high or (effect.size is not None and NUMBER.wrong(effect.size)):
        return f"low < high and a finite size must hold, got {effect.low}, {effect.high}, {effect.size}"
    for name, shape in effect.shapes.items():
        if not isinstance(shape, Shape) or not isinstance(name, str) or not name.isidentifier():
            return f"shapes must be a mapping of names to Shape, got {shown(name)}: {shown(shape)}"
        starts = shape.starts if isinstance(shape.starts, tuple | list) else ()
        if not starts or any(NUMBER.wrong(number) for number in (shape.low, shape.high, *starts)):
            return f"shape constant {name} needs finite low and high, and a tuple of one or more starts"
        if not all(0.0 < shape.low <= start <= shape.high for start in starts):
            return f"shape constant {name}: 0 < low <= each start <= high must hold"
    return ""


def _guarded(where: str, function: Callable) -> Callable:
    """The function, also in the middle of a fit: what it raises or returns wrongly is one line with its name."""

    @wraps(function)
    def guarded(argument: ElementMotion | np.ndarray, **shapes: float) -> np.ndarray:
        try:
            values = np.asarray(function(argument, **shapes), dtype=float)
        except (Exception, SystemExit) as error:  # whatever a user's function may raise
            raise ModelError(f"{where} fails on a motion it was tried on: {_said(error)}") from None
        wanted = np.shape(argument.crush if isinstance(argument, ElementMotion) else argument)
        if values.shape not in ((), wanted):
            instants = wanted[0] if wanted else 1
            raise ModelError(
                f"{where} must give one number for each of the {instants} instants, it gives {values.shape}"
            )
        return np.broadcast_to(values, wanted) if values.shape != wanted else values

    return guarded


def _said(error: BaseException) -> str:
    what = "calls sys.exit" if isinstance(error, SystemExit) else type(error).__name__
    return f"{what}: {' '.join(str(error).split())[:200]}"


def _try_out(where: str, effect: Effect) -> None:
    time = np.linspace(0.0, 0.1, INSTANTS)
    crush = LARGEST_CRUSH * np.sin(40.0 * time)
    peak, rate = np.maximum.accumulate(crush), np.gradient(crush, time)
    motion = ElementMotion(time, crush, rate, peak, 1e5 * np.maximum(crush, 0.0))
    shapes = {
        n: s.starts[0] * (LARGEST_CRUSH if s.of_crush else 1.0) for n, s in effect.shapes_of(effect.variants[0]).items()
    }
    with np.errstate(all="ignore"):
        values = effect.along(motion, **shapes)
    bad = np.flatnonzero(~(np.abs(values) <= NUMBER.highest))
    if len(bad):
        at = f"crush {crush[bad[0]]:.3g} m, rate {rate[bad[0]]:.3g} m/s"
        raise ModelError(f"{where} must be finite wherever a test may go; at {at} it is {values[bad[0]]}")
