"""The initial velocities that an ISO-MME header states."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from .. import limits
from ..recording import Channel, RecordingError
from ..sensor_agreement import velocity_change
from ..shortened import shortened
from .units import KMH, si_factor

KEY = re.compile(r"velocity test object (\w)(?: lon\.?)?")
STATED = re.compile(r"([-+]?[0-9.]+(?:[eE][-+]?\d+)?)[ ;,]*(\S*)")
LIKE_KMH = (0.7, 1.5)
"""Change of a car's velocity in a crash, by the velocity it had, rebound included: of one in km/h a third of that."""


def initial_velocity(
    file: Path,
    header: Mapping[str, str],
    bodies: Sequence[tuple[str, str]],
    time: np.ndarray,
    columns: Mapping[Channel, np.ndarray],
) -> tuple[dict[str, float], list[str]]:
    """m/s of each body of a test object whose velocity the header gives (in m/s, or with its unit), and notes.

    bodies: of each channel its test object and its body; columns: (n,) SI values at time (n,) in s.
    """
    velocity: dict[str, float] = {}
    notes: list[str] = []
    for key, text in header.items():
        test_object, stated = KEY.fullmatch(key), STATED.fullmatch(text)
        if not test_object:
            continue
        if not stated:
            if text.upper() not in ("", "NOVALUE"):
                notes.append(f"{key}: expected a velocity, found {limits.shown(text)}: not used")
            continue
        try:
            speed = float(stated[1]) * si_factor("velocity", stated[2] or "m/s")
            if wrong := limits.VELOCITY.wrong(speed):
                raise RecordingError(wrong)
        except ValueError as error:
            raise RecordingError(f"{file}: {key}: {error}") from None
        moved = list(dict.fromkeys(body for code, body in bodies if code == test_object[1]))
        velocity |= dict.fromkeys(moved, speed)
        if moved:
            notes.append(f"initial velocity {speed:.4g} m/s along the object's own x: {shortened(moved)}")
        if not stated[2] and _like_kmh(speed, moved, time, columns):
            notes.append(
                f"{key}: {speed:g} m/s, as the standard has it, are three times what the signals take away: "
                f"in km/h? --names sets it: initial_velocity: {{{moved[0]}: {speed * KMH:.4g}}}"
            )
    return velocity, notes


def _like_kmh(speed: float, bodies: Sequence[str], time: np.ndarray, columns: Mapping[Channel, np.ndarray]) -> bool:
    """Whether what a car of them loses is what it had if the number is in km/h."""
    for channel, values in columns.items():
        is_car = channel.body in bodies and channel.body.endswith("car")
        if is_car and (channel.quantity, channel.axis) == ("acceleration", "x") and np.isfinite(values).all():
            low, high = LIKE_KMH
            return low * abs(speed) * KMH < abs(velocity_change(time, values)) < high * abs(speed) * KMH
    return False
