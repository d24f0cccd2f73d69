"""A user's own effects, from a Python file that they ask to be executed."""

import runpy
from pathlib import Path

import numpy as np

from ..structure import ModelError
from . import EFFECTS
from .base import BodyForce, Effect, ElementForce, ElementMotion, StaticFactor

INSTANTS = 64
"""Of the motion that a function is tried on: to the largest crush, back, and beyond, to apart."""
LARGEST_CRUSH = 0.2
"""m, of that motion."""


def load_effects(path: str | Path) -> dict[str, Effect]:
    """Every `Effect` that the file defines at its top level, by name.

    Raises ModelError with one line where the file fails, defines none, takes a name of the vocabulary, or where a
    function of one fails on a motion that it is tried on.
    """
    try:
        content = runpy.run_path(str(path))
    except (Exception, SystemExit) as error:  # whatever a user's file may raise
        raise ModelError(f"{path}: {type(error).__name__}: {error}") from None
    found = {value.name: value for value in content.values() if isinstance(value, Effect)}
    if not found:
        raise ModelError(f"{path} defines no effect: give one of the kinds of crash_estimator.core.effects.base a name")
    taken = [name for name in found if name in EFFECTS]
    if taken:
        raise ModelError(f"{path}: {taken[0]!r} is an effect of the vocabulary already: choose another name")
    for effect in found.values():
        _try_out(path, effect)
    return found


def _try_out(path: str | Path, effect: Effect) -> None:
    time = np.linspace(0.0, 0.1, INSTANTS)
    crush = LARGEST_CRUSH * np.sin(40.0 * time)
    peak, rate = np.maximum.accumulate(crush), np.gradient(crush, time)
    function, argument = {
        ElementForce: ("force", ElementMotion(time, crush, rate, peak, 1e5 * np.maximum(crush, 0.0))),
        StaticFactor: ("factor", rate),
        BodyForce: ("force", time),
    }.get(type(effect), ("", None))
    if not function:
        return
    where = f"{path}: {function} of {effect.name!r}"
    shapes = {n: s.starts[0] * (LARGEST_CRUSH if s.of_crush else 1.0) for n, s in effect.shapes.items()}
    try:
        with np.errstate(all="ignore"):
            values = np.asarray(getattr(effect, function)(argument, **shapes), dtype=float)
    except (Exception, SystemExit) as error:  # whatever a user's function may raise
        raise ModelError(f"{where} fails on a motion it was tried on: {type(error).__name__}: {error}") from None
    if values.shape not in ((), time.shape):
        raise ModelError(f"{where} must give one number for each of the {INSTANTS} instants, it gives {values.shape}")
    bad = np.flatnonzero(~np.isfinite(np.broadcast_to(values, time.shape)))
    if len(bad):
        at = f"crush {crush[bad[0]]:.3g} m, rate {rate[bad[0]]:.3g} m/s"
        raise ModelError(f"{where} must be finite wherever a test may go; at {at} it is {values.flat[bad[0]]}")
