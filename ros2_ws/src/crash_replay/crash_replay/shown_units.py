"""Units for people to read, that suit the size: kN and m for a car, N and mm for a small rig. Everything else is SI."""

from collections.abc import Iterable, Mapping

import numpy as np

from .gravity import G
from .recording import SI_UNIT

SCALES: Mapping[str, tuple[tuple[float, str, float], ...]] = {
    "N": ((1000.0, "kN", 1e-3), (0.0, "N", 1.0)),
    "m": ((1.0, "m", 1.0), (0.0, "mm", 1e3)),
    "N/m": ((1e4, "kN/m", 1e-3), (0.0, "N/m", 1.0)),
    "N*s": ((1000.0, "kN s", 1e-3), (0.0, "N s", 1.0)),
    "m/s^2": ((0.0, "g", 1.0 / G),),
    "N*s/m": ((0.0, "N s/m", 1.0),),
}
"""SI unit -> from which size on, the unit shown, and the factor to it; the largest first."""


def readable(unit: str, values: Iterable[float] = ()) -> tuple[str, float]:
    """The unit in which values of an SI unit are shown, all in the same, and the factor to it."""
    sizes = np.abs(np.asarray(list(values), dtype=float))
    largest = float(np.nanmax(sizes)) if np.isfinite(sizes).any() else 0.0
    for least, shown, factor in SCALES.get(unit, ()):
        if largest >= least:
            return shown, factor
    return unit, 1.0


def scale_of(quantity: str, values: Iterable[float]) -> tuple[str, float]:
    """The same for a channel's quantity."""
    return readable(SI_UNIT[quantity], values)
